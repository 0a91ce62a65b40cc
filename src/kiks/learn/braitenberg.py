"""Braitenberg vehicles with the weights that others shipped, and the four vehicles of his book, as champions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kiks.control import controllers
from kiks.control.controller import Controller
from kiks.learn.champion import Champion
from kiks.model.checks import check_choice


class _Vehicle(NamedTuple):
    """A vehicle: wheel = bias + sum of weight times reading, as shares of a speed limit.

    Attributes:
        bias: Of both wheels.
        left: Weights of the left wheel, for readings as shares of the largest, sensor by sensor.
        right: Weights of the right wheel.
        sense: Its sense.
        speed_limit: Speed of an output of 1 [pulses/10 ms].
    """

    bias: float
    left: tuple[float, ...]
    right: tuple[float, ...]
    sense: str
    speed_limit: float

    @property
    def controller(self) -> Controller:
        return controllers.linear(senses=(self.sense,), speed_limit=self.speed_limit)

    @property
    def parameters(self) -> tuple[float, ...]:
        weights: list[float] = np.column_stack([self.left, self.right]).ravel().tolist()
        return (self.bias, self.bias, *weights)


def _scaled(weights: Sequence[float], scale: float) -> tuple[float, ...]:
    return tuple(scale * weight for weight in weights)


def _of_k_team() -> _Vehicle:
    """kBraitenberg.m of K-Team's kMatlab, August 1998: (sum of weight x reading / 400 + 20) x 0.7 units."""
    limit, scale = 127.0, 0.7 * 1023.0 / 400.0 / 127.0
    left, right = (4, 4, 6, -18, -15, -5, 5, 3), (-5, -15, -18, 6, 4, 4, 3, 5)
    return _Vehicle(0.7 * 20.0 / limit, _scaled(left, scale), _scaled(right, scale), "proximity", limit)


def _of_webots() -> _Vehicle:
    """braitenberg.c of Webots: sum of weight x (1 - reading / 512), cut to +-1 rad/s of a wheel of 7.5 mm.

    That is 7.5 mm/s, less than the smallest speed on the wire: all speeds are `WEBOTS_FASTER` times as high here.
    """
    left, right = (-2, -3, -7, 7, 5, 4, -0.5, -0.5), (4, 5, 7, -6, -4, -2, -0.5, -0.5)
    scale = -1023.0 / 512.0
    limit = WEBOTS_FASTER * 7.5 / 8.0
    return _Vehicle(float(sum(left)), _scaled(left, scale), _scaled(right, scale), "proximity", limit)


def _of_book(rest: float, same: float, other: float) -> _Vehicle:
    """V. Braitenberg, Vehicles, 1984: a wheel's speed at rest, and what light on its own and the other side adds.

    The book has no numbers: these are our own.
    """
    left = (same,) * 3 + (other,) * 3 + (0.0, 0.0)
    right = (other,) * 3 + (same,) * 3 + (0.0, 0.0)
    return _Vehicle(rest, left, right, "ambient", 10.0)


WEBOTS_FASTER = 8.0
"""By what the speeds of Webots are multiplied."""

VEHICLES = {
    "k-team": _of_k_team(),
    "webots": _of_webots(),
    "2a": _of_book(0.08, 0.4, 0.0),
    "2b": _of_book(0.08, 0.0, 0.4),
    "3a": _of_book(0.7, -0.4, 0.0),
    "3b": _of_book(0.7, 0.0, -0.4),
}
"""The vehicles by their names."""


def vehicle(name: str) -> Champion:
    """Return a vehicle as a champion, which can drive, be saved and be shown.

    Args:
        name: 'k-team' or 'webots', which avoid things; '2a', '2b', '3a' or '3b' of the book, for lamps.

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
        >>> _ = vehicle("k-team").drive(sim.port(1), seconds=2)
        >>> round(sim.travelled_mm(1))
        210
    """
    check_choice("name", name, VEHICLES, f"one of {', '.join(VEHICLES)}")
    found = VEHICLES[name]
    return Champion(found.controller, found.parameters, task=f"vehicle {name}")
