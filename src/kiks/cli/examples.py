"""`kiks examples`, and the list of demonstrations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kiks.cli.run import RunCommand
from kiks.errors import ParameterError, shown


class DemoCommand(RunCommand):
    """`kiks run` for demonstrations, which it lists when it is given none."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Also understand --list, and no words at all."""
        if args in ([], ["--list"]):
            list_demonstrations()
            ctx.exit()
        return super().parse_args(ctx, args)


def list_demonstrations() -> None:
    """Print what each demonstration shows, in the first line of its program."""
    import ast

    from kiks.model.project import Project
    from kiks.model.shipped import demonstrations

    typer.echo("kiks demo NAME runs a demonstration, kiks demo NAME --desk shows it in the browser:\n")
    for name, path in demonstrations().items():
        program = next(robot.program for robot in Project.load(path).robots if robot.program)
        text = ast.get_docstring(ast.parse((path.parent / program).read_text(encoding="utf-8"))) or ""
        typer.echo(f"  {name:<13} {text.splitlines()[0]}")
    typer.echo("\nkiks examples OUT copies their programs into a folder, to be changed.")


def examples(out: Annotated[Path, typer.Argument(help="A new folder.")]) -> None:
    """Copy the example programs, arenas and projects into a folder of yours, to be changed.

    Example: kiks examples first
    """
    import shutil

    from kiks.model.shipped import shipped

    if out.exists():
        raise ParameterError(f"OUT must be a new folder, but {shown(str(out))} exists. Choose another name.")
    try:
        shutil.copytree(shipped("examples"), out, ignore=shutil.ignore_patterns("__pycache__"))
    except OSError as error:
        raise ParameterError(f"Cannot write {shown(str(out))}: {error.strerror}. Choose another folder.") from None
    typer.echo(f"Copied to {out}. Try: kiks run {out / 'demos' / 'avoid.py'}")
