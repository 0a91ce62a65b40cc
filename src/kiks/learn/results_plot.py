"""Pictures of the results of several evolutions. They need Matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kiks.export.figures import save_figure
from kiks.learn.evolution_plot import draw_baselines
from kiks.learn.exam import PASS_SHARE
from kiks.learn.results import Result, curves, passed_count

COLOURS = ("tab:blue", "tab:orange")


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
    for (name, group), colour in zip(groups.items(), COLOURS, strict=False):
        _draw_curves(axes[0], name, group, colour)
    first = results[0]
    if first.baselines is not None:
        draw_baselines(axes[0], first.baselines)
    axes[0].set_xlabel("evaluations")
    axes[0].set_ylabel("fitness of the champion")
    axes[0].set_title(first.task)
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
    for (name, group), colour in zip(groups.items(), COLOURS, strict=False):
        shares = sorted((each.exam.share for each in group if each.exam is not None), reverse=True)
        places = np.arange(len(shares)) + len(labels)
        axes.bar(places, shares, color=colour, label=f"{name}: {passed_count(group)} of {len(group)} solved the exam")
        labels += [""] * (len(shares) + 1)
    axes.axhline(PASS_SHARE, color="tab:gray", linestyle="--", linewidth=1)
    axes.set_ylim(0, 1)
    axes.set_xticks([])
    axes.set_xlabel("champions")
    axes.set_ylabel("share of the exam's starts solved")
    axes.legend(loc="lower left", fontsize="small")
