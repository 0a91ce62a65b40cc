"""The motion of a run: robots and bodies after every third or fourth tick.

A robot's record holds the poses of its last three ticks, too, so every tick's poses are there. Of the record only the
first part is written: body, wheels and controllers.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BODY, ROBOT, TRAIL_LENGTH, State
from kiks.errors import ParameterError
from kiks.model.arena import MAX_CELLS, SIZE_MIN_MM
from kiks.model.checks import CLOCK_END_NS
from kiks.sim.saved_state import check_records
from kiks.units import TICK_NS

_FIELDS: Any = ROBOT.fields

ROBOT_BYTES: int = _FIELDS["bus"][1]
"""Bytes of a robot's record that are written: those before the field `bus`."""

_FIRST: Any = {name: field for name, field in _FIELDS.items() if field[1] < ROBOT_BYTES}

WRITTEN: Any = np.dtype(_FIRST)
"""The first fields of `ROBOT`, which are written."""


class Samples:
    """Consecutive samples with the same robots and bodies, in order, until they are written.

    The records of all samples lie in one array of bytes: objects of their own would cost more than what is in them.

    Args:
        robot_count: Number of robots.
        body_count: Number of bodies.

    Attributes:
        ticks: Number of ticks done at each sample.
        robots: The first parts of robots' records.
        bodies: The records of bodies.
    """

    def __init__(self, robot_count: int, body_count: int) -> None:
        self.robot_count, self.body_count = robot_count, body_count
        self.ticks: list[int] = []
        self.robots = bytearray()
        self.bodies = bytearray()


class MotionWatcher:
    """Collects samples, as a `kiks.sim.paths.Watcher`.

    A program lets the ticks be done in pieces. Samples are taken where such a piece ends, so that no more are needed.

    Attributes:
        from_tick: See `kiks.sim.paths.Watcher`.
        due_tick: The same.
    """

    def __init__(self, state: State) -> None:
        self._done: list[Samples] = []
        self._begin(state.robots, state.bodies)
        self.look(state)

    def _begin(self, robots: NDArray[np.void], bodies: NDArray[np.void]) -> None:
        """Begin samples of the arrays of a state."""
        self._robots, self._bodies = robots, bodies
        self._written = robots.view(np.uint8).reshape(-1, ROBOT.itemsize)[:, :ROBOT_BYTES]
        self._samples = samples = Samples(robots.size, bodies.size)
        self._add_tick, self._add_robots = samples.ticks.append, samples.robots.extend

    def look(self, state: State) -> None:
        """Take a sample."""
        if state.robots is not self._robots or state.bodies is not self._bodies:
            self._done.append(self._samples)
            self._begin(state.robots, state.bodies)
        tick = state.tick_count
        self.from_tick, self.due_tick = tick + TRAIL_LENGTH, tick + TRAIL_LENGTH + 1
        self._add_tick(tick)
        self._add_robots(self._written.tobytes())
        if self._samples.body_count:
            self._samples.bodies += self._bodies.tobytes()

    def take(self) -> bytes:
        """Return a block with the samples since the last call."""
        block = b"".join(encoded(each) for each in (*self._done, self._samples) if each.ticks)
        self._done = []
        self._begin(self._robots, self._bodies)
        return block


def encoded(samples: Samples) -> bytes:
    """Return samples as a part of a block."""
    count = len(samples.ticks)
    head = _HEAD.pack(count, samples.robot_count, samples.body_count)
    return b"".join((head, struct.pack(f"<{count}q", *samples.ticks), samples.robots, samples.bodies))


class Motion(NamedTuple):
    """Consecutive samples with the same robots and bodies, as they were read.

    Attributes:
        ticks: Number of ticks done at each, int64 [sample].
        robots: The first fields of `ROBOT`, shape [sample, robot].
        bodies: Records of `BODY`, shape [sample, body].
    """

    ticks: NDArray[np.int64]
    robots: NDArray[np.void]
    bodies: NDArray[np.void]

    def until(self, tick: int) -> bytes:
        """Return those up to a tick, as a part of a block; nothing if there are none."""
        samples, is_before = Samples(self.robots.shape[1], self.bodies.shape[1]), self.ticks <= tick
        samples.ticks = self.ticks[is_before].tolist()
        samples.robots += self.robots[is_before].tobytes()
        samples.bodies += self.bodies[is_before].tobytes()
        return encoded(samples) if samples.ticks else b""


TICKS_MAX = CLOCK_END_NS // TICK_NS
"""Last tick that a clock reaches."""

_SIDE_MAX_MM = MAX_CELLS / SIZE_MIN_MM
"""Longest side of an arena [mm]."""

_HEAD = struct.Struct("<III")  # samples, robots, bodies


def decode(block: bytes, what: str, parts_max: int) -> Iterator[Motion]:
    """Yield the samples of a block.

    Args:
        block: Of `MotionWatcher.take`.
        what: What messages call the block.
        parts_max: How often robots or bodies may have come or gone.
    """
    offset = count = 0
    while offset < len(block):
        count += 1
        begin = offset + _HEAD.size
        samples, robots, bodies = _HEAD.unpack_from(block, offset) if begin <= len(block) else (0, 0, 0)
        middle = begin + samples * 8
        end = middle + samples * robots * ROBOT_BYTES
        offset = end + samples * bodies * BODY.itemsize
        is_whole = samples and offset <= len(block) and count <= parts_max
        ticks = np.frombuffer(block, "<i8", samples if is_whole else 0, begin if is_whole else 0)
        if not (is_whole and ticks[0] >= 0 and ticks[-1] <= TICKS_MAX and (np.diff(ticks) >= 0).all()):
            raise ParameterError(f"{what} must have blocks of motion, but one is damaged. Take another copy of it.")
        motion = Motion(
            ticks,
            np.frombuffer(block, WRITTEN, samples * robots, middle).reshape(samples, robots),
            np.frombuffer(block, BODY, samples * bodies, end).reshape(samples, bodies),
        )
        check_records(motion.robots, motion.bodies, (_SIDE_MAX_MM, _SIDE_MAX_MM), what)
        yield motion


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


def ticks_of(motion: Motion, after_tick: int) -> Ticks:
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
