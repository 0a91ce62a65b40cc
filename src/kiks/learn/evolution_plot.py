"""The picture of an evolution: its fitness over the generations, and its archive. Needs Matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kiks.export.figures import save_figure
from kiks.learn.archive import Archive
from kiks.learn.baselines import Baselines
from kiks.learn.champion import Champion
from kiks.learn.evolution import Evolution
from kiks.learn.task import Axis

CHAMPION_MARK: dict[str, Any] = {
    "marker": "*",
    "color": "tab:red",
    "markersize": 12,
    "markeredgecolor": "white",
    "linestyle": "",
}
"""How the champion is drawn."""


def save_plot(evolution: Evolution, path: str | Path, baselines: Baselines | None = None) -> None:
    """Draw best, quartiles and median of each generation, and the champion; and the archive, if the task has axes.

    Args:
        evolution: The evolution.
        path: File of the picture.
        baselines: Its baselines, drawn as lines.
    """
    from matplotlib.figure import Figure

    archive = evolution.archive
    figure = Figure(figsize=(6.4 if archive is None else 12.0, 4.4), layout="constrained")
    axes = figure.subplots(1, 1 if archive is None else 2, squeeze=False)[0]
    _draw_fitness(axes[0], evolution, baselines)
    if archive is not None:
        _draw_archive(figure, axes[1], archive, evolution.champion)
    save_figure(figure, path)


def _draw_fitness(axes: Any, evolution: Evolution, baselines: Baselines | None) -> None:
    generations = evolution.generations
    numbers = np.arange(1, len(generations) + 1)
    quartiles = np.array([np.percentile(each.fitness, (25, 50, 75, 100)) for each in generations]).reshape(-1, 4)
    low, median, high, best = quartiles.T
    axes.fill_between(numbers, low, high, color="tab:blue", alpha=0.25, linewidth=0, label="middle half")
    axes.plot(numbers, median, color="tab:blue", label="median")
    axes.plot(numbers, best, color="tab:green", linewidth=1, label="best of the generation")
    champions = [each.champion_fitness for each in generations]
    axes.plot(numbers, champions, color="tab:red", drawstyle="steps-post", label="champion, on trial")
    if evolution.finals is not None:
        axes.plot(len(generations), evolution.champion.fitness, **CHAMPION_MARK, label="champion, in the finals")
    if baselines is not None:
        draw_baselines(axes, baselines)
    axes.set_xlabel("generation")
    axes.set_ylabel("fitness")
    axes.set_title(f"{evolution.task.name}: {evolution.name}, seed {evolution.seed}")
    axes.grid(alpha=0.3)
    axes.legend(loc="best", fontsize="small")


def draw_baselines(axes: Any, baselines: Baselines) -> None:
    """Draw baselines as horizontal lines."""
    axes.axhline(baselines.random, color="tab:gray", linestyle="--", linewidth=1, label="random controllers, median")
    axes.axhline(baselines.standing, color="tab:gray", linestyle=":", linewidth=1, label="standing still")


def _draw_archive(figure: Any, axes: Any, archive: Archive, champion: Champion) -> None:
    """Draw the fitness in each cell; the fittest cell and the champion are marked."""
    from matplotlib.patches import Rectangle

    heat, (across, *others) = archive.heat_map(), archive.axes
    while heat.ndim > 2:  # with more than two axes, show the best along the others
        heat = np.fmax.reduce(heat, axis=-1)
    up = others[0] if others else Axis("", 0.0, 1.0, 1)
    extent = (across.low, across.high, up.low, up.high)
    picture = np.atleast_2d(heat.T)
    image = axes.imshow(picture, origin="lower", extent=extent, aspect="auto", interpolation="nearest", cmap="viridis")
    for elite in archive.best_first()[:1]:
        column, row = (*elite.cell, 0)[:2]
        corner = across.low + column * _cell(across), up.low + row * _cell(up)
        square = Rectangle(corner, _cell(across), _cell(up), fill=False, color="tab:red", label="fittest cell")
        axes.add_patch(square)
    place = [champion.measures.get(axis.measure, axis.low) for axis in archive.axes[:2]]
    if not others:
        place.append(0.5)
    axes.plot(*place, **CHAMPION_MARK, label="champion")
    axes.set_xlabel(across.measure)
    axes.set_ylabel(up.measure)
    axes.set_title(f"{len(archive.elites)} of {archive.cell_count} cells, QD score {archive.qd_score:.4g}")
    axes.legend(loc="best", fontsize="small")
    figure.colorbar(image, ax=axes, label="fitness")


def _cell(axis: Axis) -> float:
    """Return how wide a cell of an axis is."""
    return (axis.high - axis.low) / axis.cells
