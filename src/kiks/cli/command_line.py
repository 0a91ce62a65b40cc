"""Mistakes in the words of a command line: each gets one line of KiKS, and the nearest command or option."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from kiks.errors import ParameterError, shown
from kiks.meant import nearest
from kiks.model.program_kinds import ENDINGS

ARENAS = (".toml", ".png", ".kad", ".yaml")
"""Endings of files that an arena may have; none of them is a program's."""

UsageError: Any = typer.BadParameter.__base__
"""The base of all errors of the library that reads the command line."""


class OneLineCommand(TyperCommand):
    """A command whose mistakes are errors of KiKS."""

    def make_context(self, info_name: Any, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Read the words of the command."""
        with _in_one_line(self, args, info_name, parent):
            return super().make_context(info_name, args, parent, **extra)


class Group(TyperGroup):
    """Commands with a common first word; `help` before a command is `-h` after it."""

    def make_context(self, info_name: Any, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Read the words before the command."""
        with _in_one_line(self, args, info_name, parent):
            words = [*args[1:], "-h"] if args[:1] == ["help"] else args
            return super().make_context(info_name, words, parent, **extra)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command."""
        if args[0] in self.commands or ctx.resilient_parsing or args[0].startswith("-"):
            return super().resolve_command(ctx, args)
        from kiks.model.shipped import demonstrations, shipped_arenas

        known = ["help", *self.commands, *_options(self)]
        if meant := opening(Path(args[0])):
            known = [meant]
        elif "info" in self.commands:
            known += [f"info {arena}" for arena in shipped_arenas()]
        else:
            known += [f"demo {name}" for name in demonstrations()]
            for name, command in self.commands.items():
                known += [f"{name} {word}" for word in [*getattr(command, "commands", ()), *_options(command)]]
        raise ParameterError(
            f"A command must be one that {ctx.command_path} -h lists, but {shown(args[0])} is none."
            f"{nearest(args[0], known)}"
        )


def command_group(text: str, **options: Any) -> typer.Typer:
    """Return a group of commands, of which one must be named.

    Args:
        text: Its help.
        options: Others of `typer.Typer`.
    """
    return typer.Typer(
        cls=Group, help=text, subcommand_metavar="COMMAND ...", options_metavar="", rich_markup_mode=None, **options
    )


def opening(file: Path) -> str:
    """Return the command for a file that was named without one; empty if there is no such file."""
    verbs = {".kiks": "desk", ".mcap": "replay"} | dict.fromkeys(ENDINGS, "run") | dict.fromkeys(ARENAS, "desk --arena")
    verb = verbs.get(file.suffix.lower())
    return f"{verb} {file}" if verb and file.is_file() else ""


def _options(command: Any) -> list[str]:
    return [name for param in command.params for name in param.opts if name.startswith("-")]


@contextmanager
def _in_one_line(command: Any, args: list[str], name: str, parent: Any) -> Iterator[None]:
    """Raise a mistake as an error of KiKS; a help that stands in for one stays as it is."""
    given = list(args)  # reading them takes them away
    try:
        yield
    except UsageError as error:
        if "\n" in (text := error.format_message()):
            raise
        path = f"{parent.command_path} {name}" if parent else name
        raise ParameterError(_said(error, text.rstrip("."), command, given, path, parent)) from None


def _said(error: Any, text: str, command: Any, args: list[str], path: str, parent: Any) -> str:
    option, how = getattr(error, "option_name", ""), f"{path} -h shows how."
    if hasattr(error, "possibilities"):
        # Of letters behind one hyphen the library names the first alone.
        option = next((word.partition("=")[0] for word in args if word.startswith(option)), option)
        group = command if hasattr(command, "commands") else parent and parent.command
        homes = [name for name, each in getattr(group, "commands", {}).items() if option in _options(each)]
        home = "run" if "run" in homes else "".join(homes[:1])
        hint = nearest(option, _options(command))
        if home:
            hint = f" It stands behind its command: {path.removesuffix(f' {command.name}')} {home} {option}."
        return f"An option must be one that {path} -h lists, but {shown(option)} is none.{hint}"
    if option and "not take" in text:
        return f"{option} must stand alone, but a value was given with it. Leave the value out."
    if option:
        return f"{option} must have a value after it, but there is none. {how}"
    if extra := re.search(r"extra argument\S* \((.*)\)", text):
        from kiks.model.shipped import shipped_arenas

        takes = " ".join(command.collect_usage_pieces(None))
        known = _options(command)
        known += [f"--arena {arena}" for arena in shipped_arenas()] if "--arena" in known else []
        hint = nearest(extra[1], known)
        return f"{path} must be followed by {takes} alone, but {shown(extra[1])} is one word more.{hint} {how}"
    return f"{text}. {how}"
