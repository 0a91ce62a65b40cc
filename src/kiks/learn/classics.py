"""What the scripts of `examples/classics` have in common: a command, evolutions of several seeds, and a table."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.errors import KiksError
from kiks.learn.algorithms import Algorithm
from kiks.learn.champion import Champion
from kiks.learn.evolution import Evolution
from kiks.learn.statistics import mean_interval
from kiks.learn.task import Task

Floats = NDArray[np.float64]

SHARE, AMOUNT = (0.0, 1.0), (0.0, math.inf)
"""What shares can be, and amounts and counts."""


class Finding(NamedTuple):
    """A row of the table of a script.

    Attributes:
        what: What it is about, with its unit.
        known: What is known of the paper, and how it is known; empty if nothing is.
        here: What comes out here: a number, or one for each seed, or words.
        digits: Decimals with which the numbers are printed.
        within: The least and the greatest possible value, where the interval ends.
    """

    what: str
    known: str
    here: Any
    digits: int = 2
    within: tuple[float, float] = (-math.inf, math.inf)

    @property
    def text(self) -> str:
        """What comes out here, in words: of several numbers the mean and its 95 % interval.

        Example:
            >>> Finding("speed [mm/s]", "", [40.0, 42.0, 44.0], 1).text
            '42.0 (37.0 to 47.0, 3 seeds)'
        """
        if isinstance(self.here, str):
            return self.here
        numbers = np.atleast_1d(np.asarray(self.here, np.float64))
        found = mean_interval(numbers, within=self.within)
        mean, low, high = (f"{float(each):.{self.digits}f}" for each in found)
        return mean if len(numbers) == 1 else f"{mean} ({low} to {high}, {len(numbers)} seeds)"


def table_of(findings: Sequence[Finding]) -> str:
    """Return findings as a table of text.

    Example:
        >>> print(table_of([Finding("parameters", "22", "22")]))
        what        known of the paper  here
        parameters  22                  22
    """
    rows = [("what", "known of the paper", "here"), *((each.what, each.known, each.text) for each in findings)]
    first, second = (max(len(row[column]) for row in rows) for column in range(2))
    return "\n".join(f"{row[0]:{first}}  {row[1]:{second}}  {row[2]}" for row in rows)


def evolved(
    task: Task,
    seeds: Sequence[int],
    *,
    generations: int | None = None,
    population: int | None = None,
    algorithm: Callable[[int], Algorithm] | str | None = None,
) -> list[Evolution]:
    """Return an evolution of a task for each seed, and tell on the standard error how far they are.

    Args:
        task: The task.
        seeds: The seeds.
        generations: Number of generations; the task's own if left out.
        population: Number of candidates of a side; the task's own if left out.
        algorithm: Name of the algorithm, or a function that makes one of a seed; the task's own if left out.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.floreano_mondada_1994(seconds=1)
        >>> len(evolved(task, [1, 2], generations=2, population=4))
        2
    """
    evolutions = []
    for seed in seeds:
        given = algorithm(seed) if callable(algorithm) else algorithm
        evolution = Evolution(task, given, seed=seed, population=population)
        evolution.run(generations=task.generations if generations is None else generations)
        figures = ", ".join(f"{name} {value:.3g}" for name, value in evolution.figures.items())
        print(f"{task.name}, seed {seed}: {len(evolution.generations)} generations, {figures}", file=sys.stderr)
        evolutions.append(evolution)
    return evolutions


def path_of(champion: Champion, seconds: float, **world: Any) -> Floats:
    """Return the path of a champion that drives on the wire, float64 [point, 3]: x_mm, y_mm, heading_rad.

    Args:
        champion: The champion, whose first robot is followed.
        seconds: Time for which it drives [s].
        world: Arguments of `Champion.simulation`.

    Example:
        >>> import kiks
        >>> champion = kiks.Champion(kiks.controllers.linear(), [0.5, 0.5] + [0.0] * 16)
        >>> path_of(champion, 1.0).shape
        (11, 3)
    """
    sim, ports = champion.simulation(**world)
    sim.record_paths(0.1)
    champion.drive(ports, seconds=seconds)
    path: Floats = sim.paths()[0][:, 1:]
    return path


def command(main: Callable[..., Sequence[Finding]]) -> None:
    """Run the function of a script as a command, whose arguments are options; print its findings as a table.

    A mistake of the user ends in one line.
    """
    import typer

    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)

    @app.command()
    @functools.wraps(main)
    def run(**options: Any) -> None:
        typer.echo(table_of(main(**options)))

    try:
        app()
    except KiksError as error:
        sys.exit(f"kiks: {error}")
