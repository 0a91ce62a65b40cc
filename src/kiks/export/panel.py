"""What stands beside the world in a film: the clock, and what a robot reads and how fast its wheels are."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

import numpy as np

from kiks.engine.physics.motor import wheel_speeds
from kiks.export.sheet import INK, font, mixed, text_font
from kiks.export.stage import Pixels
from kiks.firmware.robot_kind import robot_kind
from kiks.model.robot import SENSOR_COUNT
from kiks.recording.moments import Moment
from kiks.sim.colours import Colour, robot_colour
from kiks.units import s_from_ns

WIDTH, HEIGHT, LEAST_SCALE = 250.0, 500.0, 0.7
"""Size of the panel in units: a unit is a pixel of a film of 1280 x 720, and no less than this share of a pixel."""

SHARE_MAX = 0.4
"""Most of a film's width that the panel takes."""

_PAPER, _FAINT, _TRACK = (250, 250, 248), (110, 116, 124), (228, 230, 232)
_FAR, _NEAR = (66, 135, 245), (220, 60, 60)
_LEFT, _RIGHT = 20.0, 230.0
_BARS_TOP, _BARS_BOTTOM = 200.0, 340.0
_WHEELS = (424.0, 454.0)
_SPEED_LEAST = 10
_TITLE_LINE, _TITLE_CHARACTERS = 20.0, 28


class FilmPanel:
    """Draws the panel.

    Args:
        size: Width and height of the film.
        robot: Index of the robot whose readings are shown.
        speed: Simulated seconds per second of the film.
        title: What ran, for the bottom.

    Attributes:
        width: Pixels of its width; 0 where there is no room for it.
    """

    def __init__(self, size: tuple[int, int], *, robot: int, speed: float, title: str) -> None:
        from PIL import Image, ImageDraw

        self._robot = robot
        self._scale = max(min(size[0] / 1280, size[1] / 720), LEAST_SCALE)
        width = round(WIDTH * self._scale)
        self.width = width if width <= SHARE_MAX * size[0] and size[1] >= HEIGHT * self._scale else 0
        self._speed_most = 0.0
        self._paper = Image.new("RGB", (width, size[1]), _PAPER)
        self._pen = ImageDraw.Draw(self._paper)
        self._draw_words(speed)
        self._draw_title(title, size[1] / self._scale)

    def draw(self, moment: Moment, picture: Pixels) -> None:
        """Draw it for a moment, on the right side of the picture; the clock alone if there is no room."""
        from PIL import ImageDraw

        time = f"{s_from_ns(moment.time_ns):.1f} s"
        if not self.width:
            draw_sign(picture, time, self._scale)
            return
        image = self._paper.copy()
        self._pen = ImageDraw.Draw(image)
        self._text(_LEFT, 46, time, 42)
        if self._robot < min(len(moment.poses), len(moment.saved.specs)):
            self._box(_LEFT, 122, _LEFT + 18, 140, robot_colour(self._robot))
            spec, robot = moment.saved.specs[self._robot], moment.robots[[self._robot]]
            kind = robot_kind(spec.kind)
            self._draw_counts(moment.readings.get(self._robot, ()), kind.counts_max)
            self._text(_LEFT, 396, f"speed [{spec.motor.speed_unit}]", 15, _FAINT)
            speeds = wheel_speeds(robot, [spec.motor])[0].astype(int).tolist()
            self._speed_most = max(self._speed_most, _SPEED_LEAST * kind.speed_scale)
            while max(map(abs, speeds)) > self._speed_most:
                self._speed_most *= 2
            for row, speed in zip(_WHEELS, speeds, strict=True):
                self._draw_speed(row, speed)
        picture[:, -self.width :] = np.asarray(image)

    def _draw_words(self, speed: float) -> None:
        """Draw what is the same in all pictures."""
        if speed != 1:
            self._text(_LEFT, 84, f"{speed:g} x real time", 16, _FAINT)
        self._text(_LEFT + 28, 131, f"robot {self._robot + 1}", 22)
        self._text(_LEFT, 172, "proximity", 15, _FAINT)
        for sensor in range(SENSOR_COUNT):
            left, right = _bar(sensor)
            self._box(left, _BARS_TOP, right, _BARS_BOTTOM, _TRACK)
            self._text((left + right) / 2, _BARS_BOTTOM + 12, str(sensor), 13, _FAINT, "mm")
        for row, name in zip(_WHEELS, ("left", "right"), strict=True):
            self._text(_LEFT, row, name, 15)

    def _draw_title(self, title: str, height: float) -> None:
        """Draw what ran at the bottom, as far as there is room."""
        room = int((height - HEIGHT - _TITLE_LINE) / _TITLE_LINE)
        lines = wrap(title, _TITLE_CHARACTERS)[: max(room, 0)]
        for number, line in enumerate(reversed(lines)):
            at = (round(_LEFT * self._scale), round((height - (number + 1) * _TITLE_LINE) * self._scale))
            self._pen.text(at, line, fill=_FAINT, font=text_font(14 * self._scale), anchor="lm")

    def _draw_counts(self, counts: Sequence[int], most: int) -> None:
        """Draw a bar for each proximity sensor."""
        for sensor, count in enumerate(counts):
            left, right = _bar(sensor)
            share = min(count / most, 1.0)
            top = _BARS_BOTTOM - share * (_BARS_BOTTOM - _BARS_TOP)
            self._box(left, top, right, _BARS_BOTTOM, mixed(_FAR, _NEAR, share))
            self._text((left + right) / 2, _BARS_TOP - 9, str(count), 11, INK, "mm")

    def _draw_speed(self, y: float, speed: int) -> None:
        """Draw the speed of a wheel: a bar to the right of the middle if it turns ahead, else to the left."""
        left, right = _LEFT + 46, _RIGHT - 34
        middle, half = (left + right) / 2, (right - left) / 2
        end = middle + half * speed / self._speed_most
        self._box(left, y - 9, right, y + 9, _TRACK)
        self._box(min(middle, end), y - 9, max(middle, end), y + 9, mixed(_FAR, _NEAR, float(speed < 0)))
        self._box(middle - 0.5, y - 11, middle + 0.5, y + 11, _FAINT)
        self._text(_RIGHT, y, str(speed), 15, INK, "rm")

    def _box(self, left: float, top: float, right: float, bottom: float, colour: Colour) -> None:
        corners = [round(edge * self._scale) for edge in (left, top, right, bottom)]
        if corners[0] < corners[2] and corners[1] < corners[3]:
            self._pen.rectangle((corners[0], corners[1], corners[2] - 1, corners[3] - 1), fill=colour)

    def _text(self, x: float, y: float, text: str, size: float, colour: Colour = INK, anchor: str = "lm") -> None:
        at = (round(x * self._scale), round(y * self._scale))
        self._pen.text(at, text, fill=colour, font=font(size * self._scale), anchor=anchor)


def _bar(sensor: int) -> tuple[float, float]:
    """Return left and right side of the bar of a sensor."""
    step = (_RIGHT - _LEFT) / SENSOR_COUNT
    return _LEFT + sensor * step + 2, _LEFT + (sensor + 1) * step - 2


def draw_sign(picture: Pixels, text: str, scale: float) -> None:
    """Draw a line, such as the time, into the lower left corner of a picture."""
    from PIL import Image, ImageDraw

    letters = font(18 * scale)
    _, _, right, bottom = letters.getbbox(text)
    height, width = min(round(bottom) + 6, picture.shape[0]), min(round(right) + 10, picture.shape[1])
    image = Image.new("RGB", (width, height), _PAPER)
    ImageDraw.Draw(image).text((5, height / 2), text, fill=INK, font=letters, anchor="lm")
    picture[-height:, :width] = np.asarray(image)
