"""`kiks examples`, and the list of demonstrations."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from textwrap import indent
from typing import Annotated, Any

import typer

from kiks.cli.outputs import json_of
from kiks.cli.run import RunCommand
from kiks.errors import ParameterError, shown
from kiks.table import Table


class DemoCommand(RunCommand):
    """`kiks run` for demonstrations, which it lists when it is given none."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        words: dict[str | None, Any] = {param.name: param for param in self.params}
        words["program"].metavar, words["program"].help = "NAME", "The demonstration; without one, they are listed."
        words["arguments"].hidden = True

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Say that the name may be left out, and leave out the arguments of programs."""
        return ["[OPTIONS]", "[NAME]"]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Also understand --list, and no words at all."""
        if not ctx.resilient_parsing and set(args) <= {"--list", "--json"}:
            found = _demonstrations()
            typer.echo(json_of(found) if "--json" in args else "\n".join(_lines_of(found)))
            ctx.exit()
        return super().parse_args(ctx, args)


def _demonstrations() -> list[dict[str, str]]:
    """Return what each demonstration shows, in the first line of its program."""
    from kiks.model.shipped import demonstrations

    return [{"name": name, "about": first_program(path)[1].splitlines()[0]} for name, path in demonstrations().items()]


def first_program(project: Path) -> tuple[Path, str]:
    """Return the first program of a project, and its docstring."""
    import ast

    from kiks.model.project import Project

    program = project.parent / next(robot.program for robot in Project.load(project).robots if robot.program)
    return program, ast.get_docstring(ast.parse(program.read_text(encoding="utf-8"))) or ""


def _lines_of(found: list[dict[str, str]]) -> Iterator[str]:
    yield "kiks demo NAME runs a demonstration, kiks demo NAME --desk shows it in the browser:\n"
    yield indent(str(Table((), (each.values() for each in found), left_count=2)), "  ")
    yield "\nkiks examples OUT copies their programs into a folder, to be changed."


def examples(out: Annotated[Path, typer.Argument(help="A new folder.")]) -> None:
    """Copy the example programs, arenas and projects into a folder.

    Example: kiks examples first
    """
    import shutil

    from kiks.model.package import shipped

    if out.exists():
        raise ParameterError(f"OUT must be a new folder, but {shown(str(out))} exists. Choose another name.")
    try:
        shutil.copytree(shipped("examples"), out, ignore=shutil.ignore_patterns("__pycache__"))
    except OSError as error:
        raise ParameterError(f"Cannot write {shown(str(out))}: {error.strerror}. Choose another folder.") from None
    typer.echo(f"Copied to {out}. Try: kiks run {out / 'demos' / 'avoid.py'}")
