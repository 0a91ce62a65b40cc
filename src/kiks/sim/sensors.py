"""Readings of the proximity and light sensors of the robots in a world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from kiks.engine.sensing import ambient, proximity
from kiks.errors import ParameterError, shown
from kiks.model.robot import SENSOR_COUNT
from kiks.sim.world import World


class Sensors:
    """Reads sensors by the engine's kernels; the ticks that have begun are done."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._readings = np.zeros(SENSOR_COUNT, np.float64)

    def proximity(self, index: int, is_noisy: bool = True) -> list[Any]:
        """Return what a robot's proximity sensors read now: counts with noise, or what is expected without it."""
        return self._read(proximity.read_proximity, index, is_noisy)

    def ambient(self, index: int, is_noisy: bool = True) -> list[Any]:
        """Return what a robot's light sensors read now: counts with noise, or what is expected without it."""
        return self._read(ambient.read_ambient, index, is_noisy)

    def _read(self, kernel: Callable[..., Any], index: int, is_noisy: bool) -> list[Any]:
        if not isinstance(is_noisy, bool):
            raise ParameterError(f"noise must be True or False, but it was {shown(is_noisy)}.")
        world, out = self._world, self._readings
        kernel(world.scene, index, world.state.tick_count, world.now_ns, is_noisy, out)
        # One type of array serves both, for a kernel is compiled for each type that it is given.
        return (out.astype(np.int64) if is_noisy else out).tolist()
