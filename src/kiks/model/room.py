"""Random rooms with walls, pillars and lamps, for training where no two generations need be alike.

Every place of a room can be reached: each wall either begins at the frame or stands free, and keeps `GAP_MM` from all
else, where the frame counts from its outer edge. The same seed gives the same room on every computer: all lengths are
whole millimetres, and no function of an angle is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, pairwise, repeat, takewhile
from typing import Any

import numpy as np
import numpy.typing as npt

from kiks.errors import ParameterError
from kiks.model.arena_objects import Lamp
from kiks.model.checks import check_count
from kiks.model.maze import random_bits
from kiks.model.walls import Wall

GAP_MM = 120
"""Least distance between two things: a Khepera is 55 mm across, and passes with a gap of 30 mm on either side."""

SIDE_MIN_MM, SIDE_MAX_MM = 500, 3000
"""Shortest and longest side of a room."""

THINGS_MAX = 20
"""Most walls, pillars or lamps."""

BRIGHTNESS = (60, 100, 150, 190, 255)
"""The shades of walls and pillars, each as likely."""

_WALL_MM = 10
_SHORTEST_MM, _REACH_MM = 200, 550
_BEND_MM = (150, 350)
_PILLAR_MM = (20, 70)
_LAMP_POWER_W, _LAMP_MM = 25.0, 40
_ATTEMPTS, _ROOMS = 200, 30
"""How often a place is drawn for a thing before the room counts as full, and how many rooms are tried."""

Points = npt.NDArray[np.float64]


def draw_room(
    width_mm: int, height_mm: int, walls: int, pillars: int, lamps: int, seed: int
) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Return the walls, with the pillars, and the lamps of a room. See `Arena.room`."""
    for name, side_mm in (("width_mm", width_mm), ("height_mm", height_mm)):
        check_count(name, side_mm, SIDE_MIN_MM, SIDE_MAX_MM, "Rooms are drawn in whole millimetres.")
    for name, number in (("walls", walls), ("pillars", pillars), ("lamps", lamps)):
        check_count(name, number, 0, THINGS_MAX)
    check_count("seed", seed, 0, 2**63 - 1, "Any small number will do.")
    draws = count()
    for _ in range(_ROOMS):
        room = _Room(width_mm, height_mm, seed, draws)
        makes = (*repeat(room.lamp, lamps), *repeat(room.wall, walls), *repeat(room.pillar, pillars))
        things = tuple(takewhile(lambda thing: thing is not None, (make() for make in makes)))
        if len(things) == len(makes):
            return things[lamps:], things[:lamps]
    raise ParameterError(
        f"a room must have space for its things, but {_ROOMS} rooms of {width_mm} x {height_mm} mm were full before "
        f"they had {walls} walls, {pillars} pillars and {lamps} lamps. Take fewer, or a larger room."
    )


class _Room:
    """A room that fills with things."""

    def __init__(self, width_mm: int, height_mm: int, seed: int, draws: Iterator[int]) -> None:
        self._sides_mm, self._seed, self._draws = (width_mm, height_mm), seed, draws
        self._things: list[tuple[Points, float]] = []  # points at most 10 mm apart, and how far it reaches around them

    def _between(self, least: int, most: int) -> int:
        """Return a random whole number of a range, its ends included."""
        return least + random_bits(self._seed, next(self._draws)) % (most - least + 1)

    def _place(self, margin_mm: int) -> tuple[int, int]:
        x_mm, y_mm = (self._between(margin_mm, side_mm - margin_mm) for side_mm in self._sides_mm)
        return x_mm, y_mm

    def wall(self) -> Wall | None:
        """Add a wall, unless the room is full: one that begins at the frame, a straight one, or one with a corner."""
        for _ in range(_ATTEMPTS):
            bends = self._between(0, 2)
            along = tuple(self._between(-_REACH_MM, _REACH_MM) for _ in range(2))
            length_mm2 = along[0] ** 2 + along[1] ** 2
            begin = self._place(GAP_MM)
            if bends == 0:
                begin, along = self._from_frame(begin, along)
            points = [begin, (begin[0] + along[0], begin[1] + along[1])]
            if bends == 2:
                part = self._between(*_BEND_MM) / _REACH_MM * (2 * self._between(0, 1) - 1)
                x_mm, y_mm = points[1]
                points.append((x_mm - round(part * along[1]), y_mm + round(part * along[0])))
            is_long = _SHORTEST_MM**2 <= length_mm2 <= _REACH_MM**2
            if is_long and self._add(points, _WALL_MM / 2, free=points[bends == 0 :]):
                return Wall(line_mm=tuple(points), width_mm=_WALL_MM, brightness=self._shade())
        return None

    def _from_frame(self, place: tuple[int, int], along: tuple[int, ...]) -> tuple[tuple[int, int], tuple[int, int]]:
        """Return a place moved to a side of the frame, and a way that leads from there into the room."""
        axis, is_far = divmod(self._between(0, 3), 2)
        begin, into = list(place), [each // 2 for each in along]
        begin[axis] = self._sides_mm[axis] if is_far else 0
        into[axis] = -abs(along[axis]) if is_far else abs(along[axis])
        return (begin[0], begin[1]), (into[0], into[1])

    def pillar(self) -> Wall | None:
        """Add a round pillar, unless the room is full."""
        for _ in range(_ATTEMPTS):
            radius_mm = self._between(*_PILLAR_MM)
            place = self._place(GAP_MM)
            if self._add([place], radius_mm, free=[place]):
                return Wall(disc_mm=place, radius_mm=radius_mm, brightness=self._shade())
        return None

    def lamp(self) -> Lamp | None:
        """Add a lamp, unless the room is full."""
        for _ in range(_ATTEMPTS):
            place = self._place(GAP_MM)
            if self._add([place], _LAMP_MM, free=[place]):
                return Lamp(*place, _LAMP_POWER_W)
        return None

    def _shade(self) -> int:
        return BRIGHTNESS[self._between(0, len(BRIGHTNESS) - 1)]

    def _add(self, corners: list[tuple[int, int]], reach_mm: float, *, free: list[tuple[int, int]]) -> bool:
        """Add a thing if it keeps its distance from all others, and its free corners from the frame."""
        margin_mm = GAP_MM + reach_mm
        for x_mm, y_mm in free:
            for place_mm, side_mm in zip((x_mm, y_mm), self._sides_mm, strict=True):
                if not margin_mm <= place_mm <= side_mm - margin_mm:
                    return False
        points = np.array(list(_points(corners)), np.float64)
        for others, their_mm in self._things:
            away_mm2 = ((points[:, None] - others) ** 2).sum(axis=2).min()
            if away_mm2 < (margin_mm + their_mm) ** 2:
                return False
        self._things.append((points, reach_mm))
        return True


def _points(corners: list[tuple[int, int]]) -> Iterator[tuple[float, float]]:
    """Yield points along a line, at most 10 mm apart."""
    yield corners[0]
    for (x_mm, y_mm), (to_x_mm, to_y_mm) in pairwise(corners):
        across_mm, up_mm = to_x_mm - x_mm, to_y_mm - y_mm
        steps = (abs(across_mm) + abs(up_mm)) // 10 + 1
        for step in range(1, steps + 1):
            yield x_mm + across_mm * step / steps, y_mm + up_mm * step / steps
