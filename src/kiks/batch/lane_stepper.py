"""The stepper for worlds with one robot and nothing else that moves: eight worlds at once, one per lane.

`kiks.batch.stepper_dispatch` documents these functions. A bunch holds the records of eight robots, their constants for
moving and for sensing, the numbers of their kinds, the seeds of their worlds, and a buffer of one number per lane.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.batch.kernel_args import PROXIMITY
from kiks.batch.world_stepper import scene_of
from kiks.engine.compiling import kernel
from kiks.engine.physics.motor import command_speed
from kiks.engine.sensing.ambient import read_ambient
from kiks.engine.sensing.lane_readings import EIGHT_SENSES, read_eight
from kiks.engine.simd.f64x8 import LANES, load
from kiks.engine.simd.records import EIGHT, EIGHT_KINDS, load_lane, one_of, open_record8, store_lane
from kiks.engine.simd.u64x8 import load_words
from kiks.engine.step import advance_eight
from kiks.units import TICK_NS


@kernel
def take(place: Any, worlds: Any, numbers: Any) -> Any:
    """Copy the robots of eight worlds into lanes."""
    robots, _, kinds, _ = worlds.scene
    eight, constants, senses = np.empty(1, EIGHT), np.empty(1, EIGHT_KINDS), np.empty(1, EIGHT_SENSES)
    kind_numbers, seeds, buffer = np.empty(LANES, np.int64), np.empty(LANES, np.int64), np.empty(LANES)
    for k in range(LANES):
        robot = robots[numbers[k], 0]
        kind_numbers[k], seeds[k] = robot.kind, worlds.seeds[numbers[k]]
        load_lane(eight[0], k, robot)
        load_lane(constants[0], k, kinds[kind_numbers[k]])
        load_lane(senses[0], k, kinds[kind_numbers[k]])
        eight[0].tick_count[k] = worlds.ticks[numbers[k]]
    return numbers, eight, constants, senses, kind_numbers, seeds, buffer


@kernel
def give_back(place: Any, worlds: Any, bunch: Any) -> Any:
    """Copy the robots back."""
    numbers, eight = bunch[0], bunch[1]
    # Backwards: padding repeats the last world, so the first of its lanes, which took part, is written last.
    for k in range(LANES - 1, -1, -1):
        store_lane(eight[0], k, worlds.scene[0][numbers[k], 0])
        worlds.ticks[numbers[k]] = np.int64(eight[0].tick_count[k])


@kernel
def pass_to(place: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    """Do the ticks that have begun before the time of each world."""
    _, eight, constants, _, _, seeds, buffer = bunch
    for k in range(LANES):
        buffer[k] = -(-times_ns[k] // TICK_NS)
    advance_eight(open_record8(eight[0]), open_record8(constants[0]), place.ground, load_words(seeds), load(buffer))


@kernel
def read(place: Any, worlds: Any, bunch: Any, code: Any, times_ns: Any, robot: Any, counts: Any) -> Any:
    """Read a sense of the eight robots."""
    numbers, eight, _, senses, kind_numbers, seeds, buffer = bunch
    if code == PROXIMITY:
        for k in range(LANES):
            buffer[k] = times_ns[k]
        eights = open_record8(eight[0]), open_record8(senses[0])
        kinds, networks = worlds.scene[2], place.networks
        read_eight(*eights, kind_numbers, kinds, place.sight, networks, load(buffer), load_words(seeds), counts)
        return
    for k in range(LANES):
        world = numbers[k]
        scene = scene_of(worlds, world)
        store_lane(eight[0], k, scene[0][0, 0])
        tick = np.int64(eight[0].tick_count[k])
        read_ambient(scene, place.sight, worlds.lamps[world], tick, times_ns[k], seeds[k], 0, True, counts[k])


@kernel
def command(place: Any, bunch: Any, k: Any, robot: Any, left: Any, right: Any) -> Any:
    """Set the speeds of a robot."""
    command_speed(one_of(open_record8(bunch[1][0]), k), left, right)


@kernel
def show(place: Any, worlds: Any, bunch: Any, k: Any, robot: Any, state: Any) -> Any:
    """Write the present and past poses of a robot."""
    numbers, eight = bunch[0], bunch[1]
    one, record = one_of(open_record8(eight[0]), k), worlds.scene[0][numbers[k], 0]
    state[0], state[1], state[2] = one.x_mm, one.y_mm, one.heading_rad
    state[3], state[4] = record.start_x_mm, record.start_y_mm
    state[5] = one.forwards_mm + one.backwards_mm
    state[6], state[7] = one.contact_count, one.is_touching
