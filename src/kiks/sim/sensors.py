"""What the senses of the robots in a world read: those of controllers, which in a batch are the same functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control.senses import SENSES, look
from kiks.errors import ParameterError, shown
from kiks.sim.world import World


class Sensors:
    """Reads the senses of `SENSES` that need no turret; the ticks that have begun are done."""

    def __init__(self, world: World) -> None:
        self._world = world
        # Where each sense is called, and its readings: both are found once, for a program reads thousands of times.
        self._known: dict[str, tuple[int, NDArray[np.float64]]] = {}

    def counts(self, index: int, name: str) -> list[int]:
        """Return what a robot reads by a sense now, in whole numbers."""
        counts: list[int] = self._read(index, name, is_noisy=True).astype(np.int64).tolist()
        return counts

    def readings(self, index: int, name: str, is_noisy: bool) -> list[float]:
        """Return what a robot reads by a sense now: counts with noise, or what is expected without it."""
        if not isinstance(is_noisy, bool):
            raise ParameterError(f"noise must be True or False, but it was {shown(is_noisy)}.")
        readings: list[float] = self._read(index, name, is_noisy).tolist()
        return readings

    def _read(self, index: int, name: str, is_noisy: bool) -> NDArray[Any]:
        if name not in self._known:
            self._known[name] = SENSES[name].address, np.zeros(SENSES[name].size)
        world, (address, out) = self._world, self._known[name]
        look(address, world.scene, index, world.state.tick_count, world.now_ns, is_noisy, 0, out)
        return out
