"""The stepper for worlds in which things may collide: one world at a time.

`kiks.batch.stepper_dispatch` documents these functions. A bunch is one world: its scene and its index.
"""

from __future__ import annotations

from typing import Any

from kiks.batch.kernel_args import PROXIMITY
from kiks.engine.compiling import kernel
from kiks.engine.physics.motor import command_speed
from kiks.engine.sensing.ambient import read_ambient
from kiks.engine.sensing.proximity import read_proximity
from kiks.engine.step import advance
from kiks.units import TICK_NS


@kernel
def scene_of(worlds: Any, world: Any) -> Any:
    """Return the scene of one world, which is world 0 in it, as in a `kiks.Simulation`."""
    robots, bodies, kinds, (begins, entries, spots, widest) = worlds.scene
    end = world + 1
    return (
        robots[world:end],
        bodies[world:end],
        kinds,
        (begins[world:end], entries[world:end], spots[world:end], widest),
    )


@kernel
def take(place: Any, worlds: Any, numbers: Any) -> Any:
    """Return the scene of a world, and its index."""
    return scene_of(worlds, numbers[0]), numbers[0]


@kernel
def give_back(place: Any, worlds: Any, bunch: Any) -> Any:
    """Do nothing: the scene is a view of the state."""


@kernel
def pass_to(place: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    """Do the ticks that have begun before a time."""
    scene, world = bunch
    ticks = -(-times_ns[0] // TICK_NS) - worlds.ticks[world]
    if ticks > 0:
        advance(scene, place.ground, worlds.seeds[world], worlds.ticks[world], ticks)
        worlds.ticks[world] += ticks


@kernel
def read(place: Any, worlds: Any, bunch: Any, code: Any, times_ns: Any, robot: Any, counts: Any) -> Any:
    """Read a sense of a robot."""
    scene, world = bunch
    tick, seed = worlds.ticks[world], worlds.seeds[world]
    if code == PROXIMITY:
        read_proximity(scene, place.sight, place.networks, tick, times_ns[0], seed, robot, True, counts[0])
    else:
        read_ambient(scene, place.sight, worlds.lamps[world], tick, times_ns[0], seed, robot, True, counts[0])


@kernel
def command(place: Any, bunch: Any, k: Any, robot: Any, left: Any, right: Any) -> Any:
    """Set the speeds of a robot."""
    command_speed(bunch[0][0][0, robot], left, right)


@kernel
def show(place: Any, worlds: Any, bunch: Any, k: Any, robot: Any, state: Any) -> Any:
    """Write the present and past poses of a robot."""
    record = bunch[0][0][0, robot]
    state[0], state[1], state[2] = record.x_mm, record.y_mm, record.heading_rad
    state[3], state[4] = record.start_x_mm, record.start_y_mm
    state[5] = record.forwards_mm + record.backwards_mm
    state[6], state[7] = record.contact_count, record.is_touching
