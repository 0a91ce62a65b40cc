"""The motion of a run: robots and bodies after every fourth tick, and at each change by hand.

A robot's record holds the poses of its last three ticks, too, so every tick's poses are there. Of the record only two
parts are kept: body, wheels and controllers, and the memory of the firmware.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BODY, ROBOT, TRAIL_LENGTH, State

_FIELDS: Any = ROBOT.fields

_FIRST_BYTES: int = _FIELDS["bus"][1]
_FIRST: Any = {name: field for name, field in _FIELDS.items() if field[1] < _FIRST_BYTES}
_MEMORY, _MEMORY_AT = _FIELDS["registers"][:2]

KEPT: Any = np.dtype(_FIRST | {"registers": (_MEMORY, _FIRST_BYTES)})
"""What is kept of `ROBOT`: the fields before `bus`, and `registers`."""

_KEPT_BYTES = np.r_[:_FIRST_BYTES, _MEMORY_AT : _MEMORY_AT + _MEMORY.itemsize]

PERIOD_TICKS = TRAIL_LENGTH + 1
"""Ticks between two samples: a sample has the poses of all ticks since the one before it."""


class Motion(NamedTuple):
    """Consecutive samples with the same robots and bodies.

    Attributes:
        ticks: Number of ticks done at each, int64 [sample].
        robots: Records of `KEPT`, shape [sample, robot].
        bodies: Records of `BODY`, shape [sample, body].
    """

    ticks: NDArray[np.int64]
    robots: NDArray[np.void]
    bodies: NDArray[np.void]


class MotionWatcher:
    """Collects samples, as a `kiks.sim.paths.Watcher`.

    The records of all samples lie in one array of bytes: objects of their own would cost more than what is in them.

    Attributes:
        from_tick: See `kiks.sim.paths.Watcher`.
        due_tick: The same.
    """

    def __init__(self, state: State) -> None:
        self._done: list[Motion] = []
        self._begin(state.robots, state.bodies)
        self.look(state)

    def _begin(self, robots: NDArray[np.void], bodies: NDArray[np.void]) -> None:
        """Begin samples of the arrays of a state."""
        self._robots, self._bodies = robots, bodies
        self._bytes = robots.view(np.uint8).reshape(-1, ROBOT.itemsize)
        self._ticks: list[int] = []
        self._robot_bytes, self._body_bytes = bytearray(), bytearray()

    def look(self, state: State) -> None:
        """Take a sample."""
        if state.robots is not self._robots or state.bodies is not self._bodies:
            self._end()
            self._begin(state.robots, state.bodies)
        self.from_tick = self.due_tick = (state.tick_count // PERIOD_TICKS + 1) * PERIOD_TICKS
        self._ticks.append(state.tick_count)
        self._robot_bytes += self._bytes[:, _KEPT_BYTES].tobytes()
        self._body_bytes += self._bodies.tobytes()

    def _end(self) -> None:
        if count := len(self._ticks):
            robots = np.frombuffer(self._robot_bytes, KEPT).reshape(count, -1)
            bodies = np.frombuffer(self._body_bytes, BODY).reshape(count, -1)
            self._done.append(Motion(np.array(self._ticks), robots, bodies))

    def take(self) -> list[Motion]:
        """Return the samples since the last call."""
        self._end()
        done, self._done = self._done, []
        self._begin(self._robots, self._bodies)
        return done


class Ticks(NamedTuple):
    """Robots and bodies after each tick.

    Attributes:
        ticks: Number of ticks done, int64 [tick].
        poses: x_mm, y_mm, heading_rad; float64 [tick, robot, 3].
        places: x_mm, y_mm; float64 [tick, body, 2].
        samples: The sample in which the tick is, int64 [tick].
    """

    ticks: NDArray[np.int64]
    poses: NDArray[np.float64]
    places: NDArray[np.float64]
    samples: NDArray[np.int64]


def each_tick(motion: Motion, after_tick: int) -> Ticks:
    """Return each tick of which the poses are in samples.

    Args:
        motion: The samples.
        after_tick: The tick of the sample before them; -1 without one.
    """
    ticks = motion.ticks[:, None] + np.arange(-TRAIL_LENGTH, 1)
    before = np.concatenate([[after_tick], motion.ticks[:-1]])
    is_new = (ticks > before[:, None]) & (ticks >= 0)
    poses = _with_trail(motion.robots, ("x_mm", "y_mm", "heading_rad"))
    places = _with_trail(motion.bodies, ("x_mm", "y_mm"))
    return Ticks(ticks[is_new], poses[is_new], places[is_new], np.nonzero(is_new)[0])


def _with_trail(records: Any, fields: Sequence[str]) -> NDArray[np.float64]:
    """Return fields of records [sample, thing] with their trail: [sample, 4, thing, field], the oldest tick first."""
    newest = np.stack([records[field] for field in fields], axis=-1)
    return np.concatenate([records["trail"][:, :, ::-1], newest[:, :, None]], axis=2).swapaxes(1, 2)
