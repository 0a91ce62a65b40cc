"""`kiks evolve`."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.engine_start import ready_batch
from kiks.cli.options import Seed, written_folder
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError

if TYPE_CHECKING:
    from kiks.control.controller import Controller
    from kiks.learn.evolution import Evolution
    from kiks.learn.task import Task


class AlgorithmName(enum.StrEnum):
    """The algorithms."""

    CMA = "cma"
    GA = "ga"
    MAP_ELITES = "map-elites"


class ControllerKind(enum.StrEnum):
    """The controllers that come with KiKS."""

    LINEAR = "linear"
    MLP = "mlp"
    CTRNN = "ctrnn"
    GRU = "gru"


def evolve(
    task: Annotated[str, typer.Argument(help="A task (--list shows them), or a Python file that holds one.")] = "avoid",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of champion, log and picture; kiks-evolve-TASK if left out.", callback=written_folder
        ),
    ] = None,
    generations: Annotated[
        int | None, typer.Option(help="Generations; as many as the task wants if --seconds is not given either.", min=1)
    ] = None,
    seconds: Annotated[float | None, typer.Option(help="Begin no generation later than this [s].", min=0)] = None,
    population: Annotated[int | None, typer.Option(help="Candidates in a generation.", min=4)] = None,
    algorithm: Annotated[
        AlgorithmName | None, typer.Option(help="cma if left out; map-elites for maze-qd, ga for pursuit.")
    ] = None,
    controller: Annotated[
        ControllerKind | None, typer.Option(help="The controller to evolve; the task's own if left out.")
    ] = None,
    seed: Seed = 0,
    ray: Annotated[
        str | None,
        typer.Option(help="Evaluate on a Ray cluster: its address, auto, or local; on all cores here if left out."),
    ] = None,
    list_: Annotated[bool, typer.Option("--list", help="List the tasks that come with KiKS.")] = False,
) -> None:
    """Evolve a controller for a task, and write champion.toml, log.parquet and fitness.png.

    After Ctrl-C or a kill, the same command continues the evolution. In pursuit, predator and prey evolve against each
    other: predator.toml and prey.toml are the champions, and tournament.png tells who progressed.

    Example: kiks evolve avoid --seed 1 --out runs/avoid
    """
    from kiks.learn import tasks

    if list_:
        for name in tasks.TASKS:
            typer.echo(f"{name:10} {tasks.load(name).about}")
        for name, make in tasks.CONTESTS.items():
            typer.echo(f"{name:10} {make().about}")
        return
    ready_batch()
    if task in tasks.CONTESTS:
        from kiks.cli.coevolve import coevolve

        if controller is not None:
            raise ParameterError(f"--controller must be left out with {task}, but it was {controller}.")
        coevolve(
            tasks.CONTESTS[task](),
            str(algorithm or AlgorithmName.GA),
            out or Path(f"kiks-evolve-{task}"),
            seed=seed,
            population=population,
            generations=generations,
            seconds=seconds,
            where="threads" if ray is None else _ray(ray),
        )
        return
    chosen = tasks.load(task)
    if controller is not None:
        chosen = tasks.load(task, _controller(controller, chosen))
    name = algorithm or (AlgorithmName.MAP_ELITES if task == "maze-qd" else AlgorithmName.CMA)
    folder = out or Path(f"kiks-evolve-{chosen.name}")
    from kiks.learn.evolution import Evolution

    evolution = Evolution(chosen, str(name), seed=seed, population=population, folder=folder)
    if evolution.generations:
        typer.echo(f"Continuing after generation {len(evolution.generations)} in {folder}.")
    until = chosen.generations if generations is None and seconds is None else generations
    where = "threads" if ray is None else _ray(ray)
    end_as_with_ctrl_c()
    stopped = _run(evolution, until, seconds, where)
    if evolution.generations:
        _finish(evolution, folder, stopped=stopped)
    elif stopped:
        typer.echo("kiks: stopped.", err=True)
    if stopped:
        raise typer.Exit(130)


def _run(evolution: Evolution, generations: int | None, seconds: float | None, where: str) -> bool:
    """Run an evolution and show its progress; return whether it was interrupted."""
    from kiks.cli.evolution_progress import progress_of

    try:
        with progress_of(evolution, generations, seconds) as show:
            evolution.run(generations=generations, seconds=seconds, executor=where, each=show)
    except KeyboardInterrupt:
        return True
    return False


def _finish(evolution: Evolution, folder: Path, *, stopped: bool) -> None:
    """Save the picture, and print the result."""
    from kiks.learn.evolution_plot import save_plot

    champion = evolution.champion
    save_plot(evolution, folder / "fitness.png")
    figures = ", ".join(f"{name} {value:.4g}" for name, value in champion.measures.items())
    typer.echo(f"Champion of generation {champion.generation}: fitness {champion.fitness:.4f}   {figures}")
    if stopped:
        typer.echo(f"Stopped after generation {len(evolution.generations)}; the same command continues.")
    typer.echo(f"Folder: {folder}   See it drive: kiks demo {folder / 'champion.toml'}")
    if not stopped and evolution.task.exam is not None:
        typer.echo(evolution.task.exam.examine(champion, robots=evolution.task.robots))


def _controller(kind: ControllerKind, task: Task) -> Controller:
    """Return a controller of a kind with the senses and the speed limit of a task's own."""
    from kiks.control.controllers import from_recipe
    from kiks.learn.ready_tasks import SPEED_LIMIT

    recipe: dict[str, Any] = {"kind": str(kind), "senses": list(task.controller.senses), "speed_limit": SPEED_LIMIT}
    if kind is ControllerKind.CTRNN:
        recipe["period_s"] = task.timing.period_s
    return from_recipe(recipe)


def _ray(address: str) -> str:
    """Return the place for --ray."""
    return "ray" if address == "local" else f"ray:{address}"
