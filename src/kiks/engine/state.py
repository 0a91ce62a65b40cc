"""The state of a world: a record for each robot, ball and cylinder, so a copy is a snapshot."""

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
"""Number of past tick boundaries whose poses are stored: a sensor reading is at most 20 ms old."""

PIXEL_COUNT = 64
"""Pixels in a row of the camera (khepera-protocol.md 10.3)."""

MEMORY_COUNT = 16
"""Numbers that the user-defined turrets on one robot share: enough for two to four turrets."""

REGISTER_BYTES = 128
"""Memory of a firmware for what no other field holds [bytes]."""

ROBOT = np.dtype(
    [
        # The body. The pose is that of the end of the last tick; `trail` holds the boundaries before it, newest first.
        ("x_mm", "f8"),
        ("y_mm", "f8"),
        ("heading_rad", "f8"),
        ("trail", "f8", (TRAIL_LENGTH, 3)),
        ("start_x_mm", "f8"),  # where the robot was put last
        ("start_y_mm", "f8"),
        ("forwards_mm", "f8"),  # the length of its path, as far as it drove ahead, and back
        ("backwards_mm", "f8"),
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
        # The rest of the robot: the index of its kind's constants, and what its user sees and sets.
        ("kind", "i8"),
        ("is_touching", "i4"),
        ("led", "u1", (2,)),
        ("bus", "u1", (64,)),
        ("reserved", "u1", (2,)),
        # What the extension bus brings in, byte by byte, and the free analogue inputs 3 to 5, all set from outside.
        ("bus_inputs", "u1", (64,)),
        ("analog_inputs", "i4", (3,)),
        ("has_gripper", "i4"),
        # The camera, where one is fitted: the code of its reading period, and its last picture.
        ("camera_period", "i4"),
        ("camera_light", "i4"),
        ("camera_taken_ns", "i8"),
        ("camera_pixels", "u1", (PIXEL_COUNT,)),
        # The gripper, where one is fitted (`kiks.engine.physics.gripper`).
        ("arm_target", "f8"),
        ("arm", "f8"),  # 255 down in front, 127 upright, 0 folded back
        ("jaws", "f8"),  # 200 open, 0 closed
        ("is_closing", "i4"),
        ("held_row", "i4"),  # place of the held body in `bodies`, from 1; 0 for none; found anew in each tick
        ("piece_headings", "f8", (2,)),  # where a piece of a motion began, and where the wheels turned to
        # The radio (`kiks.firmware.radio`): the message on its way, and the one that waits to be read.
        ("radio_starts_ns", "i8"),
        ("radio_ends_ns", "i8"),
        ("radio_ended_ns", "i8"),
        ("radio_attempt", "i4"),
        ("radio_has_failed", "i4"),
        ("radio_to", "i4"),
        ("radio_to_length", "i4"),
        ("radio_from", "i4"),
        ("radio_from_length", "i4"),
        ("radio_to_data", "u1", (16,)),
        ("radio_from_data", "u1", (16,)),
        # The battle turret (`kiks.firmware.battle`): energy at a time, and hits since they were last read.
        ("battle_energy", "f8"),
        ("battle_ns", "i8"),
        ("battle_hits", "i8"),
        # Memory of user-defined turrets.
        ("turret_memory", "f8", (MEMORY_COUNT,)),
        # What only some kinds of robots have. `State.hash` leaves these out while all are zero. First the memory of the
        # firmware: a kind lays a record of its own over it.
        ("registers", "u1", (REGISTER_BYTES,)),
        ("loudness", "f8"),  # of its own speaker, as a microphone hears it at 100 mm, until a time
        ("sound_ends_ns", "i8"),
    ],
    align=True,
)

_COMMON_BYTES: int = dict(ROBOT.fields or {})["registers"][1]

BALL, CYLINDER = 3, 4
"""Kinds of bodies, numbered as in the arenas of KiKS 2.2.0 (kiks-behaviour.md 1.1)."""

BODY = np.dtype(
    [
        ("x_mm", "f8"),
        ("y_mm", "f8"),
        ("trail", "f8", (TRAIL_LENGTH, 2)),
        ("velocity_x", "f8"),  # [mm/s]
        ("velocity_y", "f8"),
        ("radius_mm", "f8"),
        ("friction_mm_s2", "f8"),  # deceleration of a rolling or sliding body
        ("kick_share", "f8"),  # share of a robot's speed that it gets when the robot runs into it
        ("number", "i8"),  # from 1, never given twice
        ("brightness", "i4"),
        ("what", "i4"),
        ("holder", "i4"),  # number of the robot whose gripper holds it, from 1; 0 for none
        (
            "is_lifted",
            "i4",
        ),  # without collisions and invisible to sensors: above the floor, or outside if none holds it
        ("hold_ahead_mm", "f8"),  # the place at which it is held, relative to the holder
        ("hold_aside_mm", "f8"),
    ],
    align=True,
)


@dataclass
class State:
    """The records of robots and bodies, and the number of ticks.

    Attributes:
        robots: An array of `ROBOT`, shape [world_count, robot_count].
        bodies: An array of `BODY`, shape [world_count, body_count]; replaced when a body is added or removed.
        tick_count: Number of ticks done.

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
    bodies: NDArray[np.void]
    tick_count: int = 0

    @staticmethod
    def empty(*, world_count: int, robot_count: int, body_count: int = 0) -> State:
        """Return a state of zeros."""
        return State(np.zeros((world_count, robot_count), ROBOT), np.zeros((world_count, body_count), BODY))

    def snapshot(self) -> State:
        """Return a copy."""
        return State(self.robots.copy(), self.bodies.copy(), self.tick_count)

    def restore(self, snapshot: State) -> None:
        """Copy a snapshot into this state; robots in place, so views of them stay valid."""
        self.robots[...] = snapshot.robots
        self.bodies = snapshot.bodies.copy()
        self.tick_count = snapshot.tick_count

    def hash(self) -> str:
        """Return the first 16 hexadecimal digits of the SHA-256 of every bit of the state."""
        robots = self.robots.reshape(*self.robots.shape, 1).view(np.uint8)
        common, special = robots[..., :_COMMON_BYTES], robots[..., _COMMON_BYTES:]
        # A field that no robot uses changes no hash: those of runs without it stay when one is added.
        special = special if special.any() else special[:0]
        parts = (self.tick_count.to_bytes(8, "little"), common.tobytes(), self.bodies.tobytes(), special.tobytes())
        return hashlib.sha256(b"".join(parts)).hexdigest()[:16]
