"""The tables of a recording, as arrays of records."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.model.limits import TEXT_COLUMN_BYTES_MAX
from kiks.recording.entries import Entry
from kiks.recording.events import EventReader
from kiks.recording.log import RecordedLog
from kiks.recording.motion import Motion, ticks_of
from kiks.recording.rerun import run_again
from kiks.sim.run_log import Kind
from kiks.units import TICK_NS, s_from_ns

Table = NDArray[np.void]

_POSES = np.dtype([("time_s", "f8"), ("robot", "i4"), ("x_mm", "f8"), ("y_mm", "f8"), ("heading_rad", "f8")])
_WHEELS = np.dtype(
    [
        ("time_s", "f8"),
        ("robot", "i4"),
        ("left_pulses", "i8"),
        ("right_pulses", "i8"),
        ("left_setpoint", "i4"),
        ("right_setpoint", "i4"),
        ("left_speed", "i4"),
        ("right_speed", "i4"),
        ("is_touching", "?"),
        ("contacts", "i8"),
        ("driven_mm", "f8"),
    ]
)
_READINGS = np.dtype([("time_s", "f8"), ("robot", "i4"), ("command", "U1"), ("counts", "i4", (8,))])


_COUNTS = re.compile(rb"[0-9]{1,9}(,[0-9]{1,9}){7}")


def _seconds(ticks: NDArray[np.int64]) -> NDArray[np.float64]:
    return ticks * TICK_NS / 1e9


def _motion(log: RecordedLog) -> Iterator[Motion]:
    return (motion for piece in run_again(log) for motion in piece.motion)


def _entries(log: RecordedLog) -> Iterator[Entry]:
    return (entry for piece in run_again(log) for entry in piece.entries)


def _joined(parts: list[Table], kind: np.dtype[np.void]) -> Table:
    return np.concatenate(parts) if parts else np.zeros(0, kind)


def poses(log: RecordedLog) -> Table:
    """Return where robots were after each tick of 10 ms: time_s, robot, x_mm, y_mm, heading_rad (not wrapped)."""
    parts, last_tick = [], -1
    for motion in _motion(log):
        ticks, places, *_ = ticks_of(motion, last_tick)
        last_tick = int(motion.ticks[-1])
        rows = np.zeros(places.shape[:2], _POSES)
        rows["time_s"], rows["robot"] = _seconds(ticks)[:, None], np.arange(1, places.shape[1] + 1)
        for index, name in enumerate(("x_mm", "y_mm", "heading_rad")):
            rows[name] = places[:, :, index]
        parts.append(rows.ravel())
    return _joined(parts, _POSES)


def wheels(log: RecordedLog) -> Table:
    """Return what wheels did, every 40 ms.

    Columns are encoder counts since the start [pulses], speeds that the program asked for and that the robot measured
    [pulses/10 ms], whether it touches something, how often it has begun to, and how far it has driven, forwards and
    backwards together [mm].
    """
    parts = []
    for motion in _motion(log):
        records: Any = motion.robots
        rows = np.zeros(records.shape, _WHEELS)
        rows["time_s"], rows["robot"] = _seconds(motion.ticks)[:, None], np.arange(1, records.shape[1] + 1)
        for wheel, side in enumerate(("left", "right")):
            rows[f"{side}_pulses"] = records["pulse_count"][:, :, wheel]
            rows[f"{side}_setpoint"] = records["speed_setpoint"][:, :, wheel]
            rows[f"{side}_speed"] = records["measured_speed"][:, :, wheel]
        rows["is_touching"], rows["contacts"] = records["is_touching"] != 0, records["contact_count"]
        rows["driven_mm"] = records["forwards_mm"] + records["backwards_mm"]
        parts.append(rows.ravel())
    return _joined(parts, _WHEELS)


def readings(log: RecordedLog) -> Table:
    """Return what programs read of proximity (N) and light (O) sensors: time_s, robot, command, counts [8]."""
    rows = []
    for entry in _entries(log):
        if (reading := reading_of(entry)) is not None:
            rows.append((s_from_ns(entry.time_ns), entry.robot + 1, *reading))
    return np.array(rows, _READINGS)


def reading_of(entry: Entry) -> tuple[str, tuple[int, ...]] | None:
    """Return what a program read of eight sensors by an entry: N or O, and the counts; None for another entry."""
    letter, _, values = entry.data.rstrip().partition(b",")
    if entry.kind == Kind.ACT and letter in (b"n", b"o") and _COUNTS.fullmatch(values):
        return letter.decode().upper(), tuple(map(int, values.split(b",")))
    return None


def wire(log: RecordedLog) -> Table:
    """Return the characters on all lines: time_s of the first one, robot, is_sent (to the robot), data."""
    rows = []
    for entry in _entries(log):
        if entry.data and entry.kind in (Kind.SEND, Kind.TYPE):
            rows.append((s_from_ns(entry.other), entry.robot + 1, True, entry.data))
        elif entry.data and entry.kind == Kind.ACT:
            rows.append((s_from_ns(entry.number), entry.robot + 1, False, entry.data))
    rows.sort(key=lambda row: row[0])
    longest = _longest(log, [len(row[3]) for row in rows])
    return np.array(rows, np.dtype([("time_s", "f8"), ("robot", "i4"), ("is_sent", "?"), ("data", f"S{longest}")]))


def events(log: RecordedLog) -> Table:
    """Return what happened: time_s, robot (0 for none), kind, text.

    `kiks.recording.events.Event` says which kinds there are.
    """
    reader = EventReader(log)
    rows = [*reader.notes(), *reader.contacts()]
    rows.sort(key=lambda row: row.time_s)
    longest = _longest(log, [4 * len(row.text) for row in rows]) // 4
    kind = np.dtype([("time_s", "f8"), ("robot", "i4"), ("kind", "U8"), ("text", f"U{max(longest, 1)}")])
    return np.array(rows, kind)


def _longest(log: RecordedLog, lengths: Sequence[int]) -> int:
    """Return the greatest of the lengths of a column's texts, at least 1."""
    longest = max(lengths, default=1)
    if longest * len(lengths) > TEXT_COLUMN_BYTES_MAX:
        raise ParameterError(
            f"{log.reader.what} must have texts that fit into a table, but one has {longest} bytes, and there are "
            f"{len(lengths)} rows. Read `entries()` one by one."
        )
    return longest


TABLES: Mapping[str, Callable[[RecordedLog], Table]] = {
    "poses": poses,
    "wheels": wheels,
    "readings": readings,
    "wire": wire,
    "events": events,
}
"""The tables by name."""
