"""The timeline of a desk: recordings of what led to its world, one after the other, and what happened in them.

The present run is recorded into a temporary file, unless it is recorded anyway. Where a person goes on from a time in
the past, the recordings up to there stay, and another one follows them.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from kiks.desk.server.player import Span
from kiks.errors import KiksError, ParameterError
from kiks.model.project import Project
from kiks.ports.program_process import Command
from kiks.recording.events import Event, EventReader
from kiks.recording.log import RecordedLog
from kiks.recording.mcap_file import room_of
from kiks.recording.recorder import RunRecorder
from kiks.recording.replay import Replay
from kiks.recording.temporary_folder import TemporaryFolder
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s, s_from_ns

BYTES_MIN, BYTES_MAX = 8 << 20, 1 << 30
"""Least and most bytes of all temporary recordings of a desk; when there are more, the oldest recording is deleted."""

FREE_SHARE = 0.5
"""Most that they take of the space that other files leave."""

PART_COUNT = 4
"""In how many recordings they are divided."""

MERGED_S = 0.3
"""Time within which events of a kind and robot are one to people [s]: a drag is a hundred changes."""

MARKS_MAX = 300
"""Most marks on the bar."""

TEXT_MAX = 160
"""Most characters of a mark's line."""

LINES_MAX = 5
"""Most lines of a mark."""

KINDS = ("bookmark", "output", "change", "contact")
"""Kinds of events, the one first by whose colour a mark of several is drawn."""


class Run(NamedTuple):
    """How a world began.

    Attributes:
        project: Its project.
        commands: The programs that began with it.
    """

    project: Project
    commands: Sequence[Command | None]


class Mark(NamedTuple):
    """Events that happened together.

    Attributes:
        time_s: When the first one did [s].
        kind: Of `KINDS`.
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
        kind = min(self.kind, other.kind, key=KINDS.index)
        return Mark(self.time_s, kind, (*self.lines, *other.lines)[:LINES_MAX], self.line_count + other.line_count)


class Part:
    """One recording of a timeline.

    Args:
        file: Its file.
        run: How its world began, if it began on this desk and its programs are in it; else None.
        recorder: Records it; None for a file that is read alone.

    Attributes:
        file: Its file.
        log: The recording, for replays.
        begin_ns: When it begins [ns].
        end_ns: When it ends [ns]; None while it grows.
        run: As above.
        recorder: As above.
        own_recorder: The same if the desk has begun it, into a temporary file; else None.
        marks: What has happened in it, as far as it was read.
    """

    def __init__(self, file: Path, run: Run | None = None, recorder: RunRecorder | None = None) -> None:
        self.log = RecordedLog(file)
        self.begin_ns = self.log.begin_ns
        self.end_ns: int | None = self.log.end_ns if recorder is None else None
        self.run, self.recorder = run, recorder
        self.own_recorder = recorder if recorder is not None and recorder.gives_way else None
        self.marks: list[Mark] = []
        self.file = file
        # One of its own, for it is read in another thread.
        self._events_log = RecordedLog(file)
        self._events = EventReader(self._events_log)
        self._latest: dict[tuple[str, int], tuple[float, int]] = {}

    @property
    def own_bytes(self) -> int:
        """Number of bytes of its file if that is temporary."""
        with suppress(FileNotFoundError):
            return 0 if self.own_recorder is None else self.file.stat().st_size
        return 0

    def finish(self, end_ns: int) -> None:
        """Let it end at a time [ns], or where its recording has ended before, and end that if it is temporary."""
        if self.own_recorder is not None:
            with suppress(KiksError):  # a full disk, which is told where it is noticed
                self.own_recorder.close()
        self.end_ns = end_ns
        with suppress(KiksError):  # a file that is gone, which people are told when they look there
            self.log.find_more()
            self.end_ns = min(end_ns, self.log.end_ns)

    def delete(self) -> None:
        """End it, and delete its file if that is temporary."""
        if self.own_recorder is not None:
            with suppress(KiksError):
                self.own_recorder.close()
            with suppress(OSError):
                self.file.unlink(missing_ok=True)

    def read(self) -> None:
        """Read what has happened since the last call."""
        self._events_log.find_more()
        for event in self._events.read():
            if self.end_ns is None or event.time_s <= s_from_ns(self.end_ns):
                self._add(event)

    def _add(self, event: Event) -> None:
        mark = Mark(event.time_s, event.kind, (described(event),))
        key = event.kind, event.robot
        latest_s, index = self._latest.get(key, (-1.0, -1))
        if index >= 0 and event.time_s - latest_s <= MERGED_S:
            if event.kind == "output":
                self.marks[index] = self.marks[index].joined(mark)
        else:
            index = len(self.marks)
            self.marks.append(mark)
        self._latest[key] = event.time_s, index


class Timeline:
    """The past of a desk's world.

    Attributes:
        parts: Its recordings, the oldest first; empty if there is none.
    """

    def __init__(self) -> None:
        self.parts: tuple[Part, ...] = ()
        self._folder: TemporaryFolder | None = None
        self._count = 0
        self._has_failed = self._has_dropped = False
        self._reading = threading.Lock()

    # ---- recording; with the lock of the present world ----

    def open(self, file: Path) -> None:
        """Take a recording that exists."""
        self.parts = (Part(file),)

    def begin(self, sim: Simulation, run: Run | None) -> None:
        """Forget the past, and record a world from now on.

        Args:
            sim: The world.
            run: How it began; None if programs that are not this desk's own drive it.
        """
        before, self.parts = self.parts, ()
        for part in before:
            part.delete()
        self._has_failed = self._has_dropped = False
        self._record(sim, run)

    def branch(self, sim: Simulation) -> None:
        """Keep what was before the present time of a world, and record that from now on."""
        now_ns = sim.now_ns
        for part in self.parts:
            if part.begin_ns >= now_ns:
                part.delete()
            elif part.end_ns is None or part.end_ns > now_ns:
                part.finish(now_ns)
        self.parts = tuple(part for part in self.parts if part.begin_ns < now_ns)
        self._has_failed = False
        self._record(sim, None)

    def tend(self, sim: Simulation) -> str:
        """Keep the recording of the present world going; return a message for people if there is one."""
        if self._has_failed or not self.parts:
            return ""
        last = self.parts[-1]
        try:
            if sim.loop.recorder is not last.recorder:
                # Another recording has begun, or this one has ended; if by itself, this tells why.
                if last.own_recorder is not None:
                    last.own_recorder.close()
                self._record_next(sim)
            if self.parts[-1].own_recorder is None:
                return ""
            bytes_max = self._bytes_max(self.parts[-1].file.parent)
            if self.parts[-1].own_bytes >= bytes_max // PART_COUNT:
                self._record_next(sim)
            return self._drop_oldest(bytes_max)
        except (KiksError, OSError) as error:
            self._has_failed = True
            self.parts[-1].finish(sim.now_ns)
            self._drop_oldest(0)
            return f"The past can be kept no longer: {error}"

    def _record_next(self, sim: Simulation) -> None:
        last = self.parts[-1]
        last.finish(sim.now_ns)
        self._record(sim, last.run)

    def _bytes_max(self, folder: Path) -> int:
        """Return how many bytes all temporary recordings, which lie in a folder, may have now.

        Raises:
            OSError: If the folder or a file is gone.
        """
        room = room_of(folder)
        others_leave_bytes = room.free_bytes - room.reserve_bytes + sum(part.own_bytes for part in self.parts)
        bytes_max = min(BYTES_MAX, int(others_leave_bytes * FREE_SHARE))
        if bytes_max < BYTES_MIN:
            needed_bytes = room.reserve_bytes + int(BYTES_MIN / FREE_SHARE)
            raise ParameterError(
                f"the disk of the temporary folder must have {needed_bytes >> 20} MiB free, but it has "
                f"{room.free_bytes >> 20} MiB. Free some space and start the world over, or start KiKS with TMPDIR set "
                "to a folder on another disk."
            )
        return bytes_max

    def _drop_oldest(self, bytes_max: int) -> str:
        """Delete the oldest recordings until all have few bytes enough; return a message the first time."""
        count = len(self.parts)
        while len(self.parts) > 1 and sum(part.own_bytes for part in self.parts) > bytes_max:
            self.parts[0].delete()
            self.parts = self.parts[1:]
        if count == len(self.parts) or self._has_dropped:
            return ""
        self._has_dropped = True
        return (
            f"The time bar now begins at {s_from_ns(self.parts[0].begin_ns):.0f} s: temporary recordings have at most "
            f"{bytes_max >> 20} MiB, and the oldest was deleted. To keep a whole run, start KiKS with --record FILE."
        )

    def flush(self) -> None:
        """Write all that has happened up to now, and find it."""
        if self.parts and (last := self.parts[-1]).end_ns is None and last.recorder is not None:
            last.recorder.flush()
            last.log.find_more()

    def _record(self, sim: Simulation, run: Run | None) -> None:
        recorder = sim.loop.recorder
        if not isinstance(recorder, RunRecorder):
            if self._folder is None:
                self._folder = TemporaryFolder()
            self._bytes_max(self._folder.path)  # an error if there is no room for it
            self._count += 1
            recorder = RunRecorder(sim, self._folder.path / f"{self._count}.mcap", gives_way=True)
        recorder.flush()  # so that it has its place
        self.parts = (*self.parts, Part(recorder.path, run, recorder))

    def close(self) -> None:
        """End the recordings, and delete the temporary ones."""
        for part in self.parts:
            part.delete()
        self.parts = ()
        if self._folder is not None:
            self._folder.delete()
            self._folder = None

    # ---- reading ----

    def span(self, now_ns: int) -> Span | None:
        """Return from when to when the past goes; None if there is none.

        Args:
            now_ns: The time of the present world, which ends a recording that grows [ns].
        """
        if not self.parts:
            return None
        end_ns = self.parts[-1].end_ns
        return Span(self.parts[0].begin_ns, now_ns if end_ns is None else end_ns)

    def part_at(self, time_ns: int) -> Part:
        """Return the recording of a time [ns]: of two that meet there, the later one."""
        return next((part for part in reversed(self.parts) if part.begin_ns <= time_ns), self.parts[0])

    def run_at(self, time_ns: int) -> Run | None:
        """Return how the run of a time [ns] began, if its programs can run again."""
        return self.part_at(time_ns).run if self.parts else None

    def begin_after(self, time_ns: int, now_ns: int) -> int | None:
        """Return when the next recording begins at a time or later, and goes on from there [ns]; None if none does.

        Args:
            time_ns: The time [ns].
            now_ns: The time of the present world [ns].
        """
        for part in self.parts:
            if time_ns <= part.begin_ns < (now_ns if part.end_ns is None else part.end_ns):
                return part.begin_ns
        return None

    def replay_at(self, time_ns: int, now_ns: int) -> tuple[Replay, Span]:
        """Return a replay at a time, and how far its recording goes.

        Args:
            time_ns: The time [ns].
            now_ns: The time of the present world [ns].
        """
        part = self.part_at(time_ns)
        end_ns = min(now_ns if part.end_ns is None else part.end_ns, part.log.end_ns)
        return Replay(part.log, min(max(time_ns, part.begin_ns), end_ns)), Span(part.begin_ns, end_ns)

    def read(self) -> list[Mark]:
        """Read what has happened since the last call, and return all of it."""
        marks: list[Mark] = []
        with self._reading:
            for part in self.parts:
                part.read()
                marks += part.marks
        return sorted(marks)


def described(event: Event) -> str:
    """Return what has happened, for people.

    Example:
        >>> described(Event(1.0, 2, "contact", ""))
        'robot 2 touches something'
    """
    text = event.text if len(event.text) <= TEXT_MAX else f"{event.text[:TEXT_MAX]} ..."
    if event.kind == "contact":
        return f"robot {event.robot} touches something"
    if event.kind == "output":
        return f"robot {event.robot}: {text}"
    return text if event.kind == "bookmark" else "changed by hand"


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
