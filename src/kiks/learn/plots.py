"""The pictures of an evolution, and of the results of several. They need Matplotlib.

A panel is as wide as a column of a journal, and its texts have 7 to 8 points there. Legends stand outside the axes.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from itertools import cycle
from os.path import commonpath
from pathlib import Path
from textwrap import fill
from types import MappingProxyType
from typing import Any

import numpy as np

from kiks.errors import counted
from kiks.export.figures import COLUMN_MM, COLUMN_STYLE, MM_IN_AN_INCH, save_figure
from kiks.learn.archive import Archive
from kiks.learn.champion import Champion
from kiks.learn.evolution import Evolution
from kiks.learn.exam import PASS_SHARE
from kiks.learn.finals import MasterTournament
from kiks.learn.results import Baselines, Result, curves, of_sides, passed_count, solved_of, title_of
from kiks.learn.statistics import Comparison, survival
from kiks.learn.task import Axis

COLUMN_INCHES, PANEL_INCHES = COLUMN_MM / MM_IN_AN_INCH, 64 / MM_IN_AN_INCH
"""Width of a panel, that of a column, and its height [inches]."""

COLUMNS = 2
"""Panels side by side; more stand below."""

DOTS_PER_INCH = 220
"""Of a picture in pixels."""

PAIRS_MAX, BANDS_MAX = 3, 3
"""Most pairs of groups whose p a caption lists, and most groups whose intervals overlap in a panel."""

CAPTION_POINTS, CAPTION_CHARACTERS = 7.0, 66
"""Size of the caption, and how many of its characters are as wide as a column."""

LEGEND_POINTS = 27.0
"""How far below the axes a legend begins, under the label of the axis."""

CHAMPION_MARK: dict[str, Any] = {"color": "tab:red", "markersize": 9, "markeredgecolor": "white"}
"""How the champion is drawn."""

SIDE_COLOURS = ("tab:red", "tab:blue")
"""Colours of two sides in the tournament."""

COLOURS, DASHES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"), ("-", "--", "-.", ":")
"""Colours of groups of evolutions, which the colour-blind can tell apart (Okabe and Ito 2008), and their lines."""


def in_style(draw: Callable[..., Any]) -> Callable[..., Any]:
    """Let a function draw in the style of all figures of evolutions."""

    @functools.wraps(draw)
    def drawn(*given: Any, **named: Any) -> Any:
        from matplotlib import rc_context

        with rc_context(COLUMN_STYLE):
            return draw(*given, **named)

    return drawn


def panels(count: int) -> tuple[Any, list[Any]]:
    """Return a figure and the axes of its panels."""
    from matplotlib.figure import Figure

    columns = min(count, COLUMNS)
    rows = -(-count // columns)
    figure = Figure(figsize=(columns * COLUMN_INCHES, rows * PANEL_INCHES), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).ravel())
    for spare in axes[count:]:
        spare.remove()
    return figure, axes[:count]


def legend_below(axes: Any) -> None:
    """Put the legend of axes below their label."""
    from matplotlib.transforms import ScaledTranslation

    lower = ScaledTranslation(0.0, -LEGEND_POINTS / 72.0, axes.figure.dpi_scale_trans)
    place: dict[str, Any] = {"bbox_to_anchor": (0.5, 0.0), "bbox_transform": axes.transAxes + lower}
    axes.legend(loc="upper center", borderaxespad=0.0, ncols=2, **place)


def save_plot(figure: Any, path: str | Path) -> None:
    """Write a figure of this module into a file: .png, .svg or .pdf."""
    save_figure(figure, path, DOTS_PER_INCH)


@in_style
def figure_of_evolution(evolution: Evolution, baselines: Baselines | None = None) -> Any:
    """Draw best, quartiles and median of each generation of a side, and the champion; and archive and front, if any.

    Args:
        evolution: The evolution.
        baselines: Its baselines, drawn as lines.

    Returns:
        A `matplotlib.figure.Figure`, as all functions here do.
    """
    sides, archives = evolution.task.sides, evolution.archives
    has_front = len(evolution.task.objectives) > 1 and not evolution.task.against
    figure, drawn = panels(len(sides) + len(archives) + has_front)
    axes = iter(drawn)
    for side in range(len(sides)):
        _draw_fitness(next(axes), evolution, side, baselines)
    for archive, champion in zip(archives, evolution.champions, strict=False):
        _draw_archive(figure, next(axes), archive, champion)
    if has_front:
        _draw_front(next(axes), evolution)
    return figure


@in_style
def figure_of_archive(archive: Archive) -> Any:
    """Draw an archive alone."""
    figure, (axes,) = panels(1)
    _draw_archive(figure, axes, archive, archive.champion)
    return figure


def _draw_fitness(axes: Any, evolution: Evolution, side: int, baselines: Baselines | None) -> None:
    generations = evolution.generations
    numbers = np.arange(1, len(generations) + 1)
    quartiles = np.array([np.percentile(each.fitness_of(side), (25, 50, 75, 100)) for each in generations])
    low, median, high, best = quartiles.reshape(-1, 4).T
    axes.fill_between(numbers, low, high, color="tab:blue", alpha=0.25, linewidth=0, label="middle half")
    axes.plot(numbers, median, color="tab:blue", label="median")
    axes.plot(numbers, best, color="tab:green", linewidth=1, label="best of the generation")
    name = evolution.task.name
    if evolution.task.against:
        name = f"{evolution.task.sides[side].name} against opponents of the time"
    else:
        champions = [each.champion_fitness for each in generations]
        axes.plot(numbers, champions, color="tab:red", drawstyle="steps-post", label="champion, on trial")
    if baselines is not None:
        _draw_baselines(axes, baselines)
    title = f"{name}: {evolution.name}, seed {evolution.seed}"
    if evolution.finals is not None:  # their worlds are others than those of the trials: no point of the curve
        title += f"; {evolution.champion.fitness:.3g} in the finals"
    axes.set(xlabel="generation", ylabel="fitness", title=title)
    axes.grid(alpha=0.3)
    legend_below(axes)


def _draw_baselines(axes: Any, baselines: Baselines) -> None:
    axes.axhline(baselines.random, color="tab:gray", linestyle="--", linewidth=1, label="random, median")
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
    legend_below(axes)
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
    legend_below(axes)


def _cell(axis: Axis) -> float:
    return (axis.high - axis.low) / axis.cells


@in_style
def figure_of_tournament(tournament: MasterTournament) -> Any:
    """Draw the fitness of the first side in all pairs of champions as grey squares, and both sides' means."""
    figure, (squares, lines) = panels(2)
    generations = tournament.generations
    draw_squares(squares, tournament)
    for side, name in enumerate(tournament.sides):
        best, means = tournament.best[side], tournament.means[side]
        lines.plot(generations, means, color=SIDE_COLOURS[side], label=name)
        lines.plot([best], [means.max()], "o", color=SIDE_COLOURS[side], label=f"best: generation {best}")
    title = "each against all champions of the other side"
    lines.set(xlabel="generation of the champion", ylabel="mean fitness", title=title)
    lines.grid()
    legend_below(lines)
    return figure


def draw_squares(axes: Any, tournament: MasterTournament) -> None:
    """Draw the fitness of the first side in all pairs of champions as grey squares.

    Args:
        axes: The axes.
        tournament: The tournament.
    """
    (first, second), generations = tournament.sides, tournament.generations
    half = 0.5 * (generations[-1] - generations[0]) / max(len(generations) - 1, 1) or 0.5
    extent = (generations[0] - half, generations[-1] + half) * 2
    image = axes.imshow(
        tournament.scores[0], origin="lower", extent=extent, interpolation="nearest", cmap="gray", aspect="equal"
    )
    title = "champions of all generations"
    axes.set(xlabel=f"generation of the {second}", ylabel=f"generation of the {first}", title=title)
    axes.figure.colorbar(image, ax=axes, label=f"fitness of the {first}")


# ---- several evolutions ----


@in_style
def figure_of_results(
    groups: Mapping[str, Sequence[Result]],
    tested: Mapping[str, Comparison] = MappingProxyType({}),
    meetings: Mapping[str, Mapping[str, Sequence[float]]] = MappingProxyType({}),
) -> Any:
    """Draw groups of evolutions of a task.

    Panels show median and quartiles of the champions' fitness over evaluations; the share of the exam's starts that
    each champion solved; and the share of evolutions that have solved the task, over evaluations. Of co-evolutions they
    show both sides, in the tournaments of their own evolutions and against strangers.

    Args:
        groups: The groups by their names.
        tested: What tests say about them, by what is compared; for the caption.
        meetings: Of co-evolutions, the mean fitness of each champion against strangers, by the side and the group.
    """
    short = _short_names(list(groups))
    dashes = (dash for dash in cycle(DASHES) for _ in COLOURS)
    looks = {name: {"color": c, "linestyle": d} for name, c, d in zip(groups, cycle(COLOURS), dashes, strict=False)}
    sides = of_sides(groups)
    has_exam = all(solved_of(group) is not None for group in groups.values())
    figure, drawn = panels(len(sides) + len(meetings) + 2 * has_exam)
    axes, lines = iter(drawn), ["Lines of fitness are medians, bands quartiles of evolutions."]
    for side, named in sides.items():
        _draw_curves(next(axes), side, named, looks)
    for side, of_side in meetings.items():
        _draw_shares(place := next(axes), of_side, looks)
        place.set(ylabel=f"fitness of the {side}, mean", xlabel="champions against strangers", xticks=[])
    if has_exam:
        _draw_exams(next(axes), groups, looks)
        _draw_solved(next(axes), groups, looks)
        band = ", bands intervals of 95 % (log-log)" if len(groups) <= BANDS_MAX else ""
        lines.append(
            "Dots are champions, bars medians, with intervals of 95 % by Wilson's method for those that passed. "
            f"Evolutions that have passed: by Kaplan and Meier's method{band}; a + ended without."
        )
    lines += [_caption(name, comparison, short) for name, comparison in tested.items()]
    width = min(len(drawn), COLUMNS)
    caption = "\n".join(fill(line, width * CAPTION_CHARACTERS) for line in lines)
    figure.supxlabel(caption, x=0.01, ha="left", fontsize=CAPTION_POINTS)
    labels = [f"{short[name]} ({counted(len(group), 'run')})" for name, group in groups.items()]
    columns = max(1, min(len(labels), width * CAPTION_CHARACTERS // (max(map(len, labels)) + 6)))
    handles = [drawn[0].plot([], [], **look)[0] for look in looks.values()]
    figure.legend(handles, labels, loc="outside upper left", ncols=columns)
    # What stands above and below the panels.
    added_inches = -(-len(labels) // columns) * 0.16 + (caption.count("\n") + 1) * 0.125
    figure.set_figheight(figure.get_figheight() + added_inches)
    return figure


def _short_names(names: Sequence[str]) -> dict[str, str]:
    """Return names without the folder that they have in common, and not too long for a legend."""
    parts = [Path(name).parts or (name,) for name in names]
    same = len(Path(commonpath(names)).parts) if len({Path(name).is_absolute() for name in names}) == 1 else 0
    texts = [str(Path(*part[same:])) if len(names) > 1 and len(part) > same else part[-1] for part in parts]
    return {
        name: text if len(text) <= CAPTION_CHARACTERS - 16 else f"...{text[16 - CAPTION_CHARACTERS :]}"
        for name, text in zip(names, texts, strict=True)
    }


def _caption(name: str, comparison: Comparison, short: Mapping[str, str]) -> str:
    """Return a sentence for a figure's caption: what tests say about groups, and by which method."""
    said = []
    if (omnibus := comparison.omnibus) is not None:
        said.append(f"all {omnibus.method}: {_p(omnibus.p)}")
    for method in dict.fromkeys(pair.test.method for pair in comparison.pairs):
        pairs = [pair for pair in comparison.pairs if pair.test.method == method]
        of_pairs = [
            f"{short[pair.first]} - {short[pair.second]} {_p(pair.p)}"
            + ("" if pair.a is None else f", A = {pair.a:.2f}")
            for pair in pairs
        ]
        if len(comparison.pairs) > PAIRS_MAX:
            ps = [pair.p for pair in pairs]
            of_pairs = [f"{counted(len(pairs), 'pair')}, {_p(min(ps))} to {_p(max(ps))}"]
        corrected = f", corrected by {comparison.correction}'s method" if comparison.correction else ""
        said.append(f"{method}{corrected}: {'; '.join(of_pairs)}")
    return f"{title_of(name)}: {'. '.join(said)}."


def _p(p: float) -> str:
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}"


def _draw_curves(axes: Any, side: str, groups: Mapping[str, Sequence[Result]], looks: Mapping[str, Any]) -> None:
    for name, group in groups.items():
        evaluations, fitness = curves(group)
        low, median, high = np.percentile(fitness, (25, 50, 75), axis=0)
        band: dict[str, Any] = {"color": looks[name]["color"], "alpha": 0.2, "linewidth": 0, "step": "post"}
        axes.fill_between(evaluations, low, high, **band)
        axes.plot(evaluations, median, drawstyle="steps-post", **looks[name])
    first = next(iter(groups.values()))[0]
    title = f"{first.task}: {side} in its own tournament" if side else f"{first.task}: champion on trial"
    axes.set(xlabel="evaluations", ylabel="fitness", title=title)
    axes.grid(alpha=0.3)
    if first.baselines is not None:
        _draw_baselines(axes, first.baselines)
        legend_below(axes)


def _draw_shares(axes: Any, samples: Mapping[str, Sequence[float]], looks: Mapping[str, Any]) -> None:
    """Draw samples as points side by side: equal values stand next to each other; a bar is the median."""
    width = 0.7 / max(max(map(len, samples.values())), 8)
    for place, (name, sample) in enumerate(samples.items()):
        values, counts = np.unique(np.round(sample, 3), return_counts=True)
        for value, count in zip(values, counts, strict=True):
            across = place + width * (np.arange(count) - (count - 1) / 2)
            axes.plot(across, [value] * count, "o", color=looks[name]["color"], markersize=2.5)
        axes.plot([place - 0.38, place + 0.38], [np.median(sample)] * 2, color=looks[name]["color"], linewidth=0.8)
    axes.set(xlim=(-0.6, len(samples) - 0.4))
    axes.grid(axis="y", alpha=0.3)


def _draw_exams(axes: Any, groups: Mapping[str, Sequence[Result]], looks: Mapping[str, Any]) -> None:
    from kiks.learn.statistics import wilson_interval

    shares = {name: [each.exam.share for each in group if each.exam is not None] for name, group in groups.items()}
    _draw_shares(axes, shares, looks)
    axes.axhline(PASS_SHARE, color="tab:gray", linestyle="--", linewidth=0.8)
    passed = [passed_count(group) or 0 for group in groups.values()]
    ends = [wilson_interval(count, len(group)) for count, group in zip(passed, groups.values(), strict=True)]
    labels = [
        f"{count}/{len(group)}\n{100 * low:.0f}-{100 * high:.0f} %"
        for count, group, (low, high) in zip(passed, groups.values(), ends, strict=True)
    ]
    axes.set(ylim=(-0.03, 1.03), ylabel="share of the exam's starts", xlabel="champions that passed", title="exam")
    axes.set_xticks(range(len(labels)), labels)


def _draw_solved(axes: Any, groups: Mapping[str, Sequence[Result]], looks: Mapping[str, Any]) -> None:
    """Draw the share of evolutions that have passed the exam over evaluations, by Kaplan and Meier."""
    end = max(each.evaluation_count for group in groups.values() for each in group)
    for name, group in groups.items():
        solved = solved_of(group)
        assert solved is not None
        curve, colour = survival(solved), looks[name]["color"]
        if len(groups) <= BANDS_MAX:
            band: dict[str, Any] = {"color": colour, "alpha": 0.15, "linewidth": 0, "step": "post"}
            axes.fill_between(curve.evaluations, curve.low, curve.high, **band)
        steps, shares = curve.evaluations, curve.share
        if all(solved.is_solved):
            steps, shares = np.append(steps, end), np.append(shares, 1.0)
        axes.plot(steps, shares, drawstyle="steps-post", **looks[name])
        ends = sorted(count for count, is_solved in zip(*solved, strict=True) if not is_solved)
        heights = curve.share[np.searchsorted(curve.evaluations, ends, side="right") - 1]
        axes.plot(ends, heights, "+", color=colour, markersize=5)
    axes.set(ylim=(-0.03, 1.03), xlabel="evaluations", ylabel="share of evolutions", title="exam passed so far")
    axes.grid(alpha=0.3)
