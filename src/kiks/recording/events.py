"""What happened in a run, for people: contacts, lines of output, bookmarks, changes by hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.recording.log import RecordedLog
from kiks.recording.motion import Motion
from kiks.recording.rerun import run_again
from kiks.sim.run_log import Kind
from kiks.units import TICK_NS, s_from_ns


class Event(NamedTuple):
    """One thing that happened.

    Attributes:
        time_s: When [s].
        robot: Number of the robot; 0 for none.
        kind: 'contact', 'output' (a line that a program printed), 'bookmark', or 'change' (by a hand or a program, in
            any other way than over a line).
        text: Of an output or a bookmark.
    """

    time_s: float
    robot: int
    kind: str
    text: str


class EventReader:
    """Reads the events of a recording that may grow."""

    def __init__(self, log: RecordedLog) -> None:
        self._log = log
        self._block = log.blocks.start
        self._has_begun = False
        self._until_ns = -1
        self._contacts: NDArray[np.int64] = np.zeros(0, np.int64)

    def notes(self) -> list[Event]:
        """Return what was noted since the last call, in its order: all but contacts."""
        events: list[Event] = []
        blocks = self._log.blocks
        self._block = max(self._block, blocks.start)
        while self._block < blocks.stop:
            # All of one block at once: an error leaves no half of it behind.
            events += sorted(self._of_entries(), key=lambda event: event.time_s)
            self._block += 1
        return events

    def _of_entries(self) -> Iterator[Event]:
        for entry in self._log.entries_of(self._block):
            time_s = s_from_ns(entry.time_ns)
            if entry.kind == Kind.TEXT:
                yield Event(time_s, entry.robot + 1, "output", entry.data.decode("utf-8", "replace"))
            elif entry.kind == Kind.MARK:
                yield Event(time_s, 0, "bookmark", entry.data.decode("utf-8", "replace"))
            elif entry.kind == Kind.STATE:
                # The first state is the beginning.
                if self._has_begun:
                    yield Event(time_s, 0, "change", "")
                self._has_begun = True
            elif entry.kind == Kind.CHECK:
                self._has_begun = True

    def contacts(self) -> list[Event]:
        """Return the contacts since the last call; for them, the run is made again."""
        events: list[Event] = []
        end_ns = self._log.end_ns
        if end_ns > self._until_ns:
            for piece in run_again(self._log, max(self._until_ns, self._log.begin_ns), end_ns):
                for motion in piece.motion:
                    events += self._of_motion(motion)
            self._until_ns = end_ns
        return events

    def _of_motion(self, motion: Motion) -> Iterator[Event]:
        """Yield an event for each robot that has begun to touch something between two samples."""
        records: Any = motion.robots
        counts: NDArray[np.int64] = records["contact_count"].astype(np.int64)
        before = counts[:1].copy()
        known = min(len(self._contacts), counts.shape[1])
        before[0, :known] = self._contacts[:known]
        self._contacts = counts[-1]
        for sample, robot in np.argwhere(np.diff(counts, axis=0, prepend=before) > 0).tolist():
            yield Event(s_from_ns(int(motion.ticks[sample]) * TICK_NS), robot + 1, "contact", "")
