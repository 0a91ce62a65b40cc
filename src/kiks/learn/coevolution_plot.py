"""The pictures of a co-evolution: fitness over the generations, and the master tournament. Needs Matplotlib."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kiks.export.figures import save_figure
from kiks.learn.coevolution import Coevolution, Tournament

COLOURS = ("tab:red", "tab:blue")
"""Colours of the sides."""


def save_fitness_plot(coevolution: Coevolution, path: str | Path) -> None:
    """Draw best, quartiles and median of each generation for both sides."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.4), layout="constrained")
    numbers = np.arange(1, len(coevolution.generations) + 1)
    for side, axes in enumerate(figure.subplots(1, 2)):
        fitness = [each.values[:, side] for each in coevolution.generations]
        low, median, high, best = np.array([np.percentile(each, (25, 50, 75, 100)) for each in fitness]).T
        axes.fill_between(numbers, low, high, color=COLOURS[side], alpha=0.25, linewidth=0, label="middle half")
        axes.plot(numbers, median, color=COLOURS[side], label="median")
        axes.plot(numbers, best, color="tab:green", linewidth=1, label="best of the generation")
        axes.set_xlabel("generation")
        axes.set_ylabel("fitness against the opponents of the time")
        axes.set_title(f"{coevolution.contest.side_names[side]}: {coevolution.name}, seed {coevolution.seed}")
        axes.grid(alpha=0.3)
        axes.legend(loc="best", fontsize="small")
    save_figure(figure, path)


def save_tournament_plot(tournament: Tournament, path: str | Path) -> None:
    """Draw the fitness of the first side in all pairs of champions as grey squares, and both sides' means."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.8), layout="constrained")
    squares, curves = figure.subplots(1, 2)
    (first, second), generations = tournament.sides, tournament.generations
    half = 0.5 * (generations[-1] - generations[0]) / max(len(generations) - 1, 1) or 0.5
    extent = (generations[0] - half, generations[-1] + half) * 2
    image = squares.imshow(
        tournament.scores[0], origin="lower", extent=extent, interpolation="nearest", cmap="gray", aspect="equal"
    )
    squares.set_xlabel(f"generation of the {second}")
    squares.set_ylabel(f"generation of the {first}")
    squares.set_title("champions of all generations against each other")
    figure.colorbar(image, ax=squares, label=f"fitness of the {first}")
    for side, name in enumerate(tournament.sides):
        best, means = tournament.best[side], tournament.means[side]
        curves.plot(generations, means, color=COLOURS[side], label=name)
        curves.plot([best], [means.max()], "o", color=COLOURS[side], label=f"best {name}: generation {best}")
    curves.set_xlabel("generation of the champion")
    curves.set_ylabel("mean fitness against all champions")
    curves.grid(alpha=0.3)
    curves.legend(loc="best", fontsize="small")
    save_figure(figure, path)
