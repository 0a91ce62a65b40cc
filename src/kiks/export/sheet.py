"""How walls, lamps, robots, balls and cylinders look from above: strokes in millimetres on a picture."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from importlib.util import find_spec
from itertools import groupby, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL
from kiks.export.light import light_map
from kiks.export.looks import HALO_MM, LED_COLOURS, LED_MM, robot_looks, robot_shapes
from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec
from kiks.sim.colours import LAMPLIGHT, Colour, body_colour, robot_colour

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFont import FreeTypeFont, ImageFont

Place = tuple[float, float]
Part = tuple[Sequence[Place], Colour | None, float]

FINER = 2
"""A sheet is drawn that much larger and shrunk, which smooths the lines."""

LAMP_MM = 18.0
"""How far the drawing of a lamp reaches [mm]."""

DARKEST = 0.4
"""How bright a black floor is drawn, as a share of a white one."""

LIGHT_SHARE = 0.6
"""Opacity of the strongest light on the floor."""

NAME_SHARE = 0.42
"""Radius of the disc with a robot's number, as a share of the robot's."""

FLOOR, INK, WHITE = (246, 243, 236), (30, 34, 40), (255, 255, 255)

_PATH_BEGIN, _PATH_END = (66, 135, 245), (220, 60, 60)
_LAMP_OFF = (165, 160, 150)


def path_colour(index: int, robot_count: int, share: float) -> Colour:
    """Return the colour of a path after a share of it: of one robot from blue to red, of several from faint to full."""
    begin: Colour = (*_PATH_BEGIN, 170)
    end: Colour = (*_PATH_END, 200)
    if robot_count > 1:
        begin, end = ((*robot_colour(index), opacity) for opacity in (90, 200))
    return mixed(begin, end, share)


def mixed(begin: Colour, end: Colour, share: float) -> Colour:
    """Return a colour between two: the first at a share of 0, the second at 1."""
    return tuple(round(a + (b - a) * share) for a, b in zip(begin, end, strict=True))


def path_mm(robot_count: int) -> float:
    """Return the width of a path [mm]."""
    return 1.2 if robot_count == 1 else 1.6


def wall_grey(brightness: Any) -> Any:
    """Return the grey of walls of a brightness: darker than they are, or a white wall would look like floor."""
    return 40 + brightness * 150 // 255


def ground_picture(
    arena: Arena, lamps: NDArray[np.float64], specs: Sequence[RobotSpec], size: tuple[int, int]
) -> Image:
    """Return a picture of the floor with the light of lamps, and the walls of an arena.

    Args:
        arena: The arena.
        lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off, float64 [lamp, 4].
        specs: The robots; the light is drawn for the sensors of the first, or a Khepera's.
        size: Its size in pixels.
    """
    from PIL import Image

    cells = np.flipud(arena.brightness)
    shade = wall_grey(cells.astype(np.uint16)).astype(np.uint8)
    floor: Any = np.array(FLOOR, np.uint8)
    if (lit := lit_floor(arena, lamps, specs)) is not None:
        floor = lit.resize((cells.shape[1], cells.shape[0]), Image.Resampling.BILINEAR)
    if arena.shades is not None:
        floor = (1.0 - darkness(np.flipud(arena.shades)))[..., None] * np.asarray(floor)
    colours = np.where((cells == 0)[..., None], np.asarray(floor), shade[..., None])
    return Image.fromarray(colours.astype(np.uint8), "RGB").resize(size, Image.Resampling.LANCZOS)


def lit_floor(arena: Arena, lamps: NDArray[np.float64], specs: Sequence[RobotSpec]) -> Image | None:
    """Return a white floor with the light of lamps, a pixel for each cell of `light_map`; None if it is dark.

    Args:
        arena: The arena.
        lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off, float64 [lamp, 4].
        specs: The robots; the light is drawn for the sensors of the first, or a Khepera's.
    """
    from PIL import Image

    if (light := light_map(arena, lamps, specs)) is None:
        return None
    floor = Image.new("RGB", light.shape[::-1], FLOOR)
    floor.paste(LAMPLIGHT, mask=Image.fromarray((255 * LIGHT_SHARE * light).astype(np.uint8)))
    return floor


def darkness(brightness: NDArray[Any]) -> NDArray[np.float64]:
    """Return how much darker the floor is drawn than a white one, a share of it: black is lighter than a black wall."""
    return (1.0 - DARKEST) * (1.0 - brightness / 255.0)


def coarse_cells(raster: NDArray[np.uint8], mm_per_cell: float, side_max: int) -> tuple[NDArray[np.uint8], float]:
    """Return a raster in at most so many cells a side, the most of each, and a cell's size [mm]."""
    step = max(-(-max(raster.shape) // side_max), 1)
    rows, columns = (-(-side // step) for side in raster.shape)
    padded = np.zeros((rows * step, columns * step), raster.dtype)
    padded[: raster.shape[0], : raster.shape[1]] = raster
    return padded.reshape(rows, step, columns, step).max(axis=(1, 3)), mm_per_cell * step


@lru_cache(64)
def font(size: float) -> FreeTypeFont | ImageFont:
    """Return the font of a size in pixels."""
    from PIL import ImageFont

    return ImageFont.load_default(size)


@lru_cache(64)
def text_font(size: float) -> FreeTypeFont:
    """Return a font for names that people choose: that of Matplotlib, as Pillow's own has no accents."""
    from PIL import ImageFont

    library = find_spec("matplotlib")  # importing it would take longer than drawing
    assert library is not None
    assert library.origin is not None
    return ImageFont.truetype(Path(library.origin).parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf", size)


def pen_on(image: Image) -> Any:
    """Return what draws on an image."""
    from PIL import ImageDraw

    return ImageDraw.Draw(image, "RGBA")


class Sheet:
    """A picture in the making, in millimetres; later strokes lie over earlier ones.

    Args:
        pen: What strokes are drawn with: `pen_on` an image, or a `VectorPen`.
        scale: Pixels of it a millimetre.
        left_mm: Place of its left side [mm].
        top_mm: Place of its upper side [mm].
    """

    def __init__(self, pen: Any, scale: float, left_mm: float, top_mm: float) -> None:
        self.pen, self.scale, self.left_mm, self.top_mm = pen, scale, left_mm, top_mm

    def point(self, place: Sequence[float]) -> Place:
        """Return the pixel of a place [mm]."""
        return (place[0] - self.left_mm) * self.scale, (self.top_mm - place[1]) * self.scale

    def disc(self, place: Sequence[float], radius_mm: float, fill: Colour | None, **outline: Any) -> None:
        """Draw a disc."""
        x, y = self.point(place)
        radius = radius_mm * self.scale
        self.pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill, **outline)

    def ring(self, place: Sequence[float], radius_mm: float, colour: Colour) -> None:
        """Draw where something stood: faint, for it is no more."""
        self.disc(place, radius_mm, (*colour[:3], colour[3] // 5), outline=colour, width=self.pixels(1.2))

    def pixels(self, length_mm: float) -> int:
        """Return a width [mm] in whole pixels, at least as many as are seen."""
        return max(round(length_mm * self.scale), FINER)

    def line(self, places: Sequence[Sequence[float]], colour: Colour, width_mm: float) -> None:
        """Draw a line through places."""
        if len(places) > 1:
            points = [self.point(place) for place in places]
            self.pen.line(points, fill=colour, width=self.pixels(width_mm), joint="curve")

    def path(self, poses: Sequence[Sequence[float]], colours: Iterable[Colour], width_mm: float) -> None:
        """Draw a line through poses, each piece of it in a colour of its own."""
        points, first = [self.point(pose) for pose in poses], 0
        for colour, same in groupby(islice(colours, len(points) - 1)):
            last = first + sum(1 for _ in same)
            self.pen.line(points[first : last + 1], fill=colour, width=self.pixels(width_mm))
            first = last

    def lamp(self, place: Place, *, is_on: bool) -> None:
        """Draw a lamp; its light is on the ground."""
        colour = LAMPLIGHT if is_on else _LAMP_OFF
        for k in range(8):
            turn = k * math.pi / 4
            ends = [(place[0] + r * math.cos(turn), place[1] + r * math.sin(turn)) for r in (11.0, LAMP_MM)]
            self.line(ends, INK if is_on else _LAMP_OFF, 2.0)
        self.disc(place, 8.0, colour, outline=INK, width=self.pixels(1.2))

    def body(self, body: Any) -> None:
        """Draw a ball with a glint, or a cylinder with its rim, by its record of `kiks.engine.state.BODY`."""
        place, radius_mm = (float(body["x_mm"]), float(body["y_mm"])), float(body["radius_mm"])
        self.disc(place, radius_mm, body_colour(body), outline=INK, width=self.pixels(1.2))
        if body["what"] == BALL:
            self.disc((place[0] - radius_mm / 3, place[1] + radius_mm / 3), radius_mm / 4, (*WHITE, 170))
        else:
            self.disc(place, 0.62 * radius_mm, None, outline=(*WHITE, 110), width=self.pixels(1.2))

    def robot(self, pose: Sequence[float], spec: RobotSpec, index: int, lit: int = 0) -> None:
        """Draw a robot from above, with the LEDs that are lit and its number on a disc of its colour.

        Args:
            pose: Its pose.
            spec: Its kind.
            index: Its index.
            lit: Which LEDs are lit, as `lit_leds` says.
        """
        x_mm, y_mm, heading_rad = pose
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        own, body = robot_colour(index), spec.body
        shapes, leds = _parts(spec)
        for points, colour, radius_mm in [
            *shapes,
            *(each for k, led in enumerate(leds) if lit >> k & 1 for each in led),
        ]:
            places = [(x_mm + x * cosine - y * sine, y_mm + x * sine + y * cosine) for x, y in points]
            if len(places) == 1:
                self.disc(places[0], radius_mm, colour or own)
            else:
                self.pen.polygon([self.point(place) for place in places], fill=colour or own)
        self.disc((x_mm, y_mm), NAME_SHARE * body.radius_mm, own)
        letters = font(max(0.6 * body.radius_mm * self.scale, 8.0))
        at = self.point((x_mm, y_mm))
        self.pen.text(at, str(index + 1), fill=WHITE, font=letters, anchor="mm", stroke_width=1, stroke_fill=WHITE)


@lru_cache(64)
def _parts(spec: RobotSpec) -> tuple[list[Part], list[list[Part]]]:
    """Return points, colour and radius of a robot's shapes, and of each LED that is lit; no colour is the robot's."""
    shapes: list[Part] = [
        (shape.points, _parsed(shape.colour) or None, shape.radius_mm) for shape in robot_shapes(spec)
    ]
    leds: list[list[Part]] = []
    for led in robot_looks(spec).leds:
        at, colours = ((led.ahead_mm, led.left_mm),), LED_COLOURS[led.colour]
        leds.append([(at, _parsed(colours["halo"]), HALO_MM), (at, _parsed(colours["lit"]), LED_MM)])
    return shapes, leds


def _parsed(colour: str) -> Colour:
    return tuple(bytes.fromhex(colour[1:]))
