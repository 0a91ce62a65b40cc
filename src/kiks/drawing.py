"""Pictures of a run, from above: walls, lamps, robots, balls and cylinders, where they began, and their paths."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL
from kiks.errors import ParameterError
from kiks.model.arena import PAD, Arena
from kiks.model.files import check_writable, replace_file
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
_GOLDEN = 0.618034  # hues that differ by this share of the circle stay apart, however many there are


class Trace:
    """The way of a simulation to where it stands: the paths of robots, and places of balls and cylinders.

    Args:
        sim: The simulation; from now on it records the paths of its robots.
        every_s: Time between two points of a path [s], whole hundredths.

    Attributes:
        bodies: The places of each ball and cylinder at each note, by its number.
    """

    def __init__(self, sim: Simulation, every_s: float = 0.1) -> None:
        self.sim = sim
        self.sim.record_paths(every_s)
        self.bodies: dict[int, list[Place]] = {}
        self.note()

    def note(self) -> None:
        """Write down where balls and cylinders are now; robots need no notes."""
        for body in self.sim.bodies():
            self.bodies.setdefault(int(body["number"]), []).append((float(body["x_mm"]), float(body["y_mm"])))

    def paths(self) -> list[list[list[float]]]:
        """Return the poses of each robot on its way: x_mm, y_mm, heading_rad."""
        poses: list[list[list[float]]] = self.sim.paths()[:, :, 1:].tolist()
        return poses


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
    for x_mm, y_mm, power_w, is_on in lamps.tolist():
        sheet.lamp((x_mm, y_mm), power_w, is_on=bool(is_on))
    if trace is not None:
        for index, (radius_mm, path) in enumerate(zip(radii_mm, trace.paths(), strict=True)):
            sheet.path(path, _colours(index, len(poses), len(path)), 1.2 if len(poses) == 1 else 1.6)
            sheet.ring(path[0][:2], radius_mm, (*_robot_colour(index, len(poses)), 90))
        for body in bodies:
            places = trace.bodies.get(int(body["number"]), [])
            sheet.line(places, (*_tint(body), 200), 2.4)
            if places:
                sheet.ring(places[0], float(body["radius_mm"]), (*_tint(body), 190))
    for body in bodies:
        place, radius_mm = (float(body["x_mm"]), float(body["y_mm"])), float(body["radius_mm"])
        sheet.body(place, radius_mm, _tint(body), is_ball=bool(body["what"] == BALL))
    for index, pose in enumerate(poses.tolist()):
        sheet.robot(pose, radii_mm[index], _robot_colour(index, len(poses)), str(index + 1))
    width, height = sheet.image.size
    return sheet.image.resize((width // _FINER, height // _FINER), Image.Resampling.LANCZOS)


def save_picture(image: Image, path: str | Path) -> None:
    """Write a picture; the type follows from the ending.

    Raises:
        ParameterError: If the place cannot be written or the ending names no type of picture.
    """
    pixels, kind = BytesIO(), _picture_type(path)
    image.save(pixels, kind)
    replace_file(path, pixels.getvalue(), "a picture")


def check_picture(path: str | Path) -> None:
    """Raise, before the run that is drawn, what `save_picture` would raise.

    Raises:
        ParameterError: If the place cannot be written or the ending names no type of picture.
    """
    _picture_type(path)
    check_writable(path, "a picture")


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
            "Let it end in .png."
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
    """

    def __init__(self, arena: Arena, longest_side: int) -> None:
        from PIL import Image, ImageDraw

        self.height_mm = arena.height_mm
        self.scale = _FINER * min(longest_side / max(arena.width_mm, arena.height_mm), 2.0)
        size = (max(round(arena.width_mm * self.scale), _FINER), max(round(arena.height_mm * self.scale), _FINER))
        cells = np.flipud(arena.surface[PAD:-PAD, PAD:-PAD])
        # Walls are shown darker than they are: on paper a white wall would be taken for floor.
        shade = (40 + cells.astype(np.uint16) * 150 // 255).astype(np.uint8)
        colours = np.where((cells == 0)[..., None], np.array(_FLOOR, np.uint8), shade[..., None])
        self.image = Image.fromarray(colours.astype(np.uint8), "RGB").resize(size, Image.Resampling.LANCZOS)
        self.pen = ImageDraw.Draw(self.image, "RGBA")

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
        points = [self.point(pose) for pose in poses]
        for begin, end, colour in zip(points, points[1:], colours, strict=False):
            self.pen.line([begin, end], fill=colour, width=self.pixels(width_mm))

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


__all__ = ["Trace", "check_picture", "draw_simulation", "draw_world", "save_picture"]
