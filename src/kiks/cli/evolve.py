"""`kiks evolve`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from kiks.cli.engine_start import ready_batch, ready_engine
from kiks.cli.evolution_progress import Progress
from kiks.cli.options import Seed, written_folder
from kiks.cli.outputs import has_results, is_quiet, leave_out, shows_progress, tell_results
from kiks.cli.record import RecordFile, recorded
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, shown
from kiks.learn.algorithm_name import AlgorithmName
from kiks.meant import nearest
from kiks.table import Table

if TYPE_CHECKING:
    from kiks.control.controller import Controller
    from kiks.learn.evolution import Evolution
    from kiks.learn.finals import MasterTournament
    from kiks.learn.results import Result
    from kiks.learn.task import Task


class PlotEnding(StrEnum):
    """Kinds of pictures: the ending of their files."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


PERIODS = 5
"""Number of periods of an evolution of two sides whose winners are listed."""


@has_results
@shows_progress
def evolve(
    context: typer.Context,
    task: Annotated[str, typer.Argument(help="A task (--list shows them), or a Python file that holds one.")] = "avoid",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of champion, archive, log and picture; kiks-evolve-TASK if left out.", callback=written_folder
        ),
    ] = None,
    generations: Annotated[
        int | None, typer.Option(help="Generations; as many as the task wants if --seconds is not given either.", min=1)
    ] = None,
    seconds: Annotated[float | None, typer.Option(help="Begin no generation later than this [s].", min=0)] = None,
    population: Annotated[
        int | None, typer.Option(help="Candidates in a generation; the task's own if left out.", min=4)
    ] = None,
    algorithm: Annotated[
        str | None,
        typer.Option(
            metavar="NAME[:OPTION=VALUE,...]",
            help=f"One of {', '.join(AlgorithmName)}, with options such as cma:separable=true; the task's own if left "
            "out.",
        ),
    ] = None,
    controller: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="Kind of the controller, such as mlp; the task's own if left out."),
    ] = None,
    seed: Seed = 0,
    seeds: Annotated[
        int | None,
        typer.Option(help="Evolve so many times, with seeds from --seed on, each in a folder of its own.", min=1),
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(help="Evaluate on a Ray cluster: its address, auto, or local; on all cores here if left out."),
    ] = None,
    record: RecordFile = None,
    plots: Annotated[PlotEnding, typer.Option(help="Kind of its pictures; svg and pdf for print.")] = PlotEnding.PNG,
    tensorboard: Annotated[
        bool, typer.Option("--tensorboard", help="Write a log for TensorBoard into the folder, too.")
    ] = False,
    list_: Annotated[bool, typer.Option("--list", help="List the tasks that come with KiKS.")] = False,
) -> None:
    """Evolve a controller for a task.

    It writes champion.toml, archive.parquet, log.parquet and fitness.png. After Ctrl-C or a kill, the same command
    continues the evolution. With --seeds 10, ten evolutions run one after the other; a table, seeds.png and
    summary.json show their results. In pursuit, predator and prey evolve against each other, in football two players:
    predator.toml and prey.toml, or left.toml and right.toml, are the champions, and tournament.png shows which of them
    progressed. --record keeps the champion's drive from the first start of its exam.

    Example: kiks evolve avoid --seed 1 --out runs/avoid
    """
    from kiks.learn import tasks

    if list_:
        leave_out(context, "with --list", *(set(context.params) - {"list_"}))
        # The first line of their docstrings: a task itself takes up to two seconds to make.
        found = [{"name": name, "about": (make.__doc__ or "").partition("\n")[0]} for name, make in tasks.TASKS.items()]
        tell_results(context, found, [str(Table((), (each.values() for each in found), left_count=2))])
        return
    if seeds is not None:
        leave_out(context, "with --seeds", "record")
    chosen = tasks.load(task)
    if controller is not None:
        chosen = tasks.load(task, _controller(controller, chosen))
    if chosen.against:
        leave_out(context, f"with {chosen.name}, which has two sides", "record")
    folder = out or Path(f"kiks-evolve-{chosen.name}")
    until = chosen.generations if generations is None and seconds is None else generations
    from kiks.learn.evolution import Evolution
    from kiks.learn.results import seed_folder, summary_of

    results: list[Result] = []
    executor: Executor | None = None
    # Needed at the end in any case, and after Ctrl-C there is only a second.
    import_module("matplotlib.backends.backend_agg")
    end_as_with_ctrl_c()
    with ExitStack() as stack:
        for number in [seed] if seeds is None else range(seed, seed + seeds):
            home = folder if seeds is None else seed_folder(folder, number)
            evolution: Evolution | None = None
            try:
                evolution = Evolution(chosen, algorithm, seed=number, population=population, folder=home)
                if seeds is not None and not is_quiet():
                    typer.echo(f"Seed {number}:")
                if evolution.generations and not is_quiet():
                    typer.echo(f"Continuing after generation {len(evolution.generations)} in {home}.")
                if cluster is not None and executor is None:
                    from kiks.learn.ray_executor import RayExecutor

                    executor = stack.enter_context(RayExecutor(None if cluster == "local" else cluster))
                ready_batch()
                _run(evolution, until, seconds, executor, home if tensorboard else None)
                if evolution.generations:
                    results.append(_finish(evolution, home, plots))
                    if record is not None:
                        _record(evolution, home, record)
            except KeyboardInterrupt:
                _stop(evolution, home)
    if seeds is not None and results:
        _tell_seeds(results, folder, plots)
    if results:
        tell_results(context, summary_of(results))


def _run(
    evolution: Evolution, until: int | None, seconds: float | None, executor: Executor | None, log_in: Path | None
) -> None:
    """Run an evolution and show how far it is; with a log for TensorBoard in a folder, if one is given."""
    with ExitStack() as stack:
        told: list[Callable[[Evolution], None]] = []
        if log_in is not None:
            from kiks.learn import tensorboard_log

            told.append(stack.enter_context(tensorboard_log.TensorBoardLog(log_in / tensorboard_log.FOLDER)))
            told[0](evolution)  # what was evolved before
        progress = stack.enter_context(Progress(evolution, until, seconds))
        told.append(progress.each)

        def each(now: Evolution) -> None:
            for tell in told:
                tell(now)

        evolution.run(generations=until, seconds=seconds, executor=executor, each=each, each_round=progress.each_round)


def _finish(evolution: Evolution, folder: Path, plots: PlotEnding) -> Result:
    """Save result and pictures of an evolution that has come to its end, print the result, and return it."""
    from kiks.learn.plots import figure_of_evolution, figure_of_tournament, save_plot
    from kiks.learn.results import examined, load_result

    result = load_result(folder)
    if result is None:
        result = examined(evolution)
        result.save(folder)
    save_plot(figure_of_evolution(evolution, result.baselines), folder / f"fitness.{plots}")
    if (tournament := evolution.tournament) is not None:
        save_plot(figure_of_tournament(tournament), folder / f"tournament.{plots}")
        for line in winners_of(tournament):
            typer.echo(line)
    _tell_champion(evolution, folder)
    if (exam := result.exam) is not None:
        typer.echo(exam.text)
        typer.echo(f"With ten imperfect robots: {exam.imperfect_solved} of {exam.imperfect_starts} starts")
    return result


def winners_of(tournament: MasterTournament) -> Iterator[str]:
    """Yield a line for each period of an evolution: the fitness of its champions against each other, and the winner.

    The winner is the side with the higher fitness.
    """
    import numpy as np

    count = len(tournament.generations)
    for period in np.array_split(np.arange(count), min(PERIODS, count)):
        first, last = tournament.generations[period[[0, -1]]].tolist()
        of_sides = tournament.scores[:, period[0] : period[-1] + 1, period[0] : period[-1] + 1].mean(axis=(1, 2))
        figures = "   ".join(f"{name} {mean:.2f}" for name, mean in zip(tournament.sides, of_sides, strict=True))
        is_tie = of_sides[0] == of_sides[1]
        verdict = "a tie" if is_tie else f"the {tournament.sides[int(of_sides.argmax())]} won"
        numbers = f"Generation {first}" if first == last else f"Generations {first} to {last}"
        yield f"{numbers}: {figures}   {verdict}"


def _record(evolution: Evolution, folder: Path, file: Path) -> None:
    """Record the champion in its world, which is the first start of the exam, for as long as an exam takes."""
    ready_engine()
    from kiks.learn.evolution_log import CHAMPION

    exam, champion = evolution.task.exam, evolution.champion
    sim, ports = champion.simulation()
    with recorded(sim, record=file, programs=[folder / CHAMPION]):
        champion.drive(ports, seconds=evolution.task.seconds if exam is None else exam.seconds)
    typer.echo(f"Recording: {file}   See it: kiks replay {file}")


def _stop(evolution: Evolution | None, folder: Path) -> NoReturn:
    """Print how far an evolution is that was interrupted, and exit at once: its picture is drawn at its end."""
    if evolution is not None and evolution.generations:
        _tell_champion(evolution, folder)
        typer.echo(f"Stopped after generation {len(evolution.generations)}; the same command continues.")
    else:
        typer.echo("kiks: stopped.", err=True)
    raise typer.Exit(130)


def _tell_champion(evolution: Evolution, folder: Path) -> None:
    """Print what the champions achieved in the finals, or on trial before them, and where they are."""
    if (tournament := evolution.tournament) is not None:
        best = [
            f"{name} of generation {generation} ({means.max():.2f})"
            for name, generation, means in zip(tournament.sides, tournament.best, tournament.means, strict=True)
        ]
        typer.echo(f"Best against all generations: {', '.join(best)}")
    elif not evolution.task.against:
        champion = evolution.champion
        figures = ", ".join(f"{name} {value:.4g}" for name, value in champion.measures.items())
        typer.echo(f"Champion of generation {champion.generation}: fitness {champion.fitness:.4f}   {figures}")
    if (archive := evolution.archive) is not None:
        filled = f"{len(archive.elites)} of {archive.cell_count} cells ({100 * archive.coverage:.1f} %)"
        names = ", ".join(axis.measure for axis in archive.axes)
        typer.echo(f"Archive by {names}: {filled}, QD score {archive.qd_score:.4g}   One of them: kiks champion --at")
    shown = folder if evolution.task.against else folder / "champion.toml"
    typer.echo(f"Folder: {folder}   See it drive: kiks run {shown}")


def _tell_seeds(results: Sequence[Result], folder: Path, plots: PlotEnding) -> None:
    """Save summary and picture of several evolutions, and print them as a table."""
    from kiks.cli.compare import print_results
    from kiks.learn.plots import figure_of_results, save_plot
    from kiks.learn.results import SUMMARY, save_summary

    picture = folder / f"seeds.{plots}"
    save_summary(results, folder)
    save_plot(figure_of_results({str(folder): results}), picture)
    print_results({"all": results})
    typer.echo(f"Picture: {picture}   Summary: {folder / SUMMARY}")


def _controller(kind: str, task: Task) -> Controller:
    """Return a controller of a kind with the senses and the speed limit of a task's own."""
    from kiks.control.controllers import KINDS, from_recipe

    if kind not in KINDS:
        raise ParameterError(
            f"--controller must be one of {', '.join(KINDS)}, but it was {shown(kind)}.{nearest(kind, KINDS)}"
        )
    own = task.controller
    recipe: dict[str, Any] = {"kind": kind, "speed_limit": task.speed_limit}
    if kind != "collector":  # which has its own
        recipe["senses"] = list(own.senses)
    if kind == "ctrnn":
        recipe["period_s"] = task.timings[0].period_s
    return from_recipe(recipe)
