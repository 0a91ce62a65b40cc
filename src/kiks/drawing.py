"""Pictures of a run, from above: walls, lamps, robots, balls and cylinders, where they began, and their paths."""

from __future__ import annotations

import colorsys
import math
from base64 import b64encode
from collections.abc import Iterable, Sequence
from io import BytesIO
from itertools import groupby, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL, BODY, CYLINDER
from kiks.errors import ParameterError
from kiks.model.arena import PAD, Arena, Ball
from kiks.model.atomic_files import check_writable, replace_file
from kiks.model.robot import RobotSpec
from kiks.sim.simulation import Simulation

if TYPE_CHECKING:
    from PIL.Image import Image

Colour = tuple[int, ...]
Place = tuple[float, float]

_FLOOR = (246, 243, 236)
_INK = (30, 34, 40)
_WHITE = (255, 255, 255)
_ONE_ROBOT = (38, 84, 60)
_PATH_BEGIN, _PATH_END = (66, 135, 245), (220, 60, 60)
_BALL, _CYLINDER = (245, 130, 40), (172, 118, 66)
_LIGHT = (255, 205, 40)
_LAMP_OFF = (165, 160, 150)
_LONGEST_SIDE = 1200
_FINER = 2  # drawn that much larger and shrunk, which smooths the lines
_PAGE_INCHES = 7.0
_GOLDEN = 0.618034  # hues that differ by this share of the circle stay apart, however many there are


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
    radii_mm = [spec.body.radius_mm for spec in sim.specs]
    return draw_world(sim.arena, sim.lamps, sim.bodies(), sim.poses(), radii_mm, trace)


def draw_world(
    arena: Arena,
    lamps: NDArray[np.float64],
    bodies: NDArray[np.void],
    poses: NDArray[np.float64],
    radii_mm: Sequence[float],
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
        radii_mm: Of the robots [mm].
        trace: The way there: paths are drawn, and faintly what stood where at the beginning.
        longest_side: Most pixels of a side.
    """
    from PIL import Image

    sheet = _Sheet(arena, longest_side)
    _draw(sheet, lamps, bodies, poses, radii_mm, trace)
    width, height = sheet.image.size
    return sheet.image.resize((width // _FINER, height // _FINER), Image.Resampling.LANCZOS)


def draw_arena(arena: Arena) -> Image:
    """Return a picture of an arena and what it says of lamps, balls and cylinders, with a Khepera at each start."""
    bodies = np.zeros(len(arena.bodies), BODY)
    for record, body in zip(bodies, arena.bodies, strict=True):
        record["x_mm"], record["y_mm"], record["radius_mm"] = body.x_mm, body.y_mm, body.radius_mm
        record["brightness"], record["what"] = body.brightness, BALL if isinstance(body, Ball) else CYLINDER
    lamps, starts = np.array(arena.lamps, np.float64).reshape(-1, 4), np.array(arena.starts, np.float64).reshape(-1, 3)
    return draw_world(arena, lamps, bodies, starts, [RobotSpec.load("khepera").body.radius_mm] * len(starts))


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

    Raises:
        ParameterError: If the place cannot be written or the ending names no type of picture.
    """
    if not _is_svg(path):
        save_picture(draw_simulation(sim, trace), path)
        return
    sheet = _Sheet(sim.arena, _LONGEST_SIDE, of_lines := _SvgPen())
    _draw(sheet, sim.lamps, sim.bodies(), sim.poses(), [spec.body.radius_mm for spec in sim.specs], trace)
    replace_file(path, _svg(sheet.image, of_lines.elements, finer=_FINER), "a picture")


def _draw(
    sheet: _Sheet,
    lamps: NDArray[np.float64],
    bodies: NDArray[np.void],
    poses: NDArray[np.float64],
    radii_mm: Sequence[float],
    trace: Trace | None,
) -> None:
    """Draw what stands in an arena on a sheet."""
    for x_mm, y_mm, power_w, is_on in lamps.tolist():
        sheet.lamp((x_mm, y_mm), power_w, is_on=bool(is_on))
    if trace is not None:
        places_of = trace.bodies()
        for index, (radius_mm, path) in enumerate(zip(radii_mm, trace.paths(), strict=True)):
            sheet.path(path, _colours(index, len(poses), len(path)), 1.2 if len(poses) == 1 else 1.6)
            sheet.ring(path[0][:2], radius_mm, (*_robot_colour(index, len(poses)), 90))
        for body in bodies:
            places = places_of[int(body["number"])]
            sheet.line(places, (*_tint(body), 200), 2.4)
            sheet.ring(places[0], float(body["radius_mm"]), (*_tint(body), 190))
    for body in bodies:
        place, radius_mm = (float(body["x_mm"]), float(body["y_mm"])), float(body["radius_mm"])
        sheet.body(place, radius_mm, _tint(body), is_ball=bool(body["what"] == BALL))
    for index, pose in enumerate(poses.tolist()):
        sheet.robot(pose, radii_mm[index], _robot_colour(index, len(poses)), str(index + 1))


def save_picture(image: Image, path: str | Path) -> None:
    """Write a picture; the type follows from the ending.

    Raises:
        ParameterError: If the place cannot be written or the ending names no type of picture.
    """
    if _is_svg(path):
        replace_file(path, _svg(image, []), "a picture")
        return
    pixels, kind = BytesIO(), _picture_type(path)
    # PDF: so many pixels an inch that it fits a page across, and pixels as they are.
    image.save(pixels, kind, **({"resolution": image.width / _PAGE_INCHES, "quality": 95} if kind == "PDF" else {}))
    replace_file(path, pixels.getvalue(), "a picture")


def check_picture(path: str | Path) -> None:
    """Raise, before the run that is drawn, what `save_picture` would raise.

    Raises:
        ParameterError: If the place cannot be written or the ending names no type of picture.
    """
    if not _is_svg(path):
        _picture_type(path)
    check_writable(path, "a picture")


def _is_svg(path: str | Path) -> bool:
    return Path(path).suffix.lower() == ".svg"


def _picture_type(path: str | Path) -> str:
    from PIL import Image

    Image.init()
    kind = Image.registered_extensions().get(Path(path).suffix.lower(), "")
    try:
        # Some types can be read only, or need a library that is not there.
        Image.new("RGB", (1, 1)).save(BytesIO(), kind)
    except (KeyError, OSError, ValueError):
        raise ParameterError(
            f"a picture must go to a file like 'run.png', but {str(path)!r} ends like no picture that can be written. "
            "Let it end in .png, .svg or .pdf."
        ) from None
    return kind


def _robot_colour(index: int, robot_count: int) -> Colour:
    """Return the colour of a robot: one has a green of its own, of several each another hue."""
    if robot_count == 1:
        return _ONE_ROBOT
    red, green, blue = colorsys.hls_to_rgb((0.6 + index * _GOLDEN) % 1.0, 0.36, 0.72)
    return round(255 * red), round(255 * green), round(255 * blue)


def _colours(index: int, robot_count: int, count: int) -> Iterable[Colour]:
    """Return the colours along a path: of one robot from blue to red, of several from faint to full."""
    for k in range(count):
        share = k / max(count - 1, 1)
        begin: Colour = (*_PATH_BEGIN, 170)
        end: Colour = (*_PATH_END, 200)
        if robot_count > 1:
            begin, end = ((*_robot_colour(index, robot_count), opacity) for opacity in (90, 200))
        yield tuple(round(a + (b - a) * share) for a, b in zip(begin, end, strict=True))


def _tint(body: Any) -> Colour:
    """Return the colour of a body: that of its kind, and the darker, the less light it sends back."""
    full = _BALL if body["what"] == BALL else _CYLINDER
    share = 0.35 + 0.65 * min(int(body["brightness"]) / 190, 1.0)
    return tuple(round(part * share) for part in full)


class _Sheet:
    """A picture in the making, in millimetres; later strokes lie over earlier ones.

    Args:
        arena: What is drawn on it first.
        longest_side: Most pixels of a side of the picture.
        pen: What strokes are drawn with, instead of pixels of `image`.

    Attributes:
        image: The arena, and what was drawn on it in pixels.
    """

    def __init__(self, arena: Arena, longest_side: int, pen: _SvgPen | None = None) -> None:
        from PIL import Image, ImageDraw

        self.height_mm = arena.height_mm
        self.scale = _FINER * min(longest_side / max(arena.width_mm, arena.height_mm), 2.0)
        size = (max(round(arena.width_mm * self.scale), _FINER), max(round(arena.height_mm * self.scale), _FINER))
        cells = np.flipud(arena.surface[PAD:-PAD, PAD:-PAD])
        # Walls are shown darker than they are: on paper a white wall would be taken for floor.
        shade = (40 + cells.astype(np.uint16) * 150 // 255).astype(np.uint8)
        colours = np.where((cells == 0)[..., None], np.array(_FLOOR, np.uint8), shade[..., None])
        self.image = Image.fromarray(colours.astype(np.uint8), "RGB").resize(size, Image.Resampling.LANCZOS)
        self.pen: Any = ImageDraw.Draw(self.image, "RGBA") if pen is None else pen

    def point(self, place: Sequence[float]) -> Place:
        """Return the pixel of a place [mm]."""
        return place[0] * self.scale, (self.height_mm - place[1]) * self.scale

    def disc(self, place: Sequence[float], radius_mm: float, fill: Colour | None, **outline: Any) -> None:
        x, y = self.point(place)
        radius = radius_mm * self.scale
        self.pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill, **outline)

    def ring(self, place: Sequence[float], radius_mm: float, colour: Colour) -> None:
        """Draw where something stood: faint, for it is no more."""
        self.disc(place, radius_mm, (*colour[:3], colour[3] // 5), outline=colour, width=self.pixels(1.2))

    def pixels(self, length_mm: float) -> int:
        return max(round(length_mm * self.scale), _FINER)

    def line(self, places: Sequence[Sequence[float]], colour: Colour, width_mm: float) -> None:
        if len(places) > 1:
            points = [self.point(place) for place in places]
            self.pen.line(points, fill=colour, width=self.pixels(width_mm), joint="curve")

    def path(self, poses: Sequence[Sequence[float]], colours: Iterable[Colour], width_mm: float) -> None:
        points, first = [self.point(pose) for pose in poses], 0
        for colour, same in groupby(islice(colours, len(points) - 1)):
            last = first + sum(1 for _ in same)
            self.pen.line(points[first : last + 1], fill=colour, width=self.pixels(width_mm))
            first = last

    def lamp(self, place: Place, power_w: float, *, is_on: bool) -> None:
        """Draw a lamp, and its light as far as a sensor that looks at it would read less than half of darkness."""
        if is_on:
            reach_mm = 90.0 * math.sqrt(power_w)
            rings = 24
            for k in range(rings):
                self.disc(place, reach_mm * (1 - k / rings), (*_LIGHT, 7))
        colour = _LIGHT if is_on else _LAMP_OFF
        for k in range(8):
            turn = k * math.pi / 4
            ends = [(place[0] + r * math.cos(turn), place[1] + r * math.sin(turn)) for r in (11.0, 18.0)]
            self.line(ends, _INK if is_on else _LAMP_OFF, 2.0)
        self.disc(place, 8.0, colour, outline=_INK, width=self.pixels(1.2))

    def body(self, place: Place, radius_mm: float, colour: Colour, *, is_ball: bool) -> None:
        """Draw a ball with a glint, or a cylinder with its rim."""
        self.disc(place, radius_mm, colour, outline=_INK, width=self.pixels(1.2))
        if is_ball:
            self.disc((place[0] - radius_mm / 3, place[1] + radius_mm / 3), radius_mm / 4, (*_WHITE, 170))
        else:
            self.disc(place, 0.62 * radius_mm, None, outline=(*_WHITE, 110), width=self.pixels(1.2))

    def robot(self, pose: Sequence[float], radius_mm: float, colour: Colour, name: str) -> None:
        """Draw a robot from above: two wheels, a nose that shows its heading, and its number."""
        from PIL import ImageFont

        x_mm, y_mm, heading = pose
        ahead, aside = (math.cos(heading), math.sin(heading)), (-math.sin(heading), math.cos(heading))

        def at(forwards: float, sideways: float) -> Place:
            """Return the pixel of a place on the robot, in radii."""
            along_mm, across_mm = forwards * radius_mm, sideways * radius_mm
            x = x_mm + along_mm * ahead[0] + across_mm * aside[0]
            return self.point((x, y_mm + along_mm * ahead[1] + across_mm * aside[1]))

        self.disc((x_mm, y_mm), radius_mm, colour, outline=_INK, width=self.pixels(1.0))
        for side in (-1, 1):
            wheel = [at(0.35, 0.92 * side), at(0.35, 0.72 * side), at(-0.35, 0.72 * side), at(-0.35, 0.92 * side)]
            self.pen.polygon(wheel, fill=_INK)
        self.pen.polygon([at(0.98, 0.0), at(0.5, 0.42), at(0.5, -0.42)], fill=_WHITE)
        font = ImageFont.load_default(max(radius_mm * self.scale * 0.72, 8.0))
        self.pen.text(at(-0.16, 0.0), name, fill=_WHITE, font=font, anchor="mm", stroke_width=1, stroke_fill=_WHITE)


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
