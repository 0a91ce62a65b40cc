"""Figures of recordings: paths, readings, speeds, places and time. They need Matplotlib.

A recording has a column, so that several stand side by side.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kiks.errors import ParameterError
from kiks.export.kinds import KINDS
from kiks.export.looks import css, robot_colour
from kiks.model.arena import Arena
from kiks.model.atomic_files import ending_of, replace_file
from kiks.recording.analysis import odometry, time_shares
from kiks.recording.recorder import RunRecorder, RunWriter
from kiks.recording.recording import Recording
from kiks.recording.tables import Table
from kiks.sim.simulation import Simulation
from kiks.units import s_from_ns

NO_ROBOT = "There was no robot in this run"

COLUMN_INCHES, DOTS_PER_INCH = 5.6, 160

HEAT_MM = 20.0
"""Side of a cell of the heat map [mm]."""

POINTS_MAX = 4000
"""Most points of a line over time."""

ROWS = (1.25, 1.0, 0.8, 0.8, 0.28)
"""Relative heights of the rows."""

PANELS = {"paths": 0.0, "places": 0.0, "readings": 2.6, "speeds": 2.6, "time": 1.3}
"""The rows, and how high each is where it stands alone [inches]; 0 for as high as the arena makes it."""


def save_figures(recordings: Sequence[Recording], path: str | Path, *, robot: int = 1) -> None:
    """Draw recordings side by side: paths, where robots were, readings, speeds, and where the time went.

    Args:
        recordings: The recordings.
        path: The picture's file, .png, .svg or .pdf.
        robot: Number of the robot whose readings, speeds and time are drawn; a run without a robot has paths alone.
    """
    kind = ending_of(path, "figures", KINDS["figures"].endings)[1:]
    replace_file(path, file_of(figure_of(recordings, robot=robot), kind), "figures")


def save_figure(figure: Any, path: str | Path) -> None:
    """Write a figure, whose texts become plain, as a PNG."""
    replace_file(path, file_of(_with_plain_texts(figure), "png", 110), "the picture")


def _with_plain_texts(figure: Any) -> Any:
    """Return a figure in which no text is a formula: names come from files of others, and may have a $."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set(parse_math=False, usetex=False)
    return figure


def panels_of(recording: Recording, *, robot: int = 1) -> dict[str, bytes]:
    """Return what `save_figures` draws of one recording as single pictures, by the names of `PANELS`, in SVG."""
    from matplotlib.figure import Figure

    pictures = {}
    arena = recording.start.arena
    arena_inches = min(max(0.75 * COLUMN_INCHES * arena.height_mm / arena.width_mm + 0.6, 2.0), COLUMN_INCHES)
    for name, draw in _drawings(recording, robot).items():
        size = (2 * COLUMN_INCHES, PANELS[name]) if PANELS[name] else (COLUMN_INCHES, arena_inches)
        figure = Figure(figsize=size, layout="constrained")
        draw(figure.subplots())
        for axes in figure.axes:
            legend = axes.get_legend()
            if legend is not None:
                legend.set_in_layout(True)  # no other axes need the same width
        pictures[name] = file_of(_with_plain_texts(figure), "svg")
    return pictures


def file_of(figure: Any, kind: str, dots_per_inch: int = DOTS_PER_INCH) -> bytes:
    """Return the file of a figure. Without dates and random names, the same recording gives the same file."""
    from matplotlib import rc_context

    dated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    buffer = io.BytesIO()
    with rc_context({"svg.hashsalt": "kiks"}):
        figure.savefig(buffer, format=kind, dpi=dots_per_inch, metadata=dated)
    return buffer.getvalue()


def figure_of(recordings: Sequence[Recording], *, robot: int = 1) -> Any:
    """Return the figure of `save_figures`, a `matplotlib.figure.Figure`."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    drawings = [_drawings(recording, robot) for recording in recordings]
    # Padding makes room for the legends between the rows.
    layout = ConstrainedLayoutEngine(h_pad=0.12)
    figure = Figure(figsize=(COLUMN_INCHES * len(recordings), 2.6 * sum(ROWS)), layout=layout)
    axes = figure.subplots(len(ROWS), len(recordings), squeeze=False, height_ratios=ROWS)
    for column, recording, draw in zip(axes.T, recordings, drawings, strict=True):
        column[0].set_title(recording.title, fontsize="medium")
        for axes_of_row, name in zip(column, PANELS, strict=True):
            draw.get(name, _draw_nothing)(axes_of_row)
    return _with_plain_texts(figure)


def figure_of_run(sim: Simulation, *, robot: int = 1) -> Any:
    """Return the figure of a run that is being recorded; see `figure_of`."""
    writer = sim.loop.recorder
    stores = writer.stores if isinstance(writer, RunWriter) else ()
    recorders = [store for store in stores if isinstance(store, RunRecorder)]
    if not recorders:
        raise ParameterError(
            f"{sim} must be recorded while it is plotted, but it is not. Begin with: with sim.record('run.mcap'):"
        )
    recorders[-1].flush()
    return figure_of([Recording(recorders[-1].path)], robot=robot)


def _drawings(recording: Recording, robot: int) -> dict[str, Callable[[Any], None]]:
    """Return functions that draw the rows on axes, by the names of `PANELS`: of a run without a robot, paths alone."""
    poses, wheels, readings = recording.tables("poses", "wheels", "readings")
    paths = {"paths": lambda axes: _draw_paths(axes, recording, poses, wheels)}
    if not recording.robots:
        return paths
    recording.check_robot(robot)
    return paths | {
        "places": lambda axes: _draw_heat(axes, recording.start.arena, poses),
        "readings": lambda axes: _draw_readings(axes, readings[readings["robot"] == robot]),
        "speeds": lambda axes: _draw_speeds(axes, wheels[wheels["robot"] == robot]),
        "time": lambda axes: _draw_time(axes, recording, robot),
    }


def _draw_nothing(axes: Any) -> None:
    axes.set_axis_off()
    _write_in(axes, NO_ROBOT)


def _write_in(axes: Any, text: str) -> None:
    """Write in the middle of axes why they are empty."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color="gray")


def _draw_arena(axes: Any, arena: Arena) -> None:
    extent = (0.0, arena.width_mm, 0.0, arena.height_mm)
    axes.imshow(np.where(arena.brightness > 0, 0.35, 1.0), cmap="gray", vmin=0, vmax=1, origin="lower", extent=extent)
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")


def _draw_paths(axes: Any, recording: Recording, poses: Table, wheels: Table) -> None:
    """Draw where robots drove, where their wheels say that they drove, and where they began to touch something."""
    saved = recording.start
    _draw_arena(axes, saved.arena)
    for number in recording.robots:
        path, counts = poses[poses["robot"] == number], wheels[wheels["robot"] == number]
        colour = css(robot_colour(number - 1))
        axes.plot(path["x_mm"], path["y_mm"], color=colour, linewidth=1.2, label=f"robot {number}")
        axes.plot(path["x_mm"][:1], path["y_mm"][:1], "o", color=colour, markersize=4)
        if len(recording.robots) == len(saved.specs) == 1:
            body = saved.specs[0].body
            pulses = np.column_stack([counts["left_pulses"], counts["right_pulses"]])
            start = np.array([path[name][0] for name in ("x_mm", "y_mm", "heading_rad")])
            guess = odometry(pulses, start, body.pulse_mm, body.wheel_base_mm)
            axes.plot(guess[:, 0], guess[:, 1], color="C1", linewidth=0.9, linestyle="--", label="odometry")
        rises = np.flatnonzero(np.diff(counts["contacts"]) > 0) + 1
        touched = np.searchsorted(path["time_s"], counts["time_s"][rises]).clip(max=len(path) - 1)
        axes.plot(
            path["x_mm"][touched],
            path["y_mm"][touched],
            "x",
            color="tab:red",
            markersize=5,
            label="contacts" if number == recording.robots[-1] and len(touched) else None,
        )
    axes.set_xlim(0, saved.arena.width_mm)
    axes.set_ylim(0, saved.arena.height_mm)
    if 1 <= len(recording.robots) <= 6:
        legend = axes.legend(fontsize="x-small", loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        legend.set_in_layout(False)


def _draw_heat(axes: Any, arena: Arena, poses: Table) -> None:
    """Draw for how long robots were in which part of the arena."""
    cells = [np.arange(0.0, size_mm + HEAT_MM, HEAT_MM) for size_mm in (arena.width_mm, arena.height_mm)]
    seconds, x_edges, y_edges = np.histogram2d(poses["x_mm"], poses["y_mm"], bins=cells)
    _draw_arena(axes, arena)
    shown = np.ma.masked_equal(seconds.T * 0.01, 0.0)
    # As vectors, its cells would be most of a large picture.
    mesh = axes.pcolormesh(x_edges, y_edges, shown, cmap="viridis", alpha=0.9, rasterized=True)
    axes.figure.colorbar(mesh, ax=axes, label="seconds")
    axes.set_xlim(0, arena.width_mm)
    axes.set_ylim(0, arena.height_mm)


def _draw_readings(axes: Any, table: Table) -> None:
    """Draw what the program read of the proximity sensors."""
    table = _thinned(table[table["command"] == "N"])
    for sensor in range(8):
        axes.plot(table["time_s"], table["counts"][:, sensor], linewidth=0.7, label=str(sensor))
    axes.set_ylabel("proximity, sensors 0 to 7")
    axes.set_xlabel("time [s]")
    axes.grid(alpha=0.3)
    if len(table):
        _legend_above(axes, 8)
    else:
        _write_in(axes, "no command N")


def _draw_speeds(axes: Any, table: Table) -> None:
    """Draw the speeds of the wheels, as asked for and as measured."""
    table = _thinned(table)
    for side, colour in (("left", "C0"), ("right", "C3")):
        axes.plot(table["time_s"], table[f"{side}_speed"], color=colour, linewidth=0.7, label=side)
        asked = f"{side}, asked for"
        axes.plot(table["time_s"], table[f"{side}_setpoint"], color=colour, linewidth=0.7, linestyle=":", label=asked)
    axes.set_ylabel("pulses/10 ms")
    axes.set_xlabel("time [s]")
    axes.grid(alpha=0.3)
    _legend_above(axes, 4)


def _draw_time(axes: Any, recording: Recording, robot: int) -> None:
    """Draw where the time went: a bar of the shares of line, robot, thinking and waiting."""
    (shares,) = time_shares(recording.log, [robot])
    begin_s = 0.0
    names = ("on the line", "robot", "thinking", "waiting")
    for name, share_ns, colour in zip(names, shares, ("C0", "C2", "C1", "lightgray"), strict=True):
        share_s = s_from_ns(share_ns)
        percent = 100 * share_ns / max(shares.window_ns, 1)
        axes.barh([0], [share_s], left=begin_s, color=colour, label=f"{name} {percent:.1f} %")
        begin_s += share_s
    axes.set_yticks([])
    axes.set_xlabel(f"where the time of robot {robot} went [s]")
    _legend_above(axes, 4)


def _legend_above(axes: Any, columns: int) -> None:
    """Put a legend over the axes, where it hides no line and takes no width from them."""
    place = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.97), "frameon": False}
    legend = axes.legend(fontsize="xx-small", ncols=columns, columnspacing=1.0, handlelength=1.4, **place)
    legend.set_in_layout(False)


def _thinned(table: Table) -> Table:
    """Return a table with no more rows than a line can show."""
    return table[:: max(-(-len(table) // POINTS_MAX), 1)]
