"""The picture of an evolution: its fitness over the generations, and its map of behaviours. Needs Matplotlib."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from kiks.learn.algorithms import MapElites, library
from kiks.learn.baselines import Baselines
from kiks.learn.evolution import Evolution
from kiks.model.atomic_files import replace_file


def save_plot(evolution: Evolution, path: str | Path, baselines: Baselines | None = None) -> None:
    """Draw best, quartiles and median of each generation, and the champion; for 'map-elites' its map, too.

    Args:
        evolution: The evolution.
        path: File of the picture.
        baselines: Its baselines, drawn as lines.

    Raises:
        ParameterError: If Matplotlib is not installed, or the file cannot be written.
    """
    figures = library("matplotlib.figure")
    algorithm = evolution.algorithm
    has_map = isinstance(algorithm, MapElites)
    figure = figures.Figure(figsize=(12.0 if has_map else 6.4, 4.4), layout="constrained")
    axes = figure.subplots(1, 1 + has_map, squeeze=False)[0]
    _draw_fitness(axes[0], evolution, baselines)
    if isinstance(algorithm, MapElites):
        _draw_map(figure, axes[1], evolution, algorithm)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    replace_file(path, buffer.getvalue(), "the picture")


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


def _draw_map(figure: Any, axes: Any, evolution: Evolution, algorithm: MapElites) -> None:
    heat, (across, *others) = algorithm.heat_map(), evolution.task.axes
    filled = int(np.isfinite(heat).sum())
    while heat.ndim > 2:  # with more than two axes, show the best along the others
        heat = np.fmax.reduce(heat, axis=-1)
    up = others[0] if others else None
    extent = (across.low, across.high, *((up.low, up.high) if up else (0.0, 1.0)))
    picture = np.atleast_2d(heat.T)
    image = axes.imshow(picture, origin="lower", extent=extent, aspect="auto", interpolation="nearest", cmap="viridis")
    axes.set_xlabel(across.measure)
    axes.set_ylabel(up.measure if up else "")
    axes.set_title(f"{filled} of {algorithm.archive.cells} cells")
    figure.colorbar(image, ax=axes, label="fitness")
