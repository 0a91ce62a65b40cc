"""What happened in a run, for people: contacts, scores, lines of output, bookmarks, changes by hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from kiks.recording.entries import Entry, parse_score
from kiks.recording.log import RecordedLog
from kiks.recording.rerun import RunPiece, run_again
from kiks.sim.run_log import Kind
from kiks.units import TICK_NS, s_from_ns


class Event(NamedTuple):
    """One thing that happened.

    Attributes:
        time_s: When [s].
        robot: Number of the robot; 0 for none.
        kind: 'contact', 'score' (`Simulation.set_score`), 'output' (a line that a program printed), 'bookmark', or
            'change' (by a hand or a program, in any other way than over a line).
        text: Of an output or a bookmark; the new value of a score.
    """

    time_s: float
    robot: int
    kind: str
    text: str


def notes_in(entries: Sequence[Entry], *, has_begun: bool) -> Iterator[Event]:
    """Yield what was noted: scores, lines of output, bookmarks, changes by hand.

    Args:
        entries: Entries of a log.
        has_begun: Whether there were entries before; the first state of all is no change.
    """
    for entry in entries:
        time_s = s_from_ns(entry.time_ns)
        if entry.kind == Kind.TEXT:
            yield Event(time_s, entry.robot + 1, "output", entry.data.decode("utf-8", "replace"))
        elif entry.kind == Kind.MARK:
            about_ns = min(max(entry.number, 0), entry.time_ns)
            yield Event(s_from_ns(about_ns), 0, "bookmark", entry.data.decode("utf-8", "replace"))
        elif entry.kind == Kind.SCORE:
            what, value = parse_score(entry)
            robot = what if isinstance(what, int) else 0
            yield Event(time_s, robot, "score", str(value) if robot else f"{what}: {value}")
        elif entry.kind == Kind.STATE and has_begun:
            yield Event(time_s, 0, "change", "")
        has_begun = has_begun or entry.kind in (Kind.STATE, Kind.CHECK)


def contacts_in(piece: RunPiece) -> Iterator[Event]:
    """Yield an event for each robot that has begun to touch something between two samples."""
    for motion in piece.motion:
        records: Any = motion.robots
        for sample, robot in np.argwhere(np.diff(records["contact_count"], axis=0) > 0).tolist():
            yield Event(s_from_ns(int(motion.ticks[sample + 1]) * TICK_NS), robot + 1, "contact", "")


class EventReader:
    """Reads the events of a recording that may grow."""

    def __init__(self, log: RecordedLog) -> None:
        self._log = log
        self._block = log.blocks.start
        self._has_begun = False
        self._until_ns = -1

    def notes(self) -> list[Event]:
        """Return what was noted since the last call: all but contacts."""
        events: list[Event] = []
        blocks = self._log.blocks
        for block in range(max(self._block, blocks.start), blocks.stop):
            events += notes_in(self._log.notes_in(block), has_begun=self._has_begun)
            self._block, self._has_begun = block + 1, True
        return sorted(events, key=lambda event: event.time_s)

    def contacts(self) -> list[Event]:
        """Return the contacts since the last call; for them, the run is made again."""
        begin_ns, end_ns = max(self._until_ns, self._log.begin_ns), self._log.end_ns
        if begin_ns >= end_ns:
            return []
        events = [event for piece in run_again(self._log, begin_ns, end_ns) for event in contacts_in(piece)]
        self._until_ns = end_ns  # after it: what an error has cut short is read again
        return events
