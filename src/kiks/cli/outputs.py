"""What a command was told, checked before it begins: the files that it would write, and options without an effect.

Need: no command destroys what it reads or what a person has made, and none ignores an option. Method: `output` marks
the options and arguments that name a file to be written. `Command` compares it with all other words of the command.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from kiks.errors import ParameterError, shown
from kiks.model.atomic_files import check_writable, ending_of

# fmt: off
BEGINNINGS = {
    "": rb"\d+\n", ".csv": rb"time_s,", ".gif": rb"GIF8", ".html": rb"<!DOCTYPE html>", ".jpg": rb"\xff\xd8",
    ".mat": rb"MATLAB 5.0", ".mcap": rb"\x89MCAP0", ".mp4": rb"....ftyp", ".parquet": rb"PAR1", ".pdf": rb"%PDF",
    ".png": rb"\x89PNG", ".svg": rb"<\?xml|<svg", ".webp": rb"RIFF....WEBP",
}
# fmt: on
"""How files begin that one of the same kind may replace, by their endings; thinking times have none. Others, such as
arenas, are the work of people."""


def output(
    *endings: str,
    default: Callable[[Mapping[str, Any]], Path | None] | None = None,
    beside: str = "",
    is_new: bool = False,
) -> Callable[[Path | None], Path | None]:
    """Return the callback of an option or argument that names a file to be written; `Command` checks it.

    Args:
        endings: What its name may end in; anything if there is none.
        default: The file if it is left out, from all values; none if left out.
        beside: Ending of another file that is written beside it.
        is_new: Whether it replaces no file, not even with --force.
    """

    def unchanged(value: Path | None) -> Path | None:
        return value

    unchanged.output = (endings, default, beside, is_new)  # type: ignore[attr-defined]
    return unchanged


_forcing = typer.Typer(add_completion=False)


@_forcing.command()
def _forced(force: Annotated[bool, typer.Option("--force", help="Replace files of any kind.")] = False) -> None:
    pass


class Command(TyperCommand):
    """A command that begins when nothing speaks against what it was told; with outputs it takes --force, too."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        marked = [(param, getattr(param.callback, "output", None)) for param in self.params]
        self._outputs = [(param, found) for param, found in marked if found]
        if not all(is_new for _, (*_, is_new) in self._outputs):
            self.params.append(typer.main.get_command(_forcing).params[0])
        for param in self.params:
            _say_plainly(param)

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words after the command's name in its usage: what may be left out stands in brackets."""
        pieces = ["[OPTIONS]"] if any(param.param_type_name == "option" for param in self.params) else []
        for param in self.params:
            if param.param_type_name == "argument":
                word = _name(param) + "..." * (param.nargs != 1)
                pieces.append(word if param.required else f"[{word}]")
        return pieces

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Also check what is told twice, and the outputs."""
        left = super().parse_args(ctx, list(args))
        order = self.make_parser(ctx).parse_args(list(args))[2]
        for param in order:
            if order.count(param) > 1 and param.nargs == 1 and not getattr(param, "multiple", False):
                raise ParameterError(f"{_name(param)} must be given once, but it was given {order.count(param)} times.")
        self._check_outputs(ctx.params, is_forced=ctx.params.pop("force", False))
        return left

    def _check_outputs(self, told: dict[str, Any], *, is_forced: bool) -> None:
        outputs = {param.name: param for param, _ in self._outputs}
        others = [path for name, value in told.items() if name not in outputs for path in _files(value)]
        for param, (endings, default, beside, is_new) in self._outputs:
            value = told[param.name] = told[param.name] or (default and default(told))
            if value is None:
                continue
            check_writable(value, what := _name(param), is_new=is_new)
            beginning = BEGINNINGS.get(ending_of(value, what, endings) if endings else "")
            own = (value, value.with_suffix(beside)) if beside else (value,)
            for path in own:
                if found := next((each for each in others if _is_same(path, each)), None):
                    raise ParameterError(
                        f"{what} must be a file that the command does not need besides, but {str(path)!r} belongs to "
                        f"{str(found)!r}. Choose another name."
                    )
                if not (is_forced or _is_replaceable(path, beginning)):
                    like = " or replace a file of its kind" if beginning else ""
                    raise ParameterError(
                        f"{what} must be new{like}, but {str(path)!r} exists. Choose another name or add --force."
                    )
            others.extend(own)


def leave_out(context: typer.Context, when: str, *names: str) -> None:
    """Raise if one of some options was given where it has no effect, by their names in the command's function."""
    for param in context.command.params:
        source = context.get_parameter_source(param.name or "")
        if source and source.name == "COMMANDLINE" and param.name in names:
            given = context.params.get(param.name or "")
            value = shown(str(given) if isinstance(given, Path) else given)
            raise ParameterError(f"{_name(param)} must be left out {when}, but it was {value}.")


def _name(param: Any) -> str:
    if param.param_type_name == "option":
        return str(param.opts[0])
    return str(param.metavar or param.name.upper()).removesuffix("...")


def _say_plainly(param: Any) -> None:
    """Let the help name what a parameter takes as people do, in place of a type of Python."""
    if param.param_type_name == "argument":
        param.metavar = _name(param) + "..." * (param.nargs != 1)
        param.display_type_rich = lambda ctx: ""
    elif not getattr(param, "is_flag", False):
        words = {"int": "N", "float": "NUMBER", "path": "FILE", "": "TEXT"}
        param.display_type_rich = lambda ctx: (
            param.metavar or next(word for kind, word in words.items() if kind in param.display_type(ctx))
        )


def _files(value: object) -> Iterator[Path]:
    """Yield the files that a value names, also in words such as post.sam=27 and replay:times."""
    for word in value if isinstance(value, list | tuple) else [value]:
        yield from map(Path, filter(os.path.isfile, {str(word), *re.split(r"[=:\s]", str(word))}))


def _is_same(path: Path, other: Path) -> bool:
    """Return whether two paths lead to one file, or an arena or a project names the one in its folder or below."""
    with suppress(OSError):
        if other.exists() and path.exists() and path.samefile(other):
            return True
        if other.suffix.lower() in (".toml", ".kiks") and path.resolve().is_relative_to(other.resolve().parent):
            return re.search(rb"[\"'/]%b[\"']" % re.escape(os.fsencode(path.name)), other.read_bytes()) is not None
    return os.path.realpath(path) == os.path.realpath(other)


def _is_replaceable(path: Path, beginning: bytes | None) -> bool:
    """Return whether there is no file, or one that is empty or begins so."""
    if not path.is_file():
        return True
    with path.open("rb") as file:
        data = file.read(1000)
    return not data or (beginning is not None and re.match(beginning, data, re.DOTALL) is not None)
