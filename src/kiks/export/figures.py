"""Figures of recordings: paths, readings, speeds, places and time. They need Matplotlib.

A recording has a column, so that several stand side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL
from kiks.errors import ParameterError
from kiks.export.findings import Findings, gather_findings
from kiks.export.kinds import KINDS
from kiks.export.looks import css
from kiks.export.pictures import Picture, Trails
from kiks.export.vector_pen import figure_bytes
from kiks.model.arena import Arena
from kiks.model.atomic_files import ending_of, replace_file
from kiks.recording.analysis import odometry
from kiks.recording.recorder import RunRecorder, RunWriter
from kiks.recording.recording import Recording
from kiks.recording.tables import Table
from kiks.sim.colours import LAMPLIGHT, body_colour, robot_colour
from kiks.sim.simulation import Simulation
from kiks.sim.wire_log import TimeShares
from kiks.units import s_from_ns

NO_ROBOT = "There was no robot in this run"

COLUMN_INCHES = 4.6

COLUMN_MM, MM_IN_AN_INCH = 85.0, 25.4
"""Width of a column of a journal [mm], and millimetres in an inch."""

COLUMN_STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "axes.linewidth": 0.5,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2,
    "ytick.major.size": 2,
    "lines.linewidth": 1.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
}
"""How a figure for a column looks: texts of 7 and 8 points, thin lines."""

TITLE_CHARACTERS = 52
"""Most characters of a line of a title."""

PATH_COLUMNS, LEGEND_LINE_POINTS = 3, 13.0
"""Columns of the legend of paths, above which the title stands, and the height of its lines."""

HEAT_MM = 20.0
"""Side of a cell of the heat map [mm]."""

LINE_PARTS = 1000
"""Parts of a line over time, each about as wide as a pixel."""


class FigureRow(NamedTuple):
    """A row of the figures.

    Attributes:
        title: Its title.
        text: A sentence about it, of the robot with the number {robot}.
        inches: How high a row over time is; None for as high as the arena makes it.
        alone_inches: How high it is where it stands alone.
    """

    title: str
    text: str
    inches: float | None = None
    alone_inches: float | None = None


ROWS = {
    "paths": FigureRow("Paths", "Where robots drove, and where the wheels of a lone robot say that it did"),
    "places": FigureRow("Places", "How long robots were in which part of the arena"),
    "readings": FigureRow("Readings", "What the program read of the proximity sensors of robot {robot}", 2.1, 2.6),
    "speeds": FigureRow("Speeds", "How fast the wheels of robot {robot} turned, and how fast they should", 2.1, 2.6),
    "time": FigureRow("Time", "Where the milliseconds of robot {robot} went", 0.75, 1.3),
}
"""All rows, the first on top."""


def save_figures(recordings: Sequence[Recording], path: str | Path, *, robot: int = 1) -> None:
    """Draw recordings side by side: paths, where robots were, readings, speeds, and where the time went.

    Of several recordings the title names the file, and the scales are the same.

    Args:
        recordings: The recordings.
        path: The picture's file, .png, .svg or .pdf.
        robot: Number of the robot whose readings, speeds and time are drawn; a run without a robot has paths alone.
    """
    kind = ending_of(path, "figures", KINDS["figures"].endings)[1:]
    replace_file(path, figure_bytes(draw_figure(recordings, robot=robot), kind), "figures")


def save_figure(figure: Any, path: str | Path, dots_per_inch: int = 110) -> None:
    """Write a figure, whose texts become plain: .png, .svg or .pdf."""
    kind = ending_of(path, "the picture", KINDS["figures"].endings)[1:]
    replace_file(path, figure_bytes(_with_plain_texts(figure), kind, dots_per_inch), "the picture")


@contextmanager
def column_figure(path: str | Path, height_mm: float, **layout: Any) -> Iterator[Any]:
    """Yield the axes of a figure as wide as a column of a journal, and write it: .png, .svg or .pdf.

    Args:
        path: File of the figure.
        height_mm: Its height [mm].
        layout: Arguments of `Figure.subplots`, such as `nrows`.

    Example:
        >>> import tempfile
        >>> file = Path(tempfile.mkdtemp()) / "line.svg"
        >>> with column_figure(file, 40) as axes:
        ...     _ = axes.plot([1, 2], [3, 4])
        >>> file.exists()
        True
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    ending_of(path, "the picture", KINDS["figures"].endings)
    with rc_context(COLUMN_STYLE):
        figure = Figure(figsize=(COLUMN_MM / MM_IN_AN_INCH, height_mm / MM_IN_AN_INCH), layout="constrained")
        yield figure.subplots(**layout)
        save_figure(figure, path, 200)


def draw_paths(axes: Any, arena: Arena, paths: Sequence[Any], colours: Sequence[Any] = ()) -> None:
    """Draw an arena from above, and paths in it; each begins with a dot.

    Args:
        axes: The axes.
        arena: The arena.
        paths: Of each path x_mm and y_mm, float64 [point, 2 or more].
        colours: Their colours; those of Matplotlib if left out.
    """
    Picture.of_arena(replace(arena, starts=())).draw_on(axes, COLUMN_MM / MM_IN_AN_INCH)
    for number, path in enumerate(paths):
        colour = colours[number] if colours else f"C{number % 10}"
        axes.plot(path[:, 0], path[:, 1], color=colour, linewidth=0.7)
        axes.plot(*path[0, :2], "o", color=colour, markersize=2.5)
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(False)


def _with_plain_texts(figure: Any) -> Any:
    """Return a figure in which no text is a formula: names come from files of others, and may have a $."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set(parse_math=False, usetex=False)
    return figure


def draw_panels(recording: Recording, found: Findings | None = None, *, robot: int = 1) -> dict[str, bytes]:
    """Return what `save_figures` draws of one recording as single pictures, by the names of `ROWS`, in SVG."""
    from matplotlib.figure import Figure

    pictures = {}
    arena_inches = _arena_inches([recording]) + 0.9
    for name, draw in _drawings(recording, found or gather_findings(recording), robot).items():
        inches = ROWS[name].alone_inches
        size = (COLUMN_INCHES, arena_inches) if inches is None else (2 * COLUMN_INCHES, inches)
        figure = Figure(figsize=size, layout="constrained")
        draw(figure.subplots())
        pictures[name] = figure_bytes(_with_plain_texts(figure), "svg")
    return pictures


def draw_figure(recordings: Sequence[Recording], *, robot: int = 1) -> Any:
    """Return the figure of `save_figures`, a `matplotlib.figure.Figure`."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    drawings = [_drawings(recording, gather_findings(recording), robot) for recording in recordings]
    # Padding makes room for the legends between the rows.
    layout = ConstrainedLayoutEngine(h_pad=0.1)
    arena_inches = _arena_inches(recordings)
    heights = [arena_inches if row.inches is None else row.inches for row in ROWS.values()]
    figure = Figure(figsize=(COLUMN_INCHES * len(recordings), sum(heights) + 0.8 * len(heights)), layout=layout)
    axes = figure.subplots(len(heights), len(recordings), squeeze=False, height_ratios=heights)
    for column, recording, draw in zip(axes.T, recordings, drawings, strict=True):
        name = f"{recording.log.reader.path.name}: " if len(recordings) > 1 else ""
        title = fill(f"{name}{recording.title}", TITLE_CHARACTERS)
        for axes_of_row, name in zip(column, ROWS, strict=True):
            draw.get(name, _draw_nothing)(axes_of_row)
        legend = column[0].get_legend()
        lines = 0 if legend is None else -(-len(legend.get_texts()) // PATH_COLUMNS)
        column[0].set_title(title, fontsize="medium", pad=6 + LEGEND_LINE_POINTS * lines)
    for row, in_row in zip(ROWS.values(), axes, strict=True):
        if row.inches is not None:
            drawn = [each for each in in_row if each.axison]
            for limits in ("xlim", "ylim"):
                ends = [getattr(each, f"get_{limits}")() for each in drawn]
                for each in drawn:
                    each.set(**{limits: (min(low for low, _ in ends), max(high for _, high in ends))})
    return _with_plain_texts(figure)


def _arena_inches(recordings: Sequence[Recording]) -> float:
    """Return how high the axes of arenas are [inches]: the highest fills its column, if it is not too high."""
    shapes = [each.start.arena.height_mm / each.start.arena.width_mm for each in recordings]
    return min(max(0.8 * COLUMN_INCHES * max(shapes, default=1.0), 1.2), COLUMN_INCHES)


def draw_run_figure(sim: Simulation, *, robot: int = 1) -> Any:
    """Return the figure of a run that is being recorded; see `draw_figure`."""
    writer = sim.loop.recorder
    stores = writer.stores if isinstance(writer, RunWriter) else ()
    recorders = [store for store in stores if isinstance(store, RunRecorder)]
    if not recorders:
        raise ParameterError(
            f"{sim} must be recorded while it is plotted, but it is not. Begin with: with sim.record('run.mcap'):"
        )
    recorders[-1].flush()
    return draw_figure([Recording(recorders[-1].path)], robot=robot)


def _drawings(recording: Recording, found: Findings, robot: int) -> dict[str, Callable[[Any], None]]:
    """Return functions that draw the rows on axes, by the names of `ROWS`: of a run without a robot, paths alone."""
    poses, wheels, readings = (found.tables[name] for name in ("poses", "wheels", "readings"))
    picture = found.picture
    bodies_alone = Trails((), picture.trails.bodies if picture.trails else {})
    picture = replace(picture, trails=bodies_alone)
    paths = {"paths": lambda axes: _draw_paths(axes, recording, picture, poses, wheels)}
    if not recording.robots:
        return paths
    recording.check_robot(robot)
    unit = recording.log.state_before(recording.log.end_ns).specs[robot - 1].motor.speed_unit
    return paths | {
        "places": lambda axes: _draw_heat(axes, replace(picture, poses=picture.poses[:0]), poses),
        "readings": lambda axes: _draw_readings(axes, readings[readings["robot"] == robot]),
        "speeds": lambda axes: _draw_speeds(axes, wheels[wheels["robot"] == robot], unit),
        "time": lambda axes: _draw_time(axes, found.shares[robot - 1], robot),
    }


def _draw_nothing(axes: Any) -> None:
    axes.set_axis_off()
    _write_in(axes, NO_ROBOT)


def _write_in(axes: Any, text: str) -> None:
    """Write in the middle of axes why they are empty."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color="gray")


def _draw_arena(axes: Any, picture: Picture) -> None:
    picture.draw_on(axes, 0.7 * COLUMN_INCHES)
    axes.set(xlabel="x [mm]", ylabel="y [mm]")


def _draw_paths(axes: Any, recording: Recording, picture: Picture, poses: Table, wheels: Table) -> None:
    """Draw where robots drove, where their wheels say that they drove, and where they began to touch something."""
    saved = recording.start
    _draw_arena(axes, picture)
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
    things = {"lamp": ("*", css(LAMPLIGHT))} if len(picture.lamps) else {}
    things |= {"ball" if body["what"] == BALL else "cylinder": ("o", css(body_colour(body))) for body in picture.bodies}
    for what, (marker, fill_colour) in things.items():
        axes.plot([], [], marker, color=fill_colour, markeredgecolor="black", label=what)
    if 1 <= len(recording.robots) <= 6:
        _legend_above(axes, PATH_COLUMNS)


def _draw_heat(axes: Any, picture: Picture, poses: Table) -> None:
    """Draw for how long robots were in which part of the arena."""
    sides_mm = picture.arena.width_mm, picture.arena.height_mm
    cells = [np.arange(0.0, side_mm + HEAT_MM, HEAT_MM) for side_mm in sides_mm]
    seconds, x_edges, y_edges = np.histogram2d(poses["x_mm"], poses["y_mm"], bins=cells)
    _draw_arena(axes, picture)
    shown = np.ma.masked_equal(seconds.T * 0.01, 0.0)
    # As vectors, its cells would be most of a large picture.
    mesh = axes.pcolormesh(x_edges, y_edges, shown, cmap="viridis", alpha=0.9, rasterized=True)
    # The bar lies above, so that these axes are as large as those of the paths.
    bar = axes.inset_axes((0.5, 1.04, 0.5, 0.05))
    axes.figure.colorbar(mesh, cax=bar, orientation="horizontal", ticklocation="top")
    bar.tick_params(labelsize="small")
    bar.text(-0.03, 0.5, "seconds", transform=bar.transAxes, ha="right", va="center", fontsize="small")
    axes.set(xlim=(0, sides_mm[0]), ylim=(0, sides_mm[1]))


def _draw_readings(axes: Any, table: Table) -> None:
    """Draw what the program read of the proximity sensors."""
    table = table[table["command"] == "N"]
    for sensor in range(8):
        axes.plot(*_seen(table["time_s"], table["counts"][:, sensor]), linewidth=0.7, label=str(sensor))
    axes.set_ylabel("proximity")
    axes.set_xlabel("time [s]")
    axes.grid(alpha=0.3)
    if len(table):
        _legend_above(axes, 8)
    else:
        _write_in(axes, "no command N")


def _draw_speeds(axes: Any, table: Table, unit: str) -> None:
    """Draw the speeds of the wheels, as asked for and as measured."""
    for side, colour in (("left", "C0"), ("right", "C3")):
        axes.plot(*_seen(table["time_s"], table[f"{side}_speed"]), color=colour, linewidth=0.7, label=side)
        axes.plot(*_seen(table["time_s"], table[f"{side}_setpoint"]), color=colour, linewidth=0.7, linestyle=":")
    axes.plot([], [], color="gray", linewidth=0.9, linestyle=":", label="asked for")
    axes.set_ylabel(f"speed [{unit}]")
    axes.set_xlabel("time [s]")
    axes.grid(alpha=0.3)
    _legend_above(axes, 3)


def _draw_time(axes: Any, shares: TimeShares, robot: int) -> None:
    """Draw where the time went: a bar of the shares of line, robot, thinking and waiting."""
    begin_s = 0.0
    names = ("on the line", "robot", "thinking", "waiting")
    for name, share_ns, colour in zip(names, shares, ("C0", "C2", "C1", "lightgray"), strict=True):
        share_s = s_from_ns(share_ns)
        percent = 100 * share_ns / max(shares.window_ns, 1)
        axes.barh([0], [share_s], left=begin_s, color=colour, label=f"{name} {percent:.1f} %")
        begin_s += share_s
    axes.set_yticks([])
    axes.set_xlabel(f"where the time of robot {robot} went [s]")
    _legend_above(axes, 2)


def _legend_above(axes: Any, columns: int) -> None:
    """Put a legend over the axes, where it hides no line and takes no width from them."""
    place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.0, "frameon": False}
    axes.legend(fontsize="small", ncols=columns, columnspacing=1.0, handlelength=1.2, labelspacing=0.2, **place)


def _seen(time_s: NDArray[np.float64], values: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[Any]]:
    """Return of a line over time what can be seen: the least and the greatest value of each part of it."""
    size = -(-len(values) // LINE_PARTS)
    if size <= 2:
        return time_s, values
    rows = np.pad(values, (0, -len(values) % size), mode="edge").reshape(-1, size)
    ends = np.stack([rows.argmin(axis=1), rows.argmax(axis=1)]) + np.arange(len(rows)) * size
    kept = np.unique(np.minimum(ends, len(values) - 1))
    return time_s[kept], values[kept]
