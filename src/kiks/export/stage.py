"""A world from above, picture after picture, for films, ghosts and the pages of a room.

Walls, lamps and trails stay from picture to picture on a base, a picture of the whole arena. A picture is the part of
the base that the camera sees, with robots, balls and cylinders on it. Each of them is drawn on a patch of the picture,
as large as itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.export.caption import Caption, scale_bar
from kiks.export.looks import lit_leds
from kiks.export.sheet import (
    FINER,
    FLOOR,
    LAMP_MM,
    WHITE,
    Place,
    Sheet,
    ground_picture,
    mixed,
    path_colour,
    path_mm,
    pen_on,
)
from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec
from kiks.recording.moments import LEAP_MM, Moment
from kiks.sim.colours import body_colour

Pixels = NDArray[np.uint8]
"""A picture, [row, column, red or green or blue]."""

OUTSIDE = (228, 231, 236)

MARGIN = 0.02
"""Share of a side that is left free around an arena."""

BASE_PIXELS_MAX = 64 << 20
"""Most pixels of the whole arena."""

TRAIL_PIXELS, PIECE_PIXELS = 2.0, 4.0
"""Least width of a trail, and least length of the pieces by which it grows [pixels]."""

BODY_TRAIL_MM = 2.4
"""Width of the trail of a ball or cylinder [mm]."""


BAR_LETTER_SHARE, BAR_LETTER_MIN, BAR_SIDE_MIN = 0.022, 11.0, 200
"""Height of the letters beside the scale bar as a share of the picture's, the least [pixels], and the least side of a
picture with one [pixels]."""


class Canvas:
    """A picture on which things are drawn, in millimetres, as on a `Sheet`."""

    def __init__(self, pixels: Pixels, scale: float, left_mm: float, top_mm: float) -> None:
        self.pixels, self.scale, self.left_mm, self.top_mm = pixels, scale, left_mm, top_mm

    @contextmanager
    def patch(self, places: Sequence[Sequence[float]], margin_mm: float) -> Iterator[Sheet]:
        """Yield a sheet of the picture around places [mm] and a margin; what was drawn on it comes back."""
        from PIL import Image

        columns = [(x_mm - self.left_mm) * self.scale for x_mm, *_ in places]
        rows = [(self.top_mm - y_mm) * self.scale for _, y_mm, *_ in places]
        margin = margin_mm * self.scale + 2  # a line is at least a pixel wide
        height, width = self.pixels.shape[:2]
        # Of what lies outside, a pixel at the edge, on which it is not seen.
        left = min(max(math.floor(min(columns) - margin), 0), width - 1)
        top = min(max(math.floor(min(rows) - margin), 0), height - 1)
        right = min(max(math.ceil(max(columns) + margin), left + 1), width)
        bottom = min(max(math.ceil(max(rows) + margin), top + 1), height)
        part = self.pixels[top:bottom, left:right]
        image = Image.fromarray(part).resize((FINER * (right - left), FINER * (bottom - top)), Image.Resampling.NEAREST)
        yield Sheet(pen_on(image), FINER * self.scale, self.left_mm + left / self.scale, self.top_mm - top / self.scale)
        part[...] = np.asarray(image.reduce(FINER))

    def draw_things(
        self, bodies: Any, poses: NDArray[np.float64], specs: Sequence[RobotSpec], lit: Sequence[int] = ()
    ) -> None:
        """Draw balls and cylinders, records of `kiks.engine.state.BODY`, and robots at poses [robot, 3] with LEDs."""
        for body in bodies:
            with self.patch([(float(body["x_mm"]), float(body["y_mm"]))], float(body["radius_mm"])) as sheet:
                sheet.body(body)
        for index, (pose, spec) in enumerate(zip(poses.tolist(), specs, strict=False)):
            with self.patch([pose[:2]], spec.body.radius_mm) as sheet:
                sheet.robot(pose, spec, index, lit[index] if lit else 0)

    def seen_on(self, picture: Pixels, place: Sequence[float] | None = None) -> Canvas:
        """Draw what a camera over a place [mm] sees of it, or over its middle; return the canvas of the picture."""
        (rows, columns), (height, width) = self.pixels.shape[:2], picture.shape[:2]
        column, row = columns / 2, rows / 2
        if place is not None:
            column, row = (place[0] - self.left_mm) * self.scale, (self.top_mm - place[1]) * self.scale
        left, top = round(column - width / 2), round(row - height / 2)
        picture[...] = OUTSIDE
        seen = self.pixels[max(top, 0) : max(top + height, 0), max(left, 0) : max(left + width, 0)]
        down, right = max(-top, 0), max(-left, 0)
        picture[down : down + seen.shape[0], right : right + seen.shape[1]] = seen
        return Canvas(picture, self.scale, self.left_mm + left / self.scale, self.top_mm - top / self.scale)


def arena_canvas(arena: Arena, lamps: NDArray[np.float64], specs: Sequence[RobotSpec], scale: float) -> Canvas:
    """Return the floor of an arena with its light, walls and lamps.

    Args:
        arena: The arena.
        lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off, float64 [lamp, 4].
        specs: The robots; the light is drawn for the sensors of the first, or a Khepera's.
        scale: Pixels a millimetre.
    """
    size = max(round(arena.width_mm * scale), 1), max(round(arena.height_mm * scale), 1)
    if size[0] * size[1] > BASE_PIXELS_MAX:
        raise ParameterError(
            f"the whole arena must have at most {BASE_PIXELS_MAX} pixels, but it would have {size[0]} x {size[1]}. "
            "Zoom less, or make the film smaller."
        )
    canvas = Canvas(np.array(ground_picture(arena, lamps, specs, size)), scale, 0.0, arena.height_mm)
    for x_mm, y_mm, _, is_on in lamps.tolist():
        with canvas.patch([(x_mm, y_mm)], LAMP_MM) as sheet:
            sheet.lamp((x_mm, y_mm), is_on=bool(is_on))
    return canvas


class Ground:
    """The base: floor, walls, lamps and trails of the whole arena.

    Args:
        has_trails: Whether robots, balls and cylinders leave trails.

    Attributes:
        arena: What was drawn last; None before the first moment.
        canvas: The base.
    """

    def __init__(self, *, has_trails: bool) -> None:
        self.arena: Arena | None = None
        self.canvas = Canvas(np.zeros((1, 1, 3), np.uint8), 1.0, 0.0, 0.0)
        self._clean = self.canvas.pixels
        self._has_trails = has_trails
        self._lamps = b""
        self._ends: dict[tuple[str, int], Place] = {}

    def draw(self, moment: Moment, share: float, scale: float) -> None:
        """Bring it up to a moment.

        Args:
            moment: The moment, later than the one before it.
            share: How much of the film is over, 0 to 1.
            scale: Pixels a millimetre; it changes with the arena alone.
        """
        if moment.saved.arena is not self.arena or moment.saved.lamps.tobytes() != self._lamps:
            self._draw_still(moment, scale)
        if self._has_trails:
            self._leave_trails(moment, share)

    def _draw_still(self, moment: Moment, scale: float) -> None:
        """Draw walls, light and lamps; trails stay where they are."""
        arena, lamps = moment.saved.arena, moment.saved.lamps
        clean = arena_canvas(arena, lamps, moment.saved.specs, scale)
        pixels = clean.pixels.copy()
        if self.arena is not None and self._clean.shape == pixels.shape:
            is_trail = (self.canvas.pixels != self._clean).any(axis=-1)
            pixels[is_trail] = self.canvas.pixels[is_trail]
        self.canvas, self._clean = Canvas(pixels, scale, 0.0, arena.height_mm), clean.pixels
        self.arena, self._lamps = arena, lamps.tobytes()

    def _leave_trails(self, moment: Moment, share: float) -> None:
        """Let trails grow to where robots, balls and cylinders are."""
        lines: dict[tuple[str, int], list[Place]] = {}
        least_mm = PIECE_PIXELS / self.canvas.scale
        ticks = [(tick.poses, tick.bodies, tick.places) for tick in moment.passed] or [
            (moment.poses, moment.bodies, np.column_stack([moment.bodies["x_mm"], moment.bodies["y_mm"]]))
        ]
        for poses, bodies, places in ticks:
            things = [("robot", index, pose) for index, pose in enumerate(poses.tolist())]
            things += [("body", *thing) for thing in zip(bodies["number"].tolist(), places.tolist(), strict=True)]
            for what, number, (x_mm, y_mm, *_) in things:
                key, place = (what, number), (x_mm, y_mm)
                way_mm = math.dist(self._ends.setdefault(key, place), place)
                if way_mm > LEAP_MM + least_mm:
                    self._ends[key] = place
                elif way_mm > least_mm:
                    lines.setdefault(key, [self._ends[key]]).append(place)
                    self._ends[key] = place
        tints = {int(body["number"]): body_colour(body) for body in moment.bodies}
        for (what, number), line in lines.items():
            if what == "robot":
                colour, width_mm = path_colour(number, len(moment.poses), share), path_mm(len(moment.poses))
            else:
                colour, width_mm = (*tints.get(number, FLOOR), 200), BODY_TRAIL_MM
            width_mm = max(width_mm, TRAIL_PIXELS / self.canvas.scale)
            with self.canvas.patch(line, width_mm) as sheet:
                # Opaque, for where two pieces meet, no darker spot must arise.
                sheet.line(line, mixed(FLOOR, colour[:3], colour[3] / 255), width_mm)


class Stage:
    """Draws the world of a film.

    Args:
        size: Width and height of the pictures.
        follow: Index of the robot that stays in the middle; None: the whole arena is seen.
        zoom: Magnification; 1 fits the whole arena.
        has_trails: Whether robots, balls and cylinders leave trails.
    """

    def __init__(self, size: tuple[int, int], *, follow: int | None, zoom: float, has_trails: bool) -> None:
        self._size, self._follow, self._zoom = size, follow, zoom
        self._ground = Ground(has_trails=has_trails)
        self._bar, self._bar_scale = np.zeros((0, 0, 3), np.uint8), 0.0
        self._has_bar = has_trails and min(size) >= BAR_SIDE_MIN

    def draw(self, moment: Moment, share: float, picture: Pixels) -> None:
        """Draw a moment.

        Args:
            moment: The moment, later than the one before it.
            share: How much of the film is over, 0 to 1.
            picture: Where it is drawn, of the size of the stage.
        """
        arena, (width, height) = moment.saved.arena, self._size
        whole = min(width / arena.width_mm, height / arena.height_mm)
        self._ground.draw(moment, share, (1 - 2 * MARGIN) * whole * self._zoom)
        place = None
        if self._follow is not None and self._follow < len(moment.poses):
            place = moment.poses[self._follow].tolist()
        view = self._ground.canvas.seen_on(picture, place)
        specs = moment.saved.specs
        view.draw_things(moment.bodies, moment.poses, specs, lit_leds(specs, moment.robots).tolist())
        if self._has_bar:
            if self._bar_scale != view.scale:
                self._bar, self._bar_scale = self._scale_picture(view.scale), view.scale
            rows, columns = self._bar.shape[:2]
            picture[-rows:, -columns:] = self._bar

    def _scale_picture(self, scale: float) -> Pixels:
        """Return what says how long a millimetre is, for the lower right corner."""
        from PIL import Image

        letter = max(BAR_LETTER_SHARE * self._size[1], BAR_LETTER_MIN) * FINER
        sign = scale_bar(self._size[0] / scale, letter / (FINER * scale))
        caption = Caption("", [sign], math.inf, pen_on(Image.new("RGB", (1, 1))).textlength, letter)
        image = Image.new("RGB", (math.ceil(caption.right), caption.height), WHITE)
        caption.draw(Sheet(pen_on(image), 1.0, 0.0, 0.0))
        return np.asarray(image.reduce(FINER))
