"""How walls, lamps, robots, balls and cylinders look from above: strokes in millimetres on a picture."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import groupby, islice
from typing import TYPE_CHECKING, Any

import numpy as np

from kiks.engine.state import BALL
from kiks.model.arena import PAD, Arena
from kiks.model.robot_parts import Body

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFont import FreeTypeFont, ImageFont

Colour = tuple[int, ...]
Place = tuple[float, float]

FINER = 2
"""A sheet is drawn that much larger and shrunk, which smooths the lines."""

LAMP_MM = 18.0
"""How far a lamp reaches without its light [mm]."""

STRIPES_MM = 3.0
"""How wide stripes around a robot are seen from above [mm]."""

ROUND_RAD = 0.05
"""Largest angle between two corners of a drawn arc [rad]."""

FLOOR, INK, BLACK, WHITE = (246, 243, 236), (30, 34, 40), (0, 0, 0), (255, 255, 255)

_ONE_ROBOT = (38, 84, 60)
_PATH_BEGIN, _PATH_END = (66, 135, 245), (220, 60, 60)
_BALL, _CYLINDER = (245, 130, 40), (172, 118, 66)
_LIGHT = (255, 205, 40)
_LAMP_OFF = (165, 160, 150)
_GOLDEN = 0.618034  # hues that differ by this share of the circle stay apart, however many there are


def robot_colour(index: int, robot_count: int) -> Colour:
    """Return the colour of a robot: one has a green of its own, of several each another hue."""
    if robot_count == 1:
        return _ONE_ROBOT
    red, green, blue = colorsys.hls_to_rgb((0.6 + index * _GOLDEN) % 1.0, 0.36, 0.72)
    return round(255 * red), round(255 * green), round(255 * blue)


def path_colour(index: int, robot_count: int, share: float) -> Colour:
    """Return the colour of a path after a share of it: of one robot from blue to red, of several from faint to full."""
    begin: Colour = (*_PATH_BEGIN, 170)
    end: Colour = (*_PATH_END, 200)
    if robot_count > 1:
        begin, end = ((*robot_colour(index, robot_count), opacity) for opacity in (90, 200))
    return mixed(begin, end, share)


def mixed(begin: Colour, end: Colour, share: float) -> Colour:
    """Return a colour between two: the first at a share of 0, the second at 1."""
    return tuple(round(a + (b - a) * share) for a, b in zip(begin, end, strict=True))


def path_mm(robot_count: int) -> float:
    """Return the width of a path [mm]."""
    return 1.2 if robot_count == 1 else 1.6


def tint(body: Any) -> Colour:
    """Return the colour of a body: that of its kind, and the darker, the less light it sends back."""
    full = _BALL if body["what"] == BALL else _CYLINDER
    share = 0.35 + 0.65 * min(int(body["brightness"]) / 190, 1.0)
    return tuple(round(part * share) for part in full)


def lamp_reach_mm(power_w: float) -> float:
    """Return how far the light of a lamp is drawn [mm]: a sensor that looks at it would read half of darkness there."""
    return 90.0 * math.sqrt(power_w)


def wall_picture(arena: Arena, size: tuple[int, int]) -> Image:
    """Return a picture of the floor and the walls of an arena, of a size in pixels."""
    from PIL import Image

    cells = np.flipud(arena.surface[PAD:-PAD, PAD:-PAD])
    # Walls are shown darker than they are: on paper a white wall would be taken for floor.
    shade = (40 + cells.astype(np.uint16) * 150 // 255).astype(np.uint8)
    colours = np.where((cells == 0)[..., None], np.array(FLOOR, np.uint8), shade[..., None])
    return Image.fromarray(colours.astype(np.uint8), "RGB").resize(size, Image.Resampling.LANCZOS)


@lru_cache(64)
def font(size: float) -> FreeTypeFont | ImageFont:
    """Return the font of a size in pixels."""
    from PIL import ImageFont

    return ImageFont.load_default(size)


class Sheet:
    """A picture in the making, in millimetres; later strokes lie over earlier ones.

    Args:
        image: What is drawn on.
        scale: Pixels of it a millimetre.
        left_mm: Place of its left side [mm].
        top_mm: Place of its upper side [mm].
        pen: What strokes are drawn with, instead of pixels of `image`.
    """

    def __init__(self, image: Image, scale: float, left_mm: float, top_mm: float, pen: Any = None) -> None:
        from PIL import ImageDraw

        self.image, self.scale, self.left_mm, self.top_mm = image, scale, left_mm, top_mm
        self.pen: Any = ImageDraw.Draw(image, "RGBA") if pen is None else pen

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

    def lamp(self, place: Place, power_w: float, *, is_on: bool) -> None:
        """Draw a lamp and its light."""
        if is_on:
            reach_mm = lamp_reach_mm(power_w)
            rings = 24
            for k in range(rings):
                self.disc(place, reach_mm * (1 - k / rings), (*_LIGHT, 7))
        colour = _LIGHT if is_on else _LAMP_OFF
        for k in range(8):
            turn = k * math.pi / 4
            ends = [(place[0] + r * math.cos(turn), place[1] + r * math.sin(turn)) for r in (11.0, LAMP_MM)]
            self.line(ends, INK if is_on else _LAMP_OFF, 2.0)
        self.disc(place, 8.0, colour, outline=INK, width=self.pixels(1.2))

    def body(self, body: Any) -> None:
        """Draw a ball with a glint, or a cylinder with its rim, by its record of `kiks.engine.state.BODY`."""
        place, radius_mm = (float(body["x_mm"]), float(body["y_mm"])), float(body["radius_mm"])
        self.disc(place, radius_mm, tint(body), outline=INK, width=self.pixels(1.2))
        if body["what"] == BALL:
            self.disc((place[0] - radius_mm / 3, place[1] + radius_mm / 3), radius_mm / 4, (*WHITE, 170))
        else:
            self.disc(place, 0.62 * radius_mm, None, outline=(*WHITE, 110), width=self.pixels(1.2))

    def robot(self, pose: Sequence[float], body: Body, colour: Colour, name: str) -> None:
        """Draw a robot from above: stripes, two wheels, a nose that shows its heading, and its number."""
        x_mm, y_mm, heading = pose
        radius_mm = body.radius_mm
        ahead, aside = (math.cos(heading), math.sin(heading)), (-math.sin(heading), math.cos(heading))

        def at(forwards: float, sideways: float) -> Place:
            """Return the pixel of a place on the robot, in radii."""
            along_mm, across_mm = forwards * radius_mm, sideways * radius_mm
            x = x_mm + along_mm * ahead[0] + across_mm * aside[0]
            return self.point((x, y_mm + along_mm * ahead[1] + across_mm * aside[1]))

        self.disc((x_mm, y_mm), radius_mm, colour, outline=INK, width=self.pixels(1.0))
        if body.stripe_count:
            self.disc((x_mm, y_mm), radius_mm, BLACK)
            for begin, end in body.white_stripes_rad:
                angles_rad = np.linspace(begin, end, 2 + int((end - begin) / ROUND_RAD)).tolist()
                rim = [at(math.cos(angle), math.sin(angle)) for angle in angles_rad]
                self.pen.polygon([at(0.0, 0.0), *rim], fill=WHITE)
            self.disc((x_mm, y_mm), radius_mm - STRIPES_MM, colour)
        for side in (-1, 1):
            wheel = [at(0.35, 0.92 * side), at(0.35, 0.72 * side), at(-0.35, 0.72 * side), at(-0.35, 0.92 * side)]
            self.pen.polygon(wheel, fill=INK)
        self.pen.polygon([at(0.98, 0.0), at(0.5, 0.42), at(0.5, -0.42)], fill=WHITE)
        letters = font(max(radius_mm * self.scale * 0.72, 8.0))
        self.pen.text(at(-0.16, 0.0), name, fill=WHITE, font=letters, anchor="mm", stroke_width=1, stroke_fill=WHITE)
