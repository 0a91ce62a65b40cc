"""What a recorded run did: replies and motion, which its recording does not hold, as the run is made again."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from kiks.firmware.robot_kind import RobotKind, robot_kind
from kiks.model.robot import RobotSpec
from kiks.recording.entries import Entry
from kiks.recording.log import RecordedLog
from kiks.recording.motion import Motion, MotionWatcher
from kiks.recording.replay import Replay
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.run_log import Kind, NotedEntry
from kiks.sim.turret_host import has_user_turret
from kiks.units import NS_PER_S, s_from_ns
from kiks.version import __version__

_log = logging.getLogger("kiks.recording")

PIECE_NS = 10 * NS_PER_S
"""Longest piece of a run that is held in memory at once [ns]."""


class RunPiece(NamedTuple):
    """A piece of a run.

    Attributes:
        entries: What was recorded and what robots did, by time.
        motion: Samples of robots and bodies, from its beginning to its end.
        after_tick: The last tick of the piece before; -1 for the first piece.
        specs: What each robot is.
    """

    entries: Sequence[Entry]
    motion: Sequence[Motion]
    after_tick: int
    specs: Sequence[RobotSpec]

    @property
    def kinds(self) -> list[RobotKind]:
        """The kind of each robot, which tells what its replies say."""
        return [robot_kind(spec.kind) for spec in self.specs]


def run_again(
    log: RecordedLog,
    begin_ns: int | None = None,
    end_ns: int | None = None,
    *,
    look: Callable[[Replay], int] = lambda replay: NEVER_NS,
) -> Iterator[RunPiece]:
    """Make a recorded run again, and yield what it does, piece by piece.

    It warns if the run is another one now, as one of another version of KiKS may be.

    Args:
        log: The log of the recording.
        begin_ns: From when on [ns]; from its beginning if left out.
        end_ns: Up to when [ns]; to its end if left out.
        look: Looks at the run at its beginning, and then at each time that it has returned, if that is before the end.
    """
    begin_ns = log.begin_ns if begin_ns is None else begin_ns
    end_ns = log.end_ns if end_ns is None else end_ns
    observer = _Observer(log, begin_ns, look)
    recorded = log.entries_from(begin_ns)
    entry, after_tick = next(recorded, None), -1
    while True:
        until_ns = min(begin_ns + PIECE_NS, end_ns)
        entries = observer.run_to(until_ns)
        while entry is not None and entry.time_ns <= until_ns:
            if entry.kind != Kind.ACT or entry.data:
                entries.append(entry)
            entry = next(recorded, None)
        entries.sort(key=lambda entry: entry.time_ns)
        yield RunPiece(entries, observer.take(), after_tick, tuple(observer.sim.specs))
        after_tick = observer.sim.world.state.tick_count
        if (begin_ns := until_ns) >= end_ns:
            break
    if observer.replay.differs_ns is not None:
        _log.warning(
            "%s was made by KiKS %s, and this is KiKS %s, which makes another run from %.0f s on.",
            log.reader.what,
            log.reader.about.get("kiks", "?"),
            __version__,
            s_from_ns(observer.replay.differs_ns),
        )


def shared_with(pieces: Iterable[RunPiece], *takers: Callable[[RunPiece], None]) -> Iterator[RunPiece]:
    """Yield the pieces of a run, and call functions with each of them before: one run is enough for all of them."""
    for piece in pieces:
        for take in takers:
            take(piece)
        yield piece


class _Observer:
    """Watches a replay: collects what robots do, and motion.

    Args:
        log: The log of the recording.
        begin_ns: Where it begins [ns].
        look: That of `run_again`.
    """

    def __init__(self, log: RecordedLog, begin_ns: int, look: Callable[[Replay], int]) -> None:
        self._acts: list[Entry] = []
        self.replay = Replay(log, begin_ns)
        self.sim = self.replay.sim
        self.sim.sync()
        self.motion = MotionWatcher(self.sim.world.state)
        self.sim.world.watch(self.motion)
        self.replay.on_change = self._look
        self._look()
        self._look_at, self._due_ns = look, look(self.replay)

    def run_to(self, time_ns: int) -> list[Entry]:
        """Let the run go on up to a time [ns]; return what robots have done."""
        while self._due_ns < time_ns:
            self.sim.advance_to(self._due_ns)
            self._due_ns = self._look_at(self.replay)
        self.sim.advance_to(time_ns)
        self.sim.sync()
        self._look()
        acts, self._acts = self._acts, []
        return acts

    def take(self) -> list[Motion]:
        """Return the samples since the last call, of which the last one is the first one of the next call."""
        motion = self.motion.take()
        self._look()
        return motion

    def _look(self) -> None:
        """Take a sample, and listen to wires that are new; what their turrets of users answer was recorded."""
        self.motion.look(self.sim.world.state)
        for wire in self.sim.wires:
            wire.on_act = None if has_user_turret(wire.firmware) else self._note_act

    def _note_act(self, entry: NotedEntry) -> None:
        self._acts.append(Entry(*entry))
        # As a program would read it, for a robot that sends by itself only while there is room.
        self.sim.wires[self._acts[-1].robot].line.forget()
