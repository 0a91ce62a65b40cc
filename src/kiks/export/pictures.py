"""Pictures of a run, from above: walls, lamps, robots, balls and cylinders, where they began, and their paths."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL, BODY, CYLINDER
from kiks.export.sheet import FINER, Colour, Place, Sheet, path_colour, path_mm, robot_colour, tint, wall_picture
from kiks.model.arena import Arena, Ball
from kiks.model.atomic_files import check_writable, ending_of, replace_file
from kiks.model.robot import RobotSpec
from kiks.model.robot_parts import Body
from kiks.sim.simulation import Simulation

if TYPE_CHECKING:
    from PIL.Image import Image

PICTURES = {".png": "PNG", ".svg": "SVG", ".pdf": "PDF", ".jpg": "JPEG"}
"""The types of pictures by their endings."""

_LONGEST_SIDE = 1200
_PAGE_INCHES = 7.0


class Trace:
    """The way of a simulation to where it stands: the paths of robots, and places of balls and cylinders.

    Args:
        sim: The simulation; from now on it records the paths of its robots.
        every_s: Time between two points of a path [s], whole hundredths.
        points_max: Most points of a path; on a longer way fewer are kept. None for all.
    """

    def __init__(self, sim: Simulation, every_s: float = 0.1, *, points_max: int | None = None) -> None:
        self.sim = sim
        self.sim.record_paths(every_s, points_max=points_max)

    def paths(self) -> list[list[Sequence[float]]]:
        """Return the poses of each robot on its way to where it is: x_mm, y_mm, heading_rad."""
        ways = zip(self.sim.paths()[:, :, 1:], self.sim.poses().tolist(), strict=True)
        return [[*way[np.isfinite(way[:, 0])].tolist(), pose] for way, pose in ways]

    def bodies(self) -> dict[int, list[Place]]:
        """Return the places of each ball and cylinder on its way to where it is, by its number: x_mm, y_mm."""
        ways = self.sim.body_paths()
        for body in self.sim.bodies():
            ways.setdefault(int(body["number"]), []).append((float(body["x_mm"]), float(body["y_mm"])))
        return ways


def draw_simulation(sim: Simulation, trace: Trace | None = None) -> Image:
    """Return a picture of a simulation as it stands.

    Args:
        sim: The simulation.
        trace: The way there: paths are drawn, and faintly what stood where at the beginning.

    Example:
        >>> sim = Simulation(Arena.box(300, 200))
        >>> draw_simulation(sim).size
        (600, 400)
    """
    robots = [spec.body for spec in sim.specs]
    return draw_world(sim.arena, sim.lamps, sim.bodies(), sim.poses(), robots, trace)


def draw_world(
    arena: Arena,
    lamps: NDArray[np.float64],
    bodies: NDArray[np.void],
    poses: NDArray[np.float64],
    robots: Sequence[Body],
    trace: Trace | None = None,
    *,
    longest_side: int = _LONGEST_SIDE,
) -> Image:
    """Return a picture of what stands in an arena.

    Args:
        arena: The arena.
        lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off, float64 [lamp, 4].
        bodies: Records of `kiks.engine.state.BODY`, shape [body].
        poses: Of the robots: x_mm, y_mm, heading_rad, float64 [robot, 3].
        robots: The robots' shapes.
        trace: The way there: paths are drawn, and faintly what stood where at the beginning.
        longest_side: Most pixels of a side.
    """
    from PIL import Image

    sheet = _sheet_of(arena, longest_side)
    _draw(sheet, lamps, bodies, poses, robots, trace)
    width, height = sheet.image.size
    return sheet.image.resize((width // FINER, height // FINER), Image.Resampling.LANCZOS)


def draw_arena(arena: Arena) -> Image:
    """Return a picture of an arena and what it says of lamps, balls and cylinders, with a Khepera at each start."""
    bodies = np.zeros(len(arena.bodies), BODY)
    for record, body in zip(bodies, arena.bodies, strict=True):
        record["x_mm"], record["y_mm"], record["radius_mm"] = body.x_mm, body.y_mm, body.radius_mm
        record["brightness"], record["what"] = body.brightness, BALL if isinstance(body, Ball) else CYLINDER
    lamps, starts = np.array(arena.lamps, np.float64).reshape(-1, 4), np.array(arena.starts, np.float64).reshape(-1, 3)
    return draw_world(arena, lamps, bodies, starts, [RobotSpec.load("khepera").body] * len(starts))


def simulation_for_notebook(sim: Simulation) -> tuple[bytes, dict[str, int]]:
    """Return a picture of a simulation as it stands, as `png_for_notebook` does."""
    with sim.lock:
        image = draw_simulation(sim)
    return png_for_notebook(image)


def arena_for_notebook(arena: Arena) -> tuple[bytes, dict[str, int]]:
    """Return a picture of an arena, as `png_for_notebook` does."""
    return png_for_notebook(draw_arena(arena))


def png_for_notebook(image: Image) -> tuple[bytes, dict[str, int]]:
    """Return a picture as a PNG, and at which size a notebook shows it: half, so it is sharp on any screen."""
    pixels = BytesIO()
    image.save(pixels, "PNG")
    return pixels.getvalue(), {"width": image.width // 2, "height": image.height // 2}


def save_simulation(sim: Simulation, path: str | Path, trace: Trace | None = None) -> None:
    """Draw a simulation as it stands into a file: with lines that stay sharp if it ends in .svg, else in pixels.

    Args:
        sim: The simulation.
        path: The file; its type follows from the ending.
        trace: The way there, as for `draw_simulation`.
    """
    if _picture_type(path) != "SVG":
        save_picture(draw_simulation(sim, trace), path)
        return
    sheet = _sheet_of(sim.arena, _LONGEST_SIDE, of_lines := _SvgPen())
    _draw(sheet, sim.lamps, sim.bodies(), sim.poses(), [spec.body for spec in sim.specs], trace)
    replace_file(path, _svg(sheet.image, of_lines.elements, finer=FINER), "a picture")


def _draw(
    sheet: Sheet,
    lamps: NDArray[np.float64],
    bodies: NDArray[np.void],
    poses: NDArray[np.float64],
    robots: Sequence[Body],
    trace: Trace | None,
) -> None:
    """Draw what stands in an arena on a sheet."""
    for x_mm, y_mm, power_w, is_on in lamps.tolist():
        sheet.lamp((x_mm, y_mm), power_w, is_on=bool(is_on))
    if trace is not None:
        places_of = trace.bodies()
        for index, (robot, path) in enumerate(zip(robots, trace.paths(), strict=True)):
            sheet.path(path, _colours(index, len(poses), len(path)), path_mm(len(poses)))
            sheet.ring(path[0][:2], robot.radius_mm, (*robot_colour(index, len(poses)), 90))
        for body in bodies:
            places = places_of[int(body["number"])]
            sheet.line(places, (*tint(body), 200), 2.4)
            sheet.ring(places[0], float(body["radius_mm"]), (*tint(body), 190))
    for body in bodies:
        sheet.body(body)
    for index, pose in enumerate(poses.tolist()):
        sheet.robot(pose, robots[index], robot_colour(index, len(poses)), str(index + 1))


def save_picture(image: Image, path: str | Path) -> None:
    """Write a picture; the type follows from the ending."""
    pixels, kind = BytesIO(), _picture_type(path)
    if kind == "SVG":
        replace_file(path, _svg(image, []), "a picture")
        return
    # PDF: so many pixels an inch that it fits a page across, and pixels as they are.
    image.save(pixels, kind, **({"resolution": image.width / _PAGE_INCHES, "quality": 95} if kind == "PDF" else {}))
    replace_file(path, pixels.getvalue(), "a picture")


def check_picture(path: str | Path) -> None:
    """Raise, before the run that is drawn, what `save_picture` would raise."""
    _picture_type(path)
    check_writable(path, "a picture")


def _picture_type(path: str | Path) -> str:
    return PICTURES[ending_of(path, "a picture", PICTURES)]


def _colours(index: int, robot_count: int, count: int) -> Iterable[Colour]:
    """Return the colours along a path."""
    return (path_colour(index, robot_count, k / max(count - 1, 1)) for k in range(count))


def _sheet_of(arena: Arena, longest_side: int, pen: _SvgPen | None = None) -> Sheet:
    """Return a sheet with an arena, of which no side has more than so many pixels."""
    scale = FINER * min(longest_side / max(arena.width_mm, arena.height_mm), 2.0)
    size = (max(round(arena.width_mm * scale), FINER), max(round(arena.height_mm * scale), FINER))
    return Sheet(wall_picture(arena, size), scale, 0.0, arena.height_mm, pen)


class _SvgPen:
    """Draws what Pillow's `ImageDraw` would draw, as elements of SVG; of its methods those that a sheet uses.

    Attributes:
        elements: What was drawn.
    """

    def __init__(self) -> None:
        self.elements: list[str] = []

    def ellipse(
        self, box: tuple[float, ...], fill: Colour | None = None, outline: Colour | None = None, width: float = 1
    ) -> None:
        left, top, right, bottom = box
        edge = 0.0 if outline is None else width / 2  # Pillow's outline lies within the box
        place = (
            f'cx="{(left + right) / 2:.1f}" cy="{(top + bottom) / 2:.1f}" r="{max((right - left) / 2 - edge, 0):.1f}"'
        )
        self._add("circle", place, fill, outline, width)

    def polygon(self, points: Sequence[Place], fill: Colour | None = None) -> None:
        self._add("polygon", _svg_points(points), fill, None, 0)

    def line(self, points: Sequence[Place], fill: Colour | None = None, width: float = 1, joint: str = "") -> None:
        self._add("polyline", _svg_points(points) + ' stroke-linejoin="round"', None, fill, width)

    def text(self, at: Place, text: str, fill: Colour | None = None, font: Any = None, **_others: Any) -> None:
        place = f'x="{at[0]:.1f}" y="{at[1]:.1f}" font-size="{font.size:.1f}" font-family="sans-serif"'
        place += ' font-weight="bold" text-anchor="middle" dominant-baseline="central"'
        self._add("text", place, fill, None, 0, text)

    def _add(
        self, kind: str, shape: str, fill: Colour | None, stroke: Colour | None, width: float, text: str = ""
    ) -> None:
        words = [kind, shape, *_svg_colour("fill", fill)]
        if stroke is not None:
            words += [*_svg_colour("stroke", stroke), f'stroke-width="{width:.1f}"']
        self.elements.append(f"<{' '.join(words)}>{text}</{kind}>")


def _svg_points(points: Sequence[Place]) -> str:
    return f'points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}"'


def _svg_colour(name: str, colour: Colour | None) -> Iterable[str]:
    yield f'{name}="none"' if colour is None else f'{name}="#{bytes(colour[:3]).hex()}"'
    if colour is not None and len(colour) > 3:
        yield f'{name}-opacity="{colour[3] / 255:.2f}"'


def _svg(image: Image, elements: Sequence[str], *, finer: int = 1) -> str:
    """Return a file with a picture in pixels, and elements above it; it is shown smaller than they are."""
    pixels = BytesIO()
    image.save(pixels, "PNG")
    size = f'width="{image.width}" height="{image.height}"'
    data = b64encode(pixels.getvalue()).decode()
    shown = f'width="{image.width // finer}" height="{image.height // finer}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {image.width} {image.height}" {shown}>',
        f'<image {size} href="data:image/png;base64,{data}"/>',
        *elements,
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


__all__ = ["Trace", "check_picture", "draw_arena", "draw_simulation", "draw_world", "save_picture", "save_simulation"]
