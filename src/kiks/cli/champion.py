"""`kiks champion`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kiks.cli.options import say
from kiks.cli.outputs import leave_out, output
from kiks.errors import ParameterError, shown
from kiks.version import __version__


def champion(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(help="The folder of an evolution of one controller.")],
    out: Annotated[Path, typer.Argument(metavar="OUT.toml", help="The champion's file.", callback=output(".toml"))],
    at: Annotated[
        str | None,
        typer.Option(help="The elite of this place in the archive: a number for each axis.", metavar="X,Y"),
    ] = None,
    generation: Annotated[int | None, typer.Option(help="A candidate of this generation.", min=1)] = None,
    rank: Annotated[int, typer.Option(help="With --generation: 1 for its best, 2 for the next.", min=1)] = 1,
    world: Annotated[
        int, typer.Option(help="With --generation: in which of the worlds of its evaluation, from 0.", min=0)
    ] = 0,
    task: Annotated[
        str | None, typer.Option(help="With --generation: the file of the task, if it is a Python file or was moved.")
    ] = None,
) -> None:
    """Write another controller of an evolution as a champion's file.

    It may be an elite of its archive, or any candidate. `kiks run OUT.toml` lets it drive. A candidate drives in a
    world of its evaluation, as it did there.

    Example: kiks champion runs/avoid third.toml --generation 12 --rank 3
    """
    if (at is None) == (generation is None):
        raise ParameterError("either --at or --generation must be given, but there was none, or both.")
    if at is not None:
        leave_out(context, "with --at", "rank", "world", "task")
        _save_elite(folder, at, out)
    else:
        assert generation is not None
        _save_candidate(folder, generation, rank, world, task, out)


def _save_elite(folder: Path, at: str, out: Path) -> None:
    from kiks.learn.archive import Archive

    try:
        place = [float(word) for word in at.split(",")]
    except ValueError:
        raise ParameterError(f"--at must be numbers such as 300,450, but it was {shown(at)}.") from None
    archive = Archive.load(folder)
    elite = archive.elite_at(*place)
    archive.champion_of(elite).save(out)
    where = ", ".join(f"{axis.measure} {elite.values[axis.measure]:.4g}" for axis in archive.axes)
    typer.echo(f"The elite nearest to {at}: {where}, fitness {elite.fitness:.4g}, of generation {elite.generation}.")


def _save_candidate(folder: Path, generation: int, rank: int, world: int, task: str | None, out: Path) -> None:
    from kiks.learn import tasks
    from kiks.learn.individual import load_individual

    given = None if task is None else tasks.load(task)
    found, number = load_individual(folder, generation, rank=rank, world=world, task=given)
    found.save(out)
    typer.echo(f"Candidate {number} of generation {generation}: rank {rank}, fitness {found.fitness:.4f}")
    if found.kiks != __version__:
        say(f"KiKS {found.kiks} has evaluated it. This is KiKS {__version__}, where it may drive differently.")
    if found.timing.baud is None:
        say(f"it was evaluated without a serial line; here it drives on one of {found.baud} baud.")
