"""What `kiks.batch.lane_stepper` does with eight worlds of lone robots, called from Python for any number of them."""

from __future__ import annotations

import numpy as np

from kiks.batch.kernel_args import LonePlace, Worlds
from kiks.batch.lane_stepper import give_back, pass_to, read, take
from kiks.engine.compiling import entry
from kiks.engine.simd.f64x8 import LANES


@entry
def pass_and_read(place, worlds, numbers, times_ns, code, counts):
    """Let time pass up to a time of each world, and let the robots read a sense then."""
    for first in range(0, numbers.shape[0], LANES):
        they = slice(first, first + LANES)
        bunch = take(place, worlds, numbers[they])
        pass_to(place, worlds, bunch, times_ns[they])
        read(place, worlds, bunch, code, times_ns[they], 0, counts[they])
        give_back(place, worlds, bunch)


def read_after(scene, ground, sight, networks, lamps, seeds, ticks, times_ns, code):
    """Return what the robots of all worlds of a scene read at times of their own; `ticks` are those done before."""
    world_count = len(ticks)
    order = np.minimum(np.arange(-(-world_count // LANES) * LANES), world_count - 1)
    nothing, none = np.zeros((world_count, 1, 0)), np.zeros(world_count, np.int64)
    worlds = Worlds(scene, lamps, seeds, ticks.copy(), *[none] * 4, *[nothing] * 5)
    place = LonePlace(ground, sight, networks, None, np.zeros(1, np.int64))
    counts = np.empty((len(order), 8), np.int64)
    pass_and_read(place, worlds, order, times_ns[order], code, counts)
    return counts[:world_count]
