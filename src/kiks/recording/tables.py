"""The tables of a recording, as arrays of records."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.control.senses import SENSES
from kiks.engine.physics.motor import wheel_speeds
from kiks.errors import ParameterError, shown
from kiks.firmware.robot_kind import RobotKind
from kiks.meant import nearest
from kiks.model.limits import TEXT_COLUMN_BYTES_MAX
from kiks.model.robot import SENSOR_COUNT
from kiks.recording.entries import Entry
from kiks.recording.events import contacts_in, notes_in
from kiks.recording.log import RecordedLog
from kiks.recording.motion import each_tick
from kiks.recording.rerun import RunPiece
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
_READINGS = np.dtype([("time_s", "f8"), ("robot", "i4"), ("command", "U1"), ("counts", "i4", (SENSOR_COUNT,))])

_COUNTS = re.compile(rb"[0-9]{1,9}(,[0-9]{1,9}){%d}" % (SENSOR_COUNT - 1))

_COMMAND = re.compile("[A-Z]|T,[0-9]{1,3},[A-Z]")
"""What begins a command, and its reply in small letters."""

_NUMBERS = re.compile(rb"([a-z]|t,[0-9]{1,3},[a-z])((?:,-?[0-9]{1,18})+),?\s*")
"""A reply of whole numbers."""


class TableParts:
    """Tables that are put together while a run is made again; `names` are those that `table_kind` knows."""

    def __init__(self, names: Iterable[str]) -> None:
        self._parts: list[tuple[TableKind, list[Any]]] = [(table_kind(name), []) for name in names]

    def add(self, piece: RunPiece) -> None:
        """Add what is in a piece of the run."""
        for kind, found in self._parts:
            found.extend(kind.parts_of(piece))

    def tables(self, log: RecordedLog) -> list[Table]:
        """Return the tables; the log is that of the recording."""
        return [_made(log, kind.columns, found) for kind, found in self._parts]


def _made(log: RecordedLog, columns: Any, parts: list[Any]) -> Table:
    """Return a table of its parts: arrays, or rows by time, whose open columns are as wide as the longest of each.

    Of lists, those that are as long are there.
    """
    if not parts or isinstance(parts[0], np.ndarray):
        return np.concatenate([np.zeros(0, columns), *parts])
    parts.sort(key=lambda row: row[0])
    for place, name in enumerate(columns.names):
        if columns[name].itemsize:
            continue
        longest = max(max(len(row[place]) for row in parts), 1)
        if columns[name].subdtype:
            parts = [row for row in parts if len(row[place]) == longest]
            widest: Any = (name, columns[name].base, (longest,))
        else:
            widest = (name, f"{columns[name].char}{longest}")
        columns = np.dtype([*columns.descr[:place], widest, *columns.descr[place + 1 :]])
        if columns[name].itemsize * len(parts) > TEXT_COLUMN_BYTES_MAX:
            raise ParameterError(
                f"{log.reader.what} must have texts that fit into a table, but one has {longest} characters, and there "
                f"are {len(parts)} rows. Read them piece by piece, by `kiks.recording.rerun.run_again`."
            )
    return np.array(parts, columns)


def _seconds(ticks: NDArray[np.int64]) -> NDArray[np.float64]:
    return ticks * TICK_NS / 1e9


def poses(piece: RunPiece) -> Iterator[Table]:
    """Yield where robots were after each tick of 10 ms: time_s, robot, x_mm, y_mm, heading_rad (not wrapped)."""
    last_tick = piece.after_tick
    for motion in piece.motion:
        ticks, places, *_ = each_tick(motion, last_tick)
        last_tick = int(motion.ticks[-1])
        rows = np.zeros(places.shape[:2], _POSES)
        rows["time_s"], rows["robot"] = _seconds(ticks)[:, None], np.arange(1, places.shape[1] + 1)
        for index, name in enumerate(("x_mm", "y_mm", "heading_rad")):
            rows[name] = places[:, :, index]
        yield rows.ravel()


def wheels(piece: RunPiece) -> Iterator[Table]:
    """Yield what wheels did, every 40 ms.

    Columns are encoder counts since the start [pulses], speeds that the program asked for and that the robot measured
    [pulses/10 ms; of a stepper, steps and steps/s], whether it touches something, how often it has begun to, and how
    far it has driven, forwards and backwards together [mm].
    """
    for motion in piece.motion:
        is_new = motion.ticks > piece.after_tick
        records: Any = motion.robots[is_new]
        rows = np.zeros(records.shape, _WHEELS)
        rows["time_s"], rows["robot"] = _seconds(motion.ticks[is_new])[:, None], np.arange(1, records.shape[1] + 1)
        speeds = wheel_speeds(records, [spec.motor for spec in piece.specs[: records.shape[1]]])
        for wheel, side in enumerate(("left", "right")):
            rows[f"{side}_pulses"] = records["pulse_count"][:, :, wheel]
            rows[f"{side}_setpoint"] = records["speed_setpoint"][:, :, wheel]
            rows[f"{side}_speed"] = speeds[:, :, wheel]
        rows["is_touching"], rows["contacts"] = records["is_touching"] != 0, records["contact_count"]
        rows["driven_mm"] = records["forwards_mm"] + records["backwards_mm"]
        yield rows.ravel()


def readings(piece: RunPiece) -> Iterator[tuple[Any, ...]]:
    """Yield what programs read of proximity and light sensors: time_s, robot, command (N or O), counts [8]."""
    kinds = piece.kinds
    for entry in piece.entries:
        if (reading := parse_reading(entry, kinds)) is not None:
            yield s_from_ns(entry.time_ns), entry.robot + 1, *reading


def parse_reading(entry: Entry, kinds: Sequence[RobotKind]) -> tuple[str, tuple[int, ...]] | None:
    """Return what a program read of eight sensors by an entry: N or O, whatever the command, and the counts.

    None for another entry.
    """
    letter, _, values = entry.data.rstrip().partition(b",")
    if entry.kind == Kind.ACT and letter in (read := _readings_of(kinds[entry.robot])) and _COUNTS.fullmatch(values):
        return read[letter], tuple(map(int, values.split(b",")))
    return None


@cache
def _readings_of(kind: RobotKind) -> dict[bytes, str]:
    """Return N and O for the beginnings of the replies that have readings, on a kind of robot."""
    names = (name for name in ("proximity", "ambient") if name in kind.senses)
    return {_head(kind.senses[name]): SENSES[name].command for name in names}


def _head(command: str) -> bytes:
    """Return the beginning of the reply to a command."""
    return command.lower().encode()


def wire(piece: RunPiece) -> Iterator[tuple[Any, ...]]:
    """Yield the characters on all lines: time_s of the first one, robot, is_sent (to the robot), data."""
    for entry in piece.entries:
        if entry.data and entry.kind in (Kind.SEND, Kind.TYPE):
            yield s_from_ns(entry.other), entry.robot + 1, True, entry.data
        elif entry.data and entry.kind == Kind.ACT:
            yield s_from_ns(entry.number), entry.robot + 1, False, entry.data


def events(piece: RunPiece) -> Iterator[tuple[Any, ...]]:
    """Yield what happened: time_s, robot (0 for none), kind, text.

    `kiks.recording.events.Event` says which kinds there are.
    """
    yield from notes_in(piece.entries, has_begun=piece.after_tick >= 0)
    yield from contacts_in(piece)


class TableKind(NamedTuple):
    """A kind of table.

    Attributes:
        parts_of: Yields the arrays or rows of a piece of a run.
        columns: The type of a row; a column of texts without a width gets the one that it needs.
    """

    parts_of: Callable[[RunPiece], Iterator[Any]]
    columns: Any


TABLES: Mapping[str, TableKind] = {
    "poses": TableKind(poses, _POSES),
    "wheels": TableKind(wheels, _WHEELS),
    "readings": TableKind(readings, _READINGS),
    "wire": TableKind(wire, np.dtype([("time_s", "f8"), ("robot", "i4"), ("is_sent", "?"), ("data", "O")])),
    "events": TableKind(events, np.dtype([("time_s", "f8"), ("robot", "i4"), ("kind", "U0"), ("text", "U0")])),
}
"""The tables by name."""


def table_kind(name: str) -> TableKind:
    """Return a kind of table: of `TABLES`, or of the numbers replied to a command, such as 'T,2,N', or to a sense."""
    if name in TABLES:
        return TABLES[name]
    command, size = (SENSES[name].command, SENSES[name].size) if name in SENSES else (name, 0)
    if not isinstance(command, str) or not _COMMAND.fullmatch(command):
        known = [*TABLES, *SENSES]
        raise ParameterError(
            f"name must be one of {', '.join(map(repr, known))}, or a command such as 'H' or 'T,2,N', but it was "
            f"{shown(name)}.{nearest(name, known)}"
        )

    def replies(piece: RunPiece) -> Iterator[tuple[Any, ...]]:
        heads = [_head(kind.senses.get(name, "") if name in SENSES else command) for kind in piece.kinds]
        for entry in piece.entries:
            found = _NUMBERS.fullmatch(entry.data) if entry.kind == Kind.ACT else None
            if found and found[1] == heads[entry.robot]:
                values = tuple(map(int, found[2][1:].split(b",")))
                if len(values) == (size or len(values)):
                    yield s_from_ns(entry.time_ns), entry.robot + 1, values

    return TableKind(replies, np.dtype([("time_s", "f8"), ("robot", "i4"), ("value", "i8", (size,))]))
