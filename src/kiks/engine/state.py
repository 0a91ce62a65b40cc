"""Everything that changes in a world: one record a robot, in an array [world, robot], so that a copy is a snapshot."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MODE_SPEED, MODE_POSITION, MODE_PWM = 0, 1, 2
"""Motor modes, numbered as command K reports them (khepera-protocol.md 4.12)."""

LEFT, RIGHT = 0, 1
"""Motor order of every command (khepera-protocol.md 4.1)."""

TRAIL_LENGTH = 3
"""Tick boundaries behind the present one whose poses are kept: a sensor reading is at most 20 ms old."""

PIXEL_COUNT = 64
"""Pixels in a row of the camera (khepera-protocol.md 10.3)."""

ROBOT = np.dtype(
    [
        # The body. The pose is that of the end of the last tick; `trail` holds the boundaries before it, newest first.
        ("x_mm", "f8"),
        ("y_mm", "f8"),
        ("heading_rad", "f8"),
        ("trail", "f8", (TRAIL_LENGTH, 3)),
        ("travelled_mm", "f8"),
        ("contact_count", "i8"),
        # The wheels [pulses]: the rim's path, and the path that slip has swallowed since the set-point was given.
        ("wheel_pulses", "f8", (2,)),
        ("slip_pulses", "f8", (2,)),
        ("motor_speed", "f8", (2,)),
        # The encoders, latched at the beginning of a tick: whole pulses, and what command G added to them.
        ("pulse_count", "i8", (2,)),
        ("slip_count", "i8", (2,)),
        ("counter_offset", "i8", (2,)),
        # The controllers.
        ("target_pulses", "i8", (2,)),
        ("trajectory_pulses", "f8", (2,)),
        ("trajectory_speed", "f8", (2,)),
        ("error_sum", "i8", (2,)),
        ("last_error", "i8", (2,)),
        ("measured_speed", "i4", (2,)),
        ("controlled_speed", "i4", (2,)),
        ("motor_mode", "i4", (2,)),
        ("speed_setpoint", "i4", (2,)),
        ("pwm_setpoint", "i4", (2,)),
        ("pwm", "i4", (2,)),
        ("on_target", "i4", (2,)),
        ("profile_speed", "i4", (2,)),
        ("profile_acceleration", "i4", (2,)),
        ("speed_gains", "i4", (3,)),
        ("position_gains", "i4", (3,)),
        # The rest of the robot.
        ("is_touching", "i4"),
        ("led", "u1", (2,)),
        ("bus", "u1", (64,)),
        ("reserved", "u1", (2,)),
        # The camera, where one is fitted: the code of its reading period, and its last picture.
        ("camera_period", "i4"),
        ("camera_light", "i4"),
        ("camera_taken_ns", "i8"),
        ("camera_pixels", "u1", (PIXEL_COUNT,)),
    ],
    align=True,
)


@dataclass
class State:
    """What changes: `robots`, an array of `ROBOT` with shape [world_count, robot_count], and the ticks done.

    Example:
        >>> state = State.empty(world_count=1, robot_count=2)
        >>> before = state.snapshot()
        >>> state.robots["x_mm"] += 1.0
        >>> state.hash() == before.hash()
        False
        >>> state.restore(before)
        >>> state.hash() == before.hash()
        True
    """

    robots: NDArray[np.void]
    tick_count: int = 0

    @staticmethod
    def empty(*, world_count: int, robot_count: int) -> State:
        """Return a state of zeros."""
        return State(np.zeros((world_count, robot_count), ROBOT))

    def snapshot(self) -> State:
        """Return a copy."""
        return State(self.robots.copy(), self.tick_count)

    def restore(self, snapshot: State) -> None:
        """Become equal to a snapshot, in place: views of the arrays stay valid."""
        self.robots[...] = snapshot.robots
        self.tick_count = snapshot.tick_count

    def hash(self) -> str:
        """Return the first 16 hexadecimal digits of the SHA-256 of every bit of the state."""
        return hashlib.sha256(self.tick_count.to_bytes(8, "little") + self.robots.tobytes()).hexdigest()[:16]
