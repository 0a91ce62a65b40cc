"""The picture of a sweep: what is solved, and the points, over thinking time. It needs Matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kiks.export.figures import save_figure
from kiks.trials.sweep import Row, Sweep

COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:cyan")
"""Colours of the lines, one for each baud rate."""

QUARTILES = (0, 25, 50, 75, 100)


def save_sweep_plot(sweep: Sweep, path: str | Path, title: str) -> None:
    """Draw the share of solved runs with its spread over the robots, and the points, for each baud rate.

    Args:
        sweep: The sweep.
        path: The picture's file, .png, .svg or .pdf.
        title: Its title.
    """
    from matplotlib.figure import Figure

    has_points = any(each.outcome.points != float(each.outcome.is_solved) for each in sweep.tried)
    figure = Figure(figsize=(10.5 if has_points else 5.6, 4.4), layout="constrained")
    shares, *others = figure.subplots(1, 1 + has_points, squeeze=False)[0]
    for baud, colour in zip(sweep.bauds, COLOURS * len(sweep.bauds), strict=False):
        rows, label = sweep.of(baud), "all runs" if baud is None else f"{baud} baud"
        _draw_shares(shares, rows, colour, label)
        for axes in others:
            _draw_points(axes, rows, colour, label)
    shares.axhline(100 * sweep.share, color="tab:gray", linestyle=":", linewidth=1)
    shares.set(ylabel="solved [%]", ylim=(-3, 103))
    for axes in others:
        axes.set(ylabel="points")
    for axes in (shares, *others):
        axes.set(xlabel={"thinking": "thinking time [ms]", "latency": "latency, each way [ms]"}[sweep.what])
        axes.grid(alpha=0.3)
        axes.legend(loc="best", fontsize="small")
    figure.suptitle(title, fontsize="medium")
    save_figure(figure, path)


def _draw_shares(axes: Any, rows: list[Row], colour: str, label: str) -> None:
    """Draw the share of all runs, and a band from the worst to the best robot."""
    times, robots = [row.place_ms for row in rows], sorted({each.case.family for each in rows[0].tried})
    axes.plot(times, [100 * row.share for row in rows], ".-", color=colour, label=label)
    if len(robots) > 1:
        by_robot = np.array([[_share(row, robot) for robot in robots] for row in rows])
        band = f"worst to best of {len(robots)} robots" if colour == COLOURS[0] else None
        axes.fill_between(times, by_robot.min(1), by_robot.max(1), color=colour, alpha=0.15, linewidth=0, label=band)


def _share(row: Row, robot: int) -> float:
    solved = [each.is_solved for each in row.tried if each.case.family == robot]
    return 100 * sum(solved) / len(solved)


def _draw_points(axes: Any, rows: list[Row], colour: str, label: str) -> None:
    """Draw the median of the points, their middle half, and the least and the most."""
    times = [row.place_ms for row in rows]
    least, low, middle, high, most = np.array([np.percentile(row.points, QUARTILES) for row in rows]).T
    is_first = colour == COLOURS[0]
    axes.fill_between(times, least, most, color=colour, alpha=0.08, linewidth=0, label="all runs" if is_first else None)
    half = "middle half" if is_first else None
    axes.fill_between(times, low, high, color=colour, alpha=0.2, linewidth=0, label=half)
    axes.plot(times, middle, ".-", color=colour, label=f"median, {label}")
