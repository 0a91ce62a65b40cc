"""A recorded run at given times: walls, lamps, robots, balls and cylinders, and what programs read last."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import tee
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.sensing.proximity import pose_of
from kiks.engine.state import ROBOT
from kiks.firmware.robot_kind import RobotKind
from kiks.recording.entries import Entry
from kiks.recording.log import RecordedLog, has_state
from kiks.recording.motion import each_tick
from kiks.recording.rerun import RunPiece, run_again
from kiks.recording.tables import parse_reading
from kiks.sim.saved_state import SavedState
from kiks.units import NS_PER_S, TICK_NS

LEAP_MM = 50.0
"""What moves that far within a tick was moved by a hand [mm]: no robot drives 5 m/s."""


class Tick(NamedTuple):
    """Robots and bodies after a tick.

    Attributes:
        number: Of ticks done.
        poses: Of robots: x_mm, y_mm, heading_rad; float64 [robot, 3].
        places: Of bodies: x_mm, y_mm; float64 [body, 2].
        robots: Records of `KEPT`, as they were at most three ticks later, [robot].
        bodies: Records of `BODY`, as they were at most three ticks later, [body].
    """

    number: int
    poses: NDArray[np.float64]
    places: NDArray[np.float64]
    robots: NDArray[np.void]
    bodies: NDArray[np.void]


class Moment(NamedTuple):
    """A recorded run at a time.

    Attributes:
        time_ns: When [ns].
        saved: The latest recorded state, with the walls and the kinds of robots.
        poses: Of robots: x_mm, y_mm, heading_rad; float64 [robot, 3].
        robots: Records of `kiks.recording.motion.KEPT`, at most a tick before, [robot].
        bodies: Records of `BODY`, with their places at this instant, [body].
        readings: The last reply to `N` by a robot's index: eight counts.
        passed: The ticks since the moment before.
    """

    time_ns: int
    saved: SavedState
    poses: NDArray[np.float64]
    robots: NDArray[np.void]
    bodies: NDArray[np.void]
    readings: Mapping[int, Sequence[int]]
    passed: Sequence[Tick]


def moments(log: RecordedLog, times_ns: Sequence[int], pieces: Iterable[RunPiece] | None = None) -> Iterator[Moment]:
    """Yield the recorded state at each time.

    Args:
        log: The log of the recording.
        times_ns: The times [ns], at least one, in their order, within the recording.
        pieces: Those of `run_again` from the first time or a second before, where something else needs them, too.
    """
    # What programs have read last may have been read a little before.
    begin_ns = max(times_ns[0] - NS_PER_S, log.begin_ns)
    latest = _Latest(log.state_before(begin_ns))
    for_ticks, for_entries = tee(run_again(log, begin_ns, times_ns[-1]) if pieces is None else pieces)
    kinds_of = ((piece, piece.kinds) for piece in for_entries)
    ticks, entries = _ticks(for_ticks), ((entry, kinds) for piece, kinds in kinds_of for entry in piece.entries)
    now, later, entry = next(ticks), next(ticks, None), next(entries, None)
    for number, time_ns in enumerate(times_ns):
        passed = []
        while later is not None and later.number * TICK_NS <= time_ns:
            passed.append(later)
            now, later = later, next(ticks, None)
        while entry is not None and entry[0].time_ns <= time_ns:
            latest.add(log, *entry)
            entry = next(entries, None)
        poses, places = _between(now, later, time_ns)
        bodies: Any = now.bodies.copy()
        bodies["x_mm"], bodies["y_mm"] = places.T
        before = passed if number else ()
        yield Moment(time_ns, latest.saved, poses, now.robots, bodies, latest.readings, before)


class _Latest:
    """The latest of what entries say."""

    def __init__(self, saved: SavedState) -> None:
        self.saved = saved
        self.readings: dict[int, Sequence[int]] = {}

    def add(self, log: RecordedLog, entry: Entry, kinds: Sequence[RobotKind]) -> None:
        if has_state(entry):
            self.saved = log.state_of(entry)
        elif (reading := parse_reading(entry, kinds)) is not None and reading[0] == "N":
            self.readings[entry.robot] = reading[1]


def _ticks(pieces: Iterable[RunPiece]) -> Iterator[Tick]:
    """Yield the ticks of pieces of a run."""
    last_tick = -1
    for piece in pieces:
        for motion in piece.motion:
            ticks = each_tick(motion, last_tick)
            last_tick = int(motion.ticks[-1])
            rows = zip(ticks.ticks.tolist(), ticks.poses, ticks.places, ticks.samples.tolist(), strict=True)
            for number, poses, places, sample in rows:
                yield Tick(number, poses, places, motion.robots[sample], motion.bodies[sample])


def _between(now: Tick, later: Tick | None, time_ns: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return poses and places at a time from one tick on, up to the next."""
    since_ns = time_ns - now.number * TICK_NS
    if later is None or later.number != now.number + 1 or since_ns <= 0:
        return now.poses, now.places
    poses, places = now.poses.copy(), now.places.copy()
    if len(now.poses) == len(later.poses):
        records: Any = np.zeros((1, len(poses)), ROBOT)
        records["trail"][0, :, 0] = now.poses
        for axis, field in enumerate(("x_mm", "y_mm", "heading_rad")):
            records[field][0] = later.poses[:, axis]
        for index in np.flatnonzero(~leapt(now.poses, later.poses)).tolist():
            poses[index] = pose_of(records, later.number, time_ns, index)
    if np.array_equal(now.bodies["number"], later.bodies["number"]):
        drives = ~leapt(now.places, later.places)
        places[drives] += (later.places - now.places)[drives] * (since_ns / TICK_NS)
    return poses, places


def leapt(before: NDArray[np.float64], after: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which things, at places or poses [thing, ...], a hand has moved."""
    ways_mm: NDArray[np.float64] = np.hypot(*(after - before)[:, :2].T)
    return ways_mm > LEAP_MM
