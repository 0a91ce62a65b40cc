"""What the senses of the robots in a world read: those of controllers, which in a batch are the same functions."""

from __future__ import annotations

from kiks.control.senses import AnySense, sense_of
from kiks.errors import ParameterError, shown
from kiks.sim.world import World


def readings(world: World, index: int, sense: AnySense, is_noisy: bool) -> list[float]:
    """Return what a robot reads by a sense now, with noise, or what is expected without it; the ticks are done."""
    if not isinstance(is_noisy, bool):
        raise ParameterError(f"noise must be True or False, but it was {shown(is_noisy)}.")
    read = sense_of(sense).look(world.scene, index, world.state.tick_count, world.now_ns, is_noisy=is_noisy)
    values: list[float] = read.tolist()
    return values


def counts(world: World, index: int, sense: str) -> list[int]:
    """Return what a robot's firmware reads by a sense now, in whole numbers."""
    return [int(value) for value in readings(world, index, sense, True)]
