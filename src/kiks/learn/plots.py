"""The pictures of an evolution, and of the results of several. They need Matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kiks.export.figures import save_figure
from kiks.learn.archive import Archive
from kiks.learn.champion import Champion
from kiks.learn.evolution import Evolution
from kiks.learn.exam import PASS_SHARE
from kiks.learn.finals import Tournament
from kiks.learn.results import Baselines, Result, curves, passed_count
from kiks.learn.statistics import mean_interval
from kiks.learn.task import Axis

CHAMPION_MARK: dict[str, Any] = {"color": "tab:red", "markersize": 12, "markeredgecolor": "white"}
"""How the champion is drawn."""

SIDE_COLOURS, GROUP_COLOURS = ("tab:red", "tab:blue"), ("tab:blue", "tab:orange")
"""Colours of two sides in the tournament, and of two groups of evolutions."""


def save_plot(evolution: Evolution, path: str | Path, baselines: Baselines | None = None) -> None:
    """Draw best, quartiles and median of each generation of a side, and the champion; and archive and front, if any.

    Args:
        evolution: The evolution.
        path: File of the picture.
        baselines: Its baselines, drawn as lines.
    """
    save_figure(figure_of_evolution(evolution, baselines), path)


def figure_of_evolution(evolution: Evolution, baselines: Baselines | None = None) -> Any:
    """Return the figure of `save_plot`, a `matplotlib.figure.Figure`."""
    from matplotlib.figure import Figure

    sides, archives = evolution.task.sides, evolution.archives
    has_front = len(evolution.task.objectives) > 1 and not evolution.task.against
    count = len(sides) + len(archives) + has_front
    figure = Figure(figsize=(6.4 if count == 1 else 6.0 * count, 4.4), layout="constrained")
    axes = iter(figure.subplots(1, count, squeeze=False)[0])
    for side in range(len(sides)):
        _draw_fitness(next(axes), evolution, side, baselines)
    for archive, champion in zip(archives, evolution.champions, strict=False):
        _draw_archive(figure, next(axes), archive, champion)
    if has_front:
        _draw_front(next(axes), evolution)
    return figure


def figure_of_archive(archive: Archive) -> Any:
    """Return a figure of an archive, a `matplotlib.figure.Figure`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    _draw_archive(figure, figure.subplots(), archive, archive.champion)
    return figure


def _draw_fitness(axes: Any, evolution: Evolution, side: int, baselines: Baselines | None) -> None:
    generations = evolution.generations
    numbers = np.arange(1, len(generations) + 1)
    quartiles = np.array([np.percentile(each.fitness_of(side), (25, 50, 75, 100)) for each in generations])
    low, median, high, best = quartiles.reshape(-1, 4).T
    axes.fill_between(numbers, low, high, color="tab:blue", alpha=0.25, linewidth=0, label="middle half")
    axes.plot(numbers, median, color="tab:blue", label="median")
    axes.plot(numbers, best, color="tab:green", linewidth=1, label="best of the generation")
    name, against = evolution.task.name, ""
    if evolution.task.against:
        name, against = evolution.task.sides[side].name, " against the opponents of the time"
    else:
        champions = [each.champion_fitness for each in generations]
        axes.plot(numbers, champions, color="tab:red", drawstyle="steps-post", label="champion, on trial")
    if evolution.finals is not None:
        axes.plot(len(generations), evolution.champion.fitness, "*", **CHAMPION_MARK, label="champion, in the finals")
    if baselines is not None:
        _draw_baselines(axes, baselines)
    title = f"{name}: {evolution.name}, seed {evolution.seed}"
    axes.set(xlabel="generation", ylabel=f"fitness{against}", title=title)
    axes.grid(alpha=0.3)
    axes.legend(loc="best", fontsize="small")


def _draw_baselines(axes: Any, baselines: Baselines) -> None:
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
    axes.plot(*place, "*", **CHAMPION_MARK, label="champion")
    title = f"{len(archive.elites)} of {archive.cell_count} cells, QD score {archive.qd_score:.4g}"
    axes.set(xlabel=across.measure, ylabel=up.measure, title=title)
    axes.legend(loc="best", fontsize="small")
    figure.colorbar(image, ax=axes, label="fitness")


def _draw_front(axes: Any, evolution: Evolution) -> None:
    """Draw the last generation along the first two objectives, its Pareto front and the champion."""
    names = [name.removeprefix("-") for name in evolution.task.objectives[:2]]
    values, known = evolution.generations[-1].values, evolution.task.value_names
    if values.shape[1] == len(known):
        of_all = values[: evolution.population, [known.index(name) for name in names]]
        axes.plot(*of_all.T, ".", color="tab:gray", label="last generation")
        front = [[{"fitness": each.fitness, **each.measures}[name] for name in names] for each in evolution.front]
        is_line = "o-" if len(evolution.task.objectives) == 2 else "o"
        axes.plot(*zip(*front, strict=True), is_line, color="tab:blue", label="its front")
    champion = {"fitness": evolution.champion.fitness, **evolution.champion.measures}
    axes.plot(*(champion.get(name, np.nan) for name in names), "*", **CHAMPION_MARK, label="champion")
    less = [" (less is better)" if name.startswith("-") else "" for name in evolution.task.objectives[:2]]
    axes.set(xlabel=names[0] + less[0], ylabel=names[1] + less[1], title="objectives")
    axes.grid(alpha=0.3)
    axes.legend(loc="best", fontsize="small")


def _cell(axis: Axis) -> float:
    return (axis.high - axis.low) / axis.cells


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
    title = "champions of all generations against each other"
    squares.set(xlabel=f"generation of the {second}", ylabel=f"generation of the {first}", title=title)
    figure.colorbar(image, ax=squares, label=f"fitness of the {first}")
    for side, name in enumerate(tournament.sides):
        best, means = tournament.best[side], tournament.means[side]
        curves.plot(generations, means, color=SIDE_COLOURS[side], label=name)
        curves.plot([best], [means.max()], "o", color=SIDE_COLOURS[side], label=f"best {name}: generation {best}")
    curves.set(xlabel="generation of the champion", ylabel="mean fitness against all champions")
    curves.grid(alpha=0.3)
    curves.legend(loc="best", fontsize="small")
    save_figure(figure, path)


# ---- several evolutions ----


def draw_generations(
    axes: Any, evolutions: Sequence[Evolution], side: int = 0, *, colour: str = "C0", name: str = ""
) -> None:
    """Draw the best and the mean fitness of each generation: means over evolutions, and their 95 % intervals.

    Args:
        axes: The axes.
        evolutions: Evolutions with as many generations each, such as those of several seeds.
        side: Number of the side.
        colour: Colour of the lines: the best solid, the mean dashed.
        name: What the labels begin with.
    """
    fitness = [[each.fitness_of(side) for each in evolution.generations] for evolution in evolutions]
    numbers = np.arange(1, len(fitness[0]) + 1)
    for label, style, pick in (("best", "-", np.max), ("mean", "--", np.mean)):
        mean, low, high = mean_interval([[pick(each) for each in generations] for generations in fitness])
        axes.fill_between(numbers, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(numbers, mean, style, color=colour, label=f"{name} {label}".strip())
    axes.set(xlabel="generation", ylabel="fitness", xlim=(1, max(2, numbers[-1])))


def save_results_plot(groups: Mapping[str, Sequence[Result]], path: str | Path) -> None:
    """Draw one or two groups of evolutions of a task.

    On the left stand median and quartiles of the champions' fitness over evaluations, on the right the share of the
    exam's starts that each champion solved.

    Args:
        groups: The groups by their names.
        path: File of the picture.
    """
    from matplotlib.figure import Figure

    results = [each for group in groups.values() for each in group]
    has_exam = all(each.exam is not None for each in results)
    figure = Figure(figsize=(12.0 if has_exam else 6.4, 4.4), layout="constrained")
    axes = figure.subplots(1, 1 + has_exam, squeeze=False)[0]
    for (name, group), colour in zip(groups.items(), GROUP_COLOURS, strict=False):
        _draw_curves(axes[0], name, group, colour)
    first = results[0]
    if first.baselines is not None:
        _draw_baselines(axes[0], first.baselines)
    axes[0].set(xlabel="evaluations", ylabel="fitness of the champion", title=first.task)
    axes[0].grid(alpha=0.3)
    axes[0].legend(loc="best", fontsize="small")
    if has_exam:
        _draw_exams(axes[1], groups)
    save_figure(figure, path)


def _draw_curves(axes: Any, name: str, results: Sequence[Result], colour: str) -> None:
    evaluations, fitness = curves(results)
    low, median, high = np.percentile(fitness, (25, 50, 75), axis=0)
    axes.fill_between(evaluations, low, high, step="post", color=colour, alpha=0.25, linewidth=0)
    seconds = float(np.median([each.seconds for each in results]))
    label = f"{name}: median and quartiles of {len(results)}, {evaluations[-1]:.0f} evaluations, {seconds:.0f} s"
    axes.plot(evaluations, median, color=colour, drawstyle="steps-post", label=label)


def _draw_exams(axes: Any, groups: Mapping[str, Sequence[Result]]) -> None:
    labels: list[str] = []
    for (name, group), colour in zip(groups.items(), GROUP_COLOURS, strict=False):
        shares = sorted((each.exam.share for each in group if each.exam is not None), reverse=True)
        places = np.arange(len(shares)) + len(labels)
        axes.bar(places, shares, color=colour, label=f"{name}: {passed_count(group)} of {len(group)} solved the exam")
        labels += [""] * (len(shares) + 1)
    axes.axhline(PASS_SHARE, color="tab:gray", linestyle="--", linewidth=1)
    axes.set(ylim=(0, 1), xticks=[], xlabel="champions", ylabel="share of the exam's starts solved")
    axes.legend(loc="lower left", fontsize="small")
