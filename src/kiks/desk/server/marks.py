"""The marks on the time bar: what happened in a run, in few lines."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import NamedTuple

from kiks.desk.server.player import Span
from kiks.export.event_looks import EVENT_LOOKS
from kiks.recording.events import Event, EventReader
from kiks.recording.log import RecordedLog
from kiks.sim.judge import POINTS
from kiks.units import ns_from_s, s_from_ns

MERGED_S = 0.3
"""Time within which events of a kind and robot are one to people [s]: a drag is a hundred changes."""

MARKS_MAX = 300
"""Most marks on the bar."""

TEXT_MAX = 160
"""Most characters of a mark's line."""

LINES_MAX = 5
"""Most lines of a mark."""


class Mark(NamedTuple):
    """Events that happened together.

    Attributes:
        time_s: When the first one did [s].
        kind: Of `EVENT_LOOKS`.
        lines: What happened, for people.
        line_count: How many lines there would be if none were left out.
    """

    time_s: float
    kind: str
    lines: tuple[str, ...]
    line_count: int = 1

    @property
    def text(self) -> str:
        """What happened, for people."""
        left_out = self.line_count - len(self.lines)
        return "\n".join([*self.lines, f"and {left_out} more"] if left_out else self.lines)

    def joined(self, other: Mark) -> Mark:
        """Return this with another one that belongs to it."""
        kind = min(self.kind, other.kind, key=[*EVENT_LOOKS].index)
        return Mark(self.time_s, kind, (*self.lines, *other.lines)[:LINES_MAX], self.line_count + other.line_count)


class MarkReader:
    """Reads the marks of a recording that may grow, and may lose its beginning.

    Args:
        log: The log of the recording.
    """

    def __init__(self, log: RecordedLog) -> None:
        self._log = log
        self._events = EventReader(log)
        self._marks: dict[int, Mark] = {}
        self._count = 0
        self._latest: dict[tuple[str, int], tuple[float, int]] = {}
        self._lock = threading.Lock()

    def read(self, *, has_contacts: bool) -> list[Mark]:
        """Read what has happened since the last call, and return all of it, from the beginning of the recording on.

        Args:
            has_contacts: Whether to read contacts, too: for them, the run is made again.
        """
        with self._lock:
            for event in (*self._events.notes(), *(self._events.contacts() if has_contacts else ())):
                if not (event.kind == "score" and event.text.startswith(f"{POINTS}:")):
                    self._add(event)  # the judge's points change each second
            begin_s = s_from_ns(self._log.begin_ns)
            self._marks = {number: mark for number, mark in self._marks.items() if mark.time_s >= begin_s}
            return sorted(self._marks.values())

    def _add(self, event: Event) -> None:
        mark = Mark(event.time_s, event.kind, (described(event),))
        key = event.kind, event.robot
        latest_s, number = self._latest.get(key, (-1.0, -1))
        if event.kind != "bookmark" and number in self._marks and event.time_s - latest_s <= MERGED_S:
            if event.kind in ("output", "score"):
                self._marks[number] = self._marks[number].joined(mark)
        else:
            number = self._count = self._count + 1
            self._marks[number] = mark
        self._latest[key] = event.time_s, number


def described(event: Event) -> str:
    """Return what has happened, for people."""
    text = event.text if len(event.text) <= TEXT_MAX else f"{event.text[:TEXT_MAX]} ..."
    if event.kind == "contact":
        return f"robot {event.robot} touches something"
    if event.kind == "output":
        return f"robot {event.robot}: {text}"
    if event.kind == "score" and event.robot:
        return f"score of robot {event.robot}: {text}"
    return "changed by hand or by a program" if event.kind == "change" else text


def thinned(marks: Sequence[Mark], span: Span | None) -> list[Mark]:
    """Return at most `MARKS_MAX` marks: those that would lie on each other become one.

    Example:
        >>> marks = [Mark(k / 1000, "contact", ("bump",)) for k in range(1000)]
        >>> few = thinned(marks, Span(0, 1_000_000_000))
        >>> len(few), sum(mark.line_count for mark in few)
        (300, 1000)
    """
    if span is None or len(marks) <= MARKS_MAX:
        return list(marks)[:MARKS_MAX]
    width_s = max(s_from_ns(span.end_ns - span.begin_ns), 1e-9) / MARKS_MAX
    found: dict[int, Mark] = {}
    for mark in marks:
        place = min(int((mark.time_s - s_from_ns(span.begin_ns)) / width_s), MARKS_MAX - 1)
        found[place] = found[place].joined(mark) if place in found else mark
    return [found[place] for place in sorted(found)]


def next_mark(marks: Sequence[Mark], time_ns: int, *, is_before: bool) -> Mark | None:
    """Return the mark after, or before, a time [ns]; None if there is none."""
    if is_before:
        return next((mark for mark in reversed(marks) if ns_from_s(mark.time_s) < time_ns), None)
    return next((mark for mark in marks if ns_from_s(mark.time_s) > time_ns), None)
