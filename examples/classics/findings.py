"""What the scripts of this folder have in common: a command, evolutions of several seeds, and a table."""

import functools
import math
import sys
from typing import Any, NamedTuple

import numpy as np

import kiks
from kiks.learn.statistics import mean_interval

SHARE, AMOUNT = (0.0, 1.0), (0.0, math.inf)  # what shares can be, and amounts and counts


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
    def text(self):
        """What comes out here, in words: of several numbers the mean and its 95 % interval."""
        if isinstance(self.here, str):
            return self.here
        numbers = np.atleast_1d(np.asarray(self.here, np.float64))
        found = mean_interval(numbers, within=self.within)
        mean, low, high = (f"{float(each):.{self.digits}f}" for each in found)
        return mean if len(numbers) == 1 else f"{mean} ({low} to {high}, {len(numbers)} seeds)"


def table_of(findings):
    """Return findings as a table of text."""
    rows = [("what", "known of the paper", "here"), *((each.what, each.known, each.text) for each in findings)]
    first, second = (max(len(row[column]) for row in rows) for column in range(2))
    return "\n".join(f"{row[0]:{first}}  {row[1]:{second}}  {row[2]}" for row in rows)


def evolved(task, seeds, *, generations=None, population=None, algorithm=None):
    """Return an evolution of a task for each seed, and tell on the standard error how far they are.

    `algorithm` is the name of one, or a function that makes one of a seed; what is left out is the task's own.
    """
    evolutions = []
    for seed in seeds:
        given = algorithm(seed) if callable(algorithm) else algorithm
        evolution = kiks.Evolution(task, given, seed=seed, population=population)
        evolution.run(generations=task.generations if generations is None else generations)
        figures = ", ".join(f"{name} {value:.3g}" for name, value in evolution.figures.items())
        print(f"{task.name}, seed {seed}: {len(evolution.generations)} generations, {figures}", file=sys.stderr)
        evolutions.append(evolution)
    return evolutions


def draw_generations(axes, evolutions, side=0, *, colour="C0", name=""):
    """Draw the best (solid) and the mean (dashed) fitness of each generation of a side.

    They are means over evolutions, of as many generations each, with their 95 % intervals; labels begin with `name`.
    """
    fitness = [[each.fitness_of(side) for each in evolution.generations] for evolution in evolutions]
    numbers = np.arange(1, len(fitness[0]) + 1)
    for label, style, pick in (("best", "-", np.max), ("mean", "--", np.mean)):
        mean, low, high = mean_interval([[pick(each) for each in generations] for generations in fitness])
        axes.fill_between(numbers, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(numbers, mean, style, color=colour, label=f"{name} {label}".strip())
    axes.set(xlabel="generation", ylabel="fitness", xlim=(1, max(2, numbers[-1])))


def path_of(champion, seconds, **world):
    """Return the path of a champion that drives on the wire, float64 [point, 3]: x_mm, y_mm, heading_rad.

    `world` are arguments of `Champion.simulation`; of several robots, the first is followed.
    """
    sim, ports = champion.simulation(**world)
    sim.record_paths(0.1)
    champion.drive(ports, seconds=seconds)
    return sim.paths()[0][:, 1:]


def command(main):
    """Run the function of a script as a command, whose arguments are options; print its findings as a table.

    A mistake of the user ends in one line.
    """
    import typer

    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)

    @app.command()
    @functools.wraps(main)
    def run(**options):
        typer.echo(table_of(main(**options)))

    try:
        app()
    except kiks.KiksError as error:
        sys.exit(f"kiks: {error}")
