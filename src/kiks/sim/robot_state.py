"""What is to be known of a robot at an instant, for a person who has stopped its program: looking changes nothing."""

from __future__ import annotations

import math
from typing import Any

from kiks.engine.physics.motor import wheel_speeds
from kiks.sim.event_loop import EventLoop
from kiks.sim.sensors import readings

SENSES = ("proximity", "ambient", "positions")


def state_of(loop: EventLoop, robot: int) -> tuple[Any, ...]:
    """Return time [ns], pose [mm, mm, deg], what its senses would read without noise, and what its line holds.

    Args:
        loop: The event loop of its world.
        robot: Its number.
    """
    with loop.lock:
        loop.catch_up()
        world, wire = loop.world, loop.wires[robot - 1]
        x_mm, y_mm, heading_rad = world.pose(robot - 1)
        senses = [
            tuple(round(value) for value in readings(world, robot - 1, sense, is_noisy=False)) for sense in SENSES
        ]
        record, motor = world.state.robots[0, [robot - 1]], world.specs[robot - 1].motor
        senses.append(tuple(map(int, wheel_speeds(record, [motor])[0])))
        to_robot = b"".join(line for _, line, on_reply in wire.pending if on_reply is None)
        heading_deg = math.degrees(heading_rad) % 360
        return (world.now_ns, x_mm, y_mm, heading_deg, *senses, to_robot, bytes(wire.line.waiting))
