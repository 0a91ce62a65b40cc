"""`kiks evolve` of a contest: both sides evolve against each other."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from kiks.ending import end_as_with_ctrl_c

if TYPE_CHECKING:
    from kiks.learn.coevolution import Coevolution, Tournament
    from kiks.learn.contest import Contest

PERIODS = 5
"""Number of periods of an evolution whose winners are listed."""

TOURNAMENT_MAX = 100
"""Most champions of a side in the tournament; of a longer evolution, champions at equal intervals."""


def coevolve(
    contest: Contest,
    algorithm: str,
    folder: Path,
    *,
    seed: int,
    population: int | None,
    generations: int | None,
    seconds: float | None,
    executor: Executor | None,
) -> None:
    """Evolve both sides of a contest, hold the tournament, and write champions, log and pictures.

    Args:
        contest: The contest.
        algorithm: The algorithm of both sides.
        folder: The folder for the results.
        seed: Seed of the evolution.
        population: Number of candidates of each side; that of the contest if None.
        generations: Number of generations; that of the contest if None and `seconds` is None.
        seconds: Begin no generation later than this [s].
        executor: Evaluates candidates; this computer if None.
    """
    from kiks.cli.evolution_progress import progress_of
    from kiks.learn.coevolution import Coevolution

    coevolution = Coevolution(contest, algorithm, seed=seed, population=population, folder=folder)
    if coevolution.generations:
        typer.echo(f"Continuing after generation {len(coevolution.generations)} in {folder}.")
    until = contest.generations if generations is None and seconds is None else generations
    end_as_with_ctrl_c()
    try:
        with executor or nullcontext(), progress_of(coevolution, until, seconds) as progress:
            coevolution.run(generations=until, seconds=seconds, executor=executor, each=progress.each)
        if coevolution.generations:
            _finish(coevolution, folder)
    except KeyboardInterrupt:
        typer.echo(f"Stopped after generation {len(coevolution.generations)}; the same command continues.")
        raise typer.Exit(130) from None


def _finish(coevolution: Coevolution, folder: Path) -> None:
    """Hold the tournament, save its best champions and the pictures, and print who won when."""
    from kiks.learn.coevolution_plot import save_fitness_plot, save_tournament_plot

    save_fitness_plot(coevolution, folder / "fitness.png")
    every = -(-len(coevolution.generations) // TOURNAMENT_MAX)
    tournament = coevolution.master_tournament(every=every)
    tournament.save(folder / "tournament.parquet")
    save_tournament_plot(tournament, folder / "tournament.png")
    for side, name in enumerate(tournament.sides):
        coevolution.champion(side, tournament.best[side]).save(folder / f"{name}.toml")
    for line in winners_of(tournament):
        typer.echo(line)
    best = [
        f"{name} of generation {generation} ({means.max():.2f})"
        for name, generation, means in zip(tournament.sides, tournament.best, tournament.means, strict=True)
    ]
    typer.echo(f"Best against all generations: {', '.join(best)}")
    typer.echo(f"Folder: {folder}   See the two: kiks demo {folder}")


def winners_of(tournament: Tournament) -> Iterator[str]:
    """Yield a line for each period of an evolution: the fitness of its champions against each other, and the winner.

    The winner is the side with the higher fitness.
    """
    periods = np.array_split(np.arange(len(tournament.generations)), min(PERIODS, len(tournament.generations)))
    for period in periods:
        first, last = tournament.generations[period[[0, -1]]].tolist()
        of_sides = tournament.scores[:, period[0] : period[-1] + 1, period[0] : period[-1] + 1].mean(axis=(1, 2))
        figures = "   ".join(f"{name} {mean:.2f}" for name, mean in zip(tournament.sides, of_sides, strict=True))
        is_tie = of_sides[0] == of_sides[1]
        verdict = "a tie" if is_tie else f"the {tournament.sides[int(of_sides.argmax())]} won"
        numbers = f"Generation {first}" if first == last else f"Generations {first} to {last}"
        yield f"{numbers}: {figures}   {verdict}"
