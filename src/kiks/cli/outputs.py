"""What a command was told, checked before it begins: values, files that it would write, and options without an effect.

Need: no command destroys what it reads or what a person has made, and none ignores an option. A script gets the results
of a command, and nothing else. Method: `output` marks the options and arguments that name a file to be written.
`Command` compares it with all other words of the command. With --json, all that a command and its programs print goes
to the error output, but for the results.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from contextvars import ContextVar
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, get_args

import typer

from kiks.cli.command_line import OneLineCommand
from kiks.errors import ParameterError, figure, printable, shown
from kiks.meant import nearest
from kiks.model.atomic_files import check_writable, ending_of
from kiks.model.replaceable import is_replaceable


def output(
    *endings: str,
    default: Callable[[Mapping[str, Any]], Path | None] | None = None,
    beside: str = "",
    kind: str = "",
    is_new: bool = False,
) -> Callable[[Path | None], Path | None]:
    """Return the callback of an option or argument that names a file to be written; `Command` checks it.

    Args:
        endings: What its name may end in; anything if there is none.
        default: The file if it is left out, from all values; none if left out.
        beside: Ending of another file that is written beside it.
        kind: What it is, where its ending does not say that; see `kiks.model.replaceable`.
        is_new: Whether it replaces no file, not even with --force.
    """

    def unchanged(value: Path | None) -> Path | None:
        return value

    unchanged.output = (endings, default, beside, kind, is_new)  # type: ignore[attr-defined]
    return unchanged


_OF_PEOPLE = (".toml",)
"""Endings of files that are always the work of people: arenas, robots, champions."""

_JSON, _RESULTS = "kiks.json", "kiks.results"
_quiet = ContextVar("quiet", default=False)


def has_results(function: Callable[..., None]) -> Callable[..., None]:
    """Mark a command that calls `tell_results`, so that it takes --json."""
    function.has_results = True  # type: ignore[attr-defined]
    return function


def shows_progress(function: Callable[..., None]) -> Callable[..., None]:
    """Mark a command that shows how far it is, so that it takes --quiet."""
    function.shows_progress = True  # type: ignore[attr-defined]
    return function


def is_quiet() -> bool:
    """Return whether the command that runs is to show no progress."""
    return _quiet.get()


def tell_results(context: typer.Context, results: object, lines: Iterable[str] = ()) -> None:
    """Print what a command has found: the lines, or with --json the results alone, when the command ends."""
    if context.meta.get(_JSON):
        context.meta[_RESULTS] = results
        return
    for line in lines:
        typer.echo(line)


def json_of(results: object) -> str:
    """Return results as JSON, which has no NaN and no infinity: they become null.

    Example:
        >>> json_of([1.5, float("nan")]).split()
        ['[', '1.5,', 'null', ']']
    """
    plain = json.loads(json.dumps(results), parse_constant=lambda _: None)
    return json.dumps(plain, indent=2, ensure_ascii=False)


@contextmanager
def _alone(context: Any) -> Iterator[None]:
    """Let what is printed meanwhile go to the error output, also by other processes, and print the results then."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        if _RESULTS in context.meta:
            typer.echo(json_of(context.meta[_RESULTS]))


_adding = typer.Typer(add_completion=False)


@_adding.command()
def _added(
    json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON; all else goes to the error output.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show no progress.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace files of any kind.")] = False,
) -> None:
    pass


class Command(OneLineCommand):
    """A command that begins when nothing speaks against what it was told.

    It takes --json if it has results for scripts, --quiet if it shows progress, and --force if it writes files.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        marked = [(param, getattr(param.callback, "output", None)) for param in self.params]
        self._outputs = [(param, found) for param, found in marked if found]
        for_scripts, quieting, forcing = typer.main.get_command(_adding).params[:3]
        if getattr(self.callback, "has_results", False):
            self.params.append(for_scripts)
        self._shows_progress = getattr(self.callback, "shows_progress", False)
        if self._shows_progress:
            self.params.append(quieting)
        if not all(is_new for _, (*_, is_new) in self._outputs):
            self.params.append(forcing)
        for param in self.params:
            _say_plainly(param)

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words after the command's name in its usage: what may be left out stands in brackets."""
        pieces = ["[OPTIONS]"] if any(param.param_type_name == "option" for param in self.params) else []
        for param in self.params:
            if param.param_type_name == "argument":
                word = _name(param) + "..." * (param.nargs != 1)
                pieces.append(word if param.required else f"[{word}]")
        return pieces or ["[OPTIONS]"]

    def invoke(self, ctx: Any) -> Any:
        """Run it; with --json, only the results reach the standard output."""
        with _alone(ctx) if ctx.meta.get(_JSON) else nullcontext():
            return super().invoke(ctx)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Also check what is told twice, and the outputs."""
        if ctx.resilient_parsing:  # A shell asks what may follow.
            return super().parse_args(ctx, args)
        try:
            left = super().parse_args(ctx, list(args))
        except typer.BadParameter as error:
            param: Any = error.param
            if param is None:
                raise
            given, alone, _ = self.make_parser(ctx).parse_args(list(args))
            value = given.get(param.name)
            if value in (None, ()):
                raise ParameterError(self._missing(ctx, param, given, alone)) from None
            if not (rule := _rule(param)):
                raise
            raise ParameterError(
                f"{_name(param)} must be {rule}, but it was {shown(value)}.{_meant(param, str(value))}"
            ) from None
        given, _, order = self.make_parser(ctx).parse_args(list(args))
        for param in order:
            if given[param.name] == "" and "path" in param.display_type(ctx):
                raise ParameterError(f"{_name(param)} must be the name of a file, but it is empty. Write one.")
            if order.count(param) > 1 and param.nargs == 1 and not getattr(param, "multiple", False):
                raise ParameterError(f"{_name(param)} must be given once, but it was given {order.count(param)} times.")
        ctx.meta[_JSON] = ctx.params.pop("json", False)
        _quiet.set(self._shows_progress and ctx.params.pop("quiet"))
        self._check_outputs(ctx.params, is_forced=ctx.params.pop("force", False))
        return left

    def _missing(self, ctx: Any, param: Any, given: Mapping[str, Any], alone: list[str]) -> str:
        """Return what is to be said if a required option or argument was not given."""
        names, words = _name(param), []
        if param.param_type_name == "argument":
            # With one word of two, the library misses the first, and a person has left out the last.
            needed = [each for each in self.params if each.param_type_name == "argument" and each.required]
            names = " and ".join(map(_name, needed))
            words = [str(value) for each in needed if (value := given.get(str(each.name)))]
        elif alone:
            return f"{names} must be given, but {shown(alone[0])} stands alone. Write {names} {printable(alone[0])}."
        found = f"only {shown(words[0])} was" if words else "nothing was"
        return f"{names} must be given, but {found}. {ctx.command_path} -h shows how."

    def _check_outputs(self, told: dict[str, Any], *, is_forced: bool) -> None:
        outputs = {param.name: param for param, _ in self._outputs}
        others = [path for name, value in told.items() if name not in outputs for path in _files(value)]
        for param, (endings, default, beside, kind, is_new) in self._outputs:
            value = told[param.name] = told[param.name] or (default and default(told))
            if value is None:
                continue
            check_writable(value, what := _name(param), is_new=is_new)
            ending = ending_of(value, what, endings) if endings else ""
            own = (value, value.with_suffix(beside)) if beside else (value,)
            for path in own:
                if found := next((each for each in others if _is_same(path, each)), None):
                    raise ParameterError(
                        f"{what} must be a file that the command does not need besides, but {str(path)!r} belongs to "
                        f"{str(found)!r}. Choose another name."
                    )
                if not (is_forced or is_replaceable(path, kind or ending)):
                    like = "" if ending in _OF_PEOPLE else " or replace a file of its kind that KiKS has written"
                    raise ParameterError(
                        f"{what} must be new{like}, but {str(path)!r} exists. Choose another name or add --force."
                    )
            others.extend(own)


def leave_out(context: typer.Context, when: str, *names: str) -> None:
    """Raise if one of some options was given where it has no effect, by their names in the command's function."""
    for param in context.command.params:
        source = context.get_parameter_source(param.name or "")
        if source and source.name == "COMMANDLINE" and param.name in names:
            given = context.params.get(param.name or "", True)
            value = shown(str(given) if isinstance(given, Path) else given)
            raise ParameterError(f"{_name(param)} must be left out {when}, but it was {value}.")


def _name(param: Any) -> str:
    if param.param_type_name == "option":
        return str(param.opts[0])
    return str(param.metavar or param.name.upper()).removesuffix("...")


def _limits(param: Any) -> str | None:
    """Return between which numbers a parameter must be; None if it may be any."""
    if param.min is None or param.max is None:
        bound = param.max if param.min is None else param.min
        return None if bound is None else f"at {'most' if param.min is None else 'least'} {figure(bound)}"
    return f"from {figure(param.min)} to {figure(param.max)}"


def _rule(param: Any) -> str:
    """Return what a parameter must be; nothing if a library knows better."""
    kind = param.type_descriptor.annotation
    if kind in (int, float):
        return " ".join(filter(None, ("a whole number" if kind is int else "a number", _limits(param))))
    return f"one of {', '.join(choices)}" if (choices := _choices(kind)) else ""


def _choices(kind: Any) -> list[str]:
    values = [each.value for each in kind] if isinstance(kind, type) and issubclass(kind, Enum) else get_args(kind)
    return [*values] if all(isinstance(each, str) for each in values) else []


def _meant(param: Any, value: str) -> str:
    """Return ' Did you mean X?' for a choice with a slip, and for a number with its unit or a comma; or nothing."""
    kind = param.type_descriptor.annotation
    if kind not in (int, float):
        return nearest(value, _choices(kind))
    number = re.match(r"[0-9]+([.,][0-9]+)?" if kind is float else "[0-9]+", value)
    meant = "" if number is None else number[0].replace(",", ".")
    return f" Did you mean {meant}?" if meant not in ("", value) else ""


def _say_plainly(param: Any) -> None:
    """Let the help name what a parameter takes as people do, in place of a type of Python."""
    param._get_number_range_help_str = lambda: _limits(param)
    if param.param_type_name == "argument":
        param.metavar = _name(param) + "..." * (param.nargs != 1)
        param.display_type_rich = lambda ctx: ""
        record = param.get_help_record
        # Without brackets in the usage, it is required: that need not be said twice.
        param.get_help_record = lambda ctx: (found := record(ctx)) and (found[0], found[1].removesuffix("  [required]"))
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
