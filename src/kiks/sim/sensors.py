"""What the senses of the robots in a world read: those of controllers, which in a batch are the same functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control.senses import AnySense, sense_of
from kiks.errors import ParameterError, shown
from kiks.sim.world import World


def readings(world: World, index: int, sense: AnySense, is_noisy: bool) -> NDArray[Any]:
    """Return what a robot reads by a sense now, with noise, or what is expected without it; the ticks are done."""
    if not isinstance(is_noisy, bool):
        raise ParameterError(f"noise must be True or False, but it was {shown(is_noisy)}.")
    return sense_of(sense).look(world.scene, index, world.state.tick_count, world.now_ns, is_noisy=is_noisy)


def counts(world: World, index: int, sense: str) -> list[int]:
    """Return what a robot's firmware reads by a sense now, in whole numbers."""
    found: list[int] = readings(world, index, sense, True).astype(np.int64).tolist()
    return found
