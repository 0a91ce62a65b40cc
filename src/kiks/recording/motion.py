"""The motion of a run: robots and bodies after every third or fourth tick.

A robot's record holds the poses of its last three ticks, too, so every tick's poses are there. Of the record only the
first part is kept: body, wheels and controllers.
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
from kiks.sim.saved_state import Layout, check_records, converted
from kiks.units import TICK_NS

KEPT_BYTES = next(field[1] for name, field in (ROBOT.fields or {}).items() if name == "bus")
"""Bytes of a robot's record that are kept: those before the field of that name."""


class Looks:
    """Looks at a world while nothing came or went, in order, until they are written.

    The records of all looks lie in one array of bytes: objects of their own would cost more than what is in them.

    Args:
        robot_count: Number of robots.
        body_count: Number of bodies.

    Attributes:
        robot_count: As above.
        body_count: As above.
        ticks: Number of ticks done at each look.
        robots: The first parts of robots' records.
        bodies: The records of bodies.
    """

    def __init__(self, robot_count: int, body_count: int) -> None:
        self.robot_count, self.body_count = robot_count, body_count
        self.ticks: list[int] = []
        self.robots = bytearray()
        self.bodies = bytearray()


class MotionWatcher:
    """Keeps looks until they are taken, as a `kiks.sim.paths.Watcher`.

    A program lets the ticks be done in pieces. It looks where such a piece ends, so that it needs no more of them.

    Attributes:
        from_tick: See `kiks.sim.paths.Watcher`.
        due_tick: The same.
    """

    def __init__(self, state: State) -> None:
        self._done: list[Looks] = []
        self._begin(state.robots, state.bodies)
        self.look(state)

    def _begin(self, robots: NDArray[np.void], bodies: NDArray[np.void]) -> None:
        """Begin looks at the arrays of a state."""
        self._robots, self._bodies = robots, bodies
        self._kept = robots.view(np.uint8).reshape(-1, ROBOT.itemsize)[:, :KEPT_BYTES]
        self._looks = looks = Looks(robots.size, bodies.size)
        self._add_tick, self._add_robots = looks.ticks.append, looks.robots.extend

    def look(self, state: State) -> None:
        """Keep the records."""
        if state.robots is not self._robots or state.bodies is not self._bodies:
            self._done.append(self._looks)
            self._begin(state.robots, state.bodies)
        tick = state.tick_count
        self.from_tick, self.due_tick = tick + TRAIL_LENGTH, tick + TRAIL_LENGTH + 1
        self._add_tick(tick)
        self._add_robots(self._kept.tobytes())
        if self._looks.body_count:
            self._looks.bodies += self._bodies.tobytes()

    def take(self) -> list[Looks]:
        """Return the looks since the last call."""
        looks = [each for each in (*self._done, self._looks) if each.ticks]
        self._done = []
        self._begin(self._robots, self._bodies)
        return looks


class Motion(NamedTuple):
    """Looks at a world while nothing came or went.

    Attributes:
        ticks: Number of ticks done at each, int64 [look].
        robots: The first fields of `ROBOT`, shape [look, robot].
        bodies: Records of `BODY`, shape [look, body].
    """

    ticks: NDArray[np.int64]
    robots: NDArray[np.void]
    bodies: NDArray[np.void]


TICKS_MAX = CLOCK_END_NS // TICK_NS
"""Last tick that a clock reaches."""

MOTION_BYTES_MAX = 256 << 20
"""Most bytes of a block's records."""

_SIDE_MAX_MM = MAX_CELLS / SIZE_MIN_MM
"""Longest side of an arena [mm]."""

_HEAD = struct.Struct("<IIII")  # looks, robots, bytes of a robot, bodies


def encode(looks: Sequence[Looks]) -> bytes:
    """Return a block of looks."""
    parts: list[bytes | bytearray] = []
    for each in looks:
        count = len(each.ticks)
        parts.append(_HEAD.pack(count, each.robot_count, KEPT_BYTES, each.body_count))
        parts += struct.pack(f"<{count}q", *each.ticks), each.robots, each.bodies
    return b"".join(parts)


def decode(block: bytes, layout: Layout, what: str, parts_max: int) -> Iterator[Motion]:
    """Yield what was seen, as long as nothing came or went at once.

    Args:
        block: Of `encode`.
        layout: That of the records.
        what: What messages call the block.
        parts_max: How often things may have come or gone.
    """
    offset = count = 0
    while offset < len(block):
        count += 1
        begin = offset + _HEAD.size
        looks, robots, robot_bytes, bodies = _HEAD.unpack_from(block, offset) if begin <= len(block) else (0, 0, 0, 0)
        middle = begin + looks * 8
        end = middle + looks * robots * robot_bytes
        offset = end + looks * bodies * layout.body.itemsize
        is_whole = looks and 0 < robot_bytes <= layout.robot.itemsize and offset <= len(block) and count <= parts_max
        # Records may be larger in this version than in the file.
        is_small = looks * (robots * KEPT_BYTES + bodies * BODY.itemsize) <= MOTION_BYTES_MAX
        ticks = np.frombuffer(block, "<i8", looks if is_whole else 0, begin if is_whole else 0)
        if not (is_whole and is_small and ticks[0] >= 0 and ticks[-1] <= TICKS_MAX and (np.diff(ticks) >= 0).all()):
            raise ParameterError(f"{what} must have blocks of motion, but one is damaged. Take another copy of it.")
        of_robots = np.frombuffer(block, _first_fields(layout.robot, robot_bytes), looks * robots, middle)
        motion = Motion(
            ticks,
            converted(of_robots, _KEPT).reshape(looks, robots),
            layout.bodies(block[end:offset]).reshape(looks, bodies),
        )
        check_records(motion.robots, motion.bodies, (_SIDE_MAX_MM, _SIDE_MAX_MM), what)
        yield motion


def _first_fields(kind: np.dtype[np.void], size: int) -> Any:
    """Return the type of the first bytes of records of a type."""
    fields: Any = {name: field for name, field in (kind.fields or {}).items() if field[1] + field[0].itemsize <= size}
    return np.dtype(
        {
            "names": list(fields),
            "formats": [field[0] for field in fields.values()],
            "offsets": [field[1] for field in fields.values()],
            "itemsize": size,
        }
    )


_KEPT = _first_fields(ROBOT, KEPT_BYTES)


class Ticks(NamedTuple):
    """Robots and bodies after each tick.

    Attributes:
        ticks: Number of ticks done, int64 [tick].
        poses: x_mm, y_mm, heading_rad; float64 [tick, robot, 3].
        places: x_mm, y_mm; float64 [tick, body, 2].
        looks: Which look tells of the tick, int64 [tick].
    """

    ticks: NDArray[np.int64]
    poses: NDArray[np.float64]
    places: NDArray[np.float64]
    looks: NDArray[np.int64]


def ticks_of(motion: Motion, after_tick: int) -> Ticks:
    """Return each tick that looks tell of.

    Args:
        motion: The looks.
        after_tick: The tick of the look before them; -1 without one.
    """
    ticks = motion.ticks[:, None] + np.arange(-TRAIL_LENGTH, 1)
    before = np.concatenate([[after_tick], motion.ticks[:-1]])
    is_new = (ticks > before[:, None]) & (ticks >= 0)
    poses = _with_trail(motion.robots, ("x_mm", "y_mm", "heading_rad"))
    places = _with_trail(motion.bodies, ("x_mm", "y_mm"))
    return Ticks(ticks[is_new], poses[is_new], places[is_new], np.nonzero(is_new)[0])


def _with_trail(records: Any, fields: Sequence[str]) -> NDArray[np.float64]:
    """Return fields of records [look, thing] with their trail: [look, 4, thing, field], the oldest tick first."""
    newest = np.stack([records[field] for field in fields], axis=-1)
    return np.concatenate([records["trail"][:, :, ::-1], newest[:, :, None]], axis=2).swapaxes(1, 2)
