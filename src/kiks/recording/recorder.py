"""Records a run while it goes on: its inputs, the hash of its state each second, and now and then the state.

Replies, motion and contacts follow from that: `kiks.recording.rerun` makes the run again to get them. So the writer
does nothing for each tick, and extends a list for each command.

A writer only reads the simulation. It reads the state where the run stops anyway or may stop without a difference, so
that a run is the same with it, to the bit. Each simulation has one writer at most, which writes into one store or more:
files, and the past of a desk.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from time import monotonic
from typing import Protocol, cast

from kiks.clock.sleeping import SimulatedClock
from kiks.ending import postponing_endings
from kiks.errors import KiksError, ParameterError
from kiks.model.atomic_files import path_of
from kiks.model.checks import check_kind
from kiks.model.data_file import read_file
from kiks.model.limits import NOTEBOOK_BYTES_MAX
from kiks.model.program_files import ProgramFiles
from kiks.model.program_kinds import program_text
from kiks.recording.entries import ENTRIES_MAX, FIELD_COUNT, RECORDED_LAYOUT, characters_in, pack_entries
from kiks.recording.mcap_file import McapFile
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.run_log import ACT, CHECK, MARK, STATE, TEXT, NotedEntry
from kiks.sim.saved_state import WorldFiles, state_bytes
from kiks.sim.simulation import Simulation
from kiks.sim.turret_host import has_user_turret
from kiks.units import NS_PER_S, s_from_ns
from kiks.version import __version__

_log = logging.getLogger("kiks.recording")

CHECK_NS = NS_PER_S
"""Simulated time between two checkpoints [ns]."""

STATE_US = 75_000
"""Real time that it takes to make the run again since the last state, about [us], after which a chunk begins with the
state. A jump to any time of a recording takes no longer than that and one chunk."""

ROBOT_US, CHARACTER_US = 60, 3
"""What a simulated second of a robot, and a character for it with its share of the reply, cost to make again, about
[us]."""

CHUNK_S = 0.2
"""Least real time between two chunks [s]. A crash costs what came after the last chunk: at most a second of a world in
real time, and a fifth of a second's work of one at full speed. A jump makes up to as much again."""

PROGRAMS = "programs/"
"""Folder of the programs' texts in the file."""

PROGRAM_CHARACTERS_MAX = 1 << 20
"""Most characters of a program's text in the file."""

LINES_MAX = 20_000
"""Most lines of output that wait for a chunk; of more, the oldest are dropped."""

LINE_CHARACTERS_MAX = 1000
"""Most characters that are kept of a line of output."""

WAITING_BYTES_MAX = 16 << 20
"""Most bytes of states that wait for a chunk."""


class Store(Protocol):
    """Where a run is written."""

    def attach(self, name: str, data: bytes) -> None:
        """Write a file that belongs to the run."""

    def write(self, begin_ns: int, log: bytes) -> bool:
        """Write a chunk.

        Args:
            begin_ns: Its time [ns].
            log: Of `pack_entries`.

        Returns:
            Whether the next chunk can be written, too; else the store has ended.
        """


class RunWriter:
    """Writes a run into stores from now on, as a `kiks.sim.event_loop.LoopRecorder`, until the last store is removed.

    Args:
        sim: The simulation, which has no other writer.

    Attributes:
        next_ns: When the next checkpoint is due [ns].
        clock: The world's.
        note: Notes an input, or when a program has thought: a function of C, as that comes in all exchanges.
        change_count: Of the world, when its changes were noted last.
        stores: Where it writes.
    """

    @classmethod
    def of(cls, sim: Simulation) -> RunWriter:
        """Return the writer of a simulation, a new one if it has none."""
        with sim.lock:
            writer = sim.loop.recorder
            return writer if isinstance(writer, RunWriter) else cls(sim)

    def __init__(self, sim: Simulation) -> None:
        self._sim, self._world = sim, sim.world
        self.stores: tuple[Store, ...] = ()
        self.clock: SimulatedClock = self._world
        # In one list: a tuple for each entry would make Python's garbage collection slow.
        self._entries: list[int | bytes] = []
        self.note: Callable[[NotedEntry], object] = self._entries.extend
        self._work_us = 0.0
        self._waiting_bytes = 0
        self._chunk_ns = sim.now_ns
        self._chunk_at_s = 0.0
        self._files = WorldFiles(on_new=self._attach)
        self._lines: deque[tuple[int, int, str]] = deque(maxlen=LINES_MAX)
        self.next_ns = (sim.now_ns // CHECK_NS + 1) * CHECK_NS
        self.note_state()
        sim.loop.recorder = self

    def add(self, store: Store) -> None:
        """Write into one more store, from now on."""
        with self._sim.lock:
            if self.stores:
                # A chunk that begins with a state, which is the first one of the new store.
                self.flush()
                self._note_check(has_state=True)
            for name, data in self._files.files.items():
                store.attach(name, data)
            self.stores = (*self.stores, store)
            self._write_chunk()

    def _attach(self, name: str, data: bytes) -> None:
        for store in self.stores:
            store.attach(name, data)

    def remove(self, store: Store) -> None:
        """Write no more into a store."""
        with self._sim.lock:
            self.stores = tuple(each for each in self.stores if each is not store)
            if not self.stores and self._sim.loop.recorder is self:
                self._sim.loop.recorder = None
                self.next_ns = NEVER_NS
                for wire in self._sim.wires:
                    wire.recorder = wire.on_act = None

    def flush(self) -> None:
        """Write all that has happened up to now, with the present state."""
        with self._sim.lock, postponing_endings():
            if self.stores:
                self.note_changes()
                self._note_check()
                self._write_chunk()

    # ---- from outside ----

    def note_act(self) -> None:
        """Note that a robot acts now, if something was noted at this instant: a replay does both in this order."""
        now_ns = self._world.now_ns
        if now_ns == (self._entries[1 - FIELD_COUNT] if self._entries else self._chunk_ns):
            self.note((ACT, now_ns, 0, 0, 0, b""))

    def _note_own(self, entry: NotedEntry) -> None:
        """Note what a robot with a turret of a user's own does, and the state after it: a replay cannot run that."""
        self.note(entry)
        self.note_state()

    def note_changes(self) -> None:
        """Note what was changed from outside."""
        world = self._world
        if world.change_count != self.change_count or world.lamps.tobytes() != self._lamps:
            self.note_state()

    def note_state(self) -> None:
        """Note all that the simulation is, as something was changed, or at the beginning."""
        sim, world = self._sim, self._world
        self.change_count, self._lamps = world.change_count, world.lamps.tobytes()
        for wire in sim.wires:
            wire.recorder, wire.on_act = self, self._note_own if has_user_turret(wire.firmware) else None
        data = state_bytes(sim, self._files)
        self.note((STATE, world.now_ns, 0, 0, 0, data))
        self._waiting_bytes += len(data)
        self._work_us = 0

    # ---- what people and programs say ----

    def say(self, robot: int, line: str) -> None:
        """Note a line that the program of a robot's index has printed; from any thread, which waits for nothing."""
        self._lines.append((self._world.now_ns, robot, line[:LINE_CHARACTERS_MAX]))

    def mark(self, note: str, time_ns: int | None = None) -> None:
        """Set a bookmark at a time [ns], this one if left out; the caller holds the lock."""
        now_ns = self._world.now_ns
        self.note((MARK, now_ns, 0, now_ns if time_ns is None else time_ns, 0, note.encode()))

    # ---- chunks ----

    def check(self) -> None:
        """Note the state, after all events up to `next_ns`, and choose a later `next_ns`."""
        self._note_check()
        self.next_ns += CHECK_NS
        is_full = self._waiting_bytes > WAITING_BYTES_MAX or len(self._lines) > LINES_MAX // 2
        if is_full or monotonic() >= self._chunk_at_s:
            with postponing_endings():
                self._write_chunk()
                if self._work_us >= STATE_US:
                    self._note_check(has_state=True)

    def _note_check(self, *, has_state: bool = False) -> None:
        self._sim.sync()
        data = self._world.state.hash().encode()
        if has_state:
            data += state_bytes(self._sim, self._files)
            self._waiting_bytes += len(data)
            self._work_us = 0
        self.note((CHECK, self._world.now_ns, 0, 0, 0, data))

    def _write_chunk(self) -> None:
        """Write what waits."""
        while self._lines:
            now_ns, robot, line = self._lines.popleft()
            self.note((TEXT, now_ns, robot, 0, 0, line.encode("utf-8", "replace")))
        entries, begin_ns, now_ns = self._entries, self._chunk_ns, self._world.now_ns
        self._work_us += ROBOT_US * self._sim.robot_count * s_from_ns(now_ns - begin_ns)
        while entries:  # hardly ever more than once
            log = pack_entries(entries[: ENTRIES_MAX * FIELD_COUNT])
            del entries[: ENTRIES_MAX * FIELD_COUNT]
            self._work_us += CHARACTER_US * characters_in(log)
            for store in self.stores:
                if not store.write(begin_ns, log):
                    self.remove(store)
            begin_ns = cast(int, entries[1]) if entries else now_ns
        self._chunk_ns = now_ns
        self._waiting_bytes = 0
        self._chunk_at_s = monotonic() + CHUNK_S


def describe_run(sim: Simulation) -> dict[str, str]:
    """Return what a recording says of itself: the version, its records' fields, the policy of thinking, the arena."""
    return {"kiks": __version__, "layout": RECORDED_LAYOUT, "thinking": sim.thinking, "arena": sim.arena.name}


def program_texts(programs: Iterable[Path]) -> dict[str, str]:
    """Return the texts of programs and their modules, by the program's number and their names.

    There is nothing of what is no text, or cannot be read.
    """
    return {
        f"{number}-{name.encode(errors='replace').decode()}": _text_of(path)
        for number, files in enumerate(map(ProgramFiles, programs), 1)
        for name, path in files.files.items()
        if path.suffix == ".py" or path == files.main
    }


def _text_of(program: Path) -> str:
    try:
        data = read_file(program, "The program", bytes_max=NOTEBOOK_BYTES_MAX)
    except KiksError:
        return ""  # reported when the program starts
    text = program_text(program, data)[:PROGRAM_CHARACTERS_MAX]
    return "" if "\0" in text else text


class RunRecorder:
    """Records a simulation into a file from now on; `close`, or the end of `with`, ends it.

    An earlier recording in the file stays there until time passes or something changes: a run that fails at its start
    costs none. It ends by itself, with a warning, when only the reserve of the disk is left or the file cannot be
    written. The run goes on, and the recording can be read up to there.

    Args:
        sim: The simulation.
        path: The file, which ends in .mcap.
        programs: Texts of the programs that drive its robots, by name.
        about: What else belongs to the run, such as the command that started it.

    Attributes:
        path: The file.
    """

    def __init__(
        self,
        sim: Simulation,
        path: str | Path,
        *,
        programs: Mapping[str, str] | None = None,
        about: Mapping[str, str] | None = None,
    ) -> None:
        self.path = path_of(path, "a recording's file").absolute()
        self._sim = sim
        self._file = McapFile(path)
        self._is_open = True
        self._error: ParameterError | None = None
        for name, text in (programs or {}).items():
            self._file.attach(PROGRAMS + name, text.encode(), "text/x-python")
        self._file.describe("run", {**describe_run(sim), **(about or {})})
        with sim.lock:
            self._began = sim.now_ns, sim.world.change_count
            self._writer = RunWriter.of(sim)
            self._writer.add(self)
            if not (self._is_open or self._file.is_in_place):
                self.close()  # which says why

    def __repr__(self) -> str:
        return f"<{type(self).__name__} to {str(self.path)!r}{'' if self._is_open else ', ended'}>"

    def __enter__(self) -> RunRecorder:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the recording."""
        self.close()

    def close(self) -> None:
        """End the recording with the present state."""
        with self._sim.lock, postponing_endings():
            if self._is_open:
                self._writer.flush()
            if self._is_open:
                self._end()
                if not (self._error or self._file.is_in_place):
                    _log.warning("nothing has happened, so that %r keeps the recording of before.", str(self.path))
            error, self._error = self._error, None
        if error is not None:
            raise error

    def flush(self) -> None:
        """Write all that has happened up to now, with the present state, so that a reader of the file finds it."""
        with self._sim.lock:
            if self._is_open:
                self._writer.flush()
                self._file.take_place()

    def say(self, robot: int, line: str) -> None:
        """Note a line that the program of a robot's index has printed; from any thread, which waits for nothing."""
        self._writer.say(robot, line)

    def mark(self, note: str) -> None:
        """Set a bookmark at this time."""
        check_kind("note", note, str)
        with self._sim.lock:
            if self._is_open:
                self._writer.mark(note)
            elif self._error is None:
                raise ParameterError("Cannot set a bookmark: the recording is closed. Record again.")

    # ---- as a store ----

    def attach(self, name: str, data: bytes) -> None:
        """Write a file that belongs to the run."""
        self._file.attach(name, data, "application/json", self._sim.now_ns)

    def write(self, begin_ns: int, log: bytes) -> bool:
        """Write a chunk; see `Store`."""
        has_begun = (self._sim.now_ns, self._sim.world.change_count) != self._began
        self._file.write(begin_ns, log, keeps_earlier=not has_begun)
        if self._file.has_failed or self._file.is_disk_full:
            self._end()
            if self._error is None:
                end = f"has ended at {s_from_ns(self._sim.now_ns):.1f} s, and is whole up to there"
                self._error = ParameterError(
                    f"a recording must leave some of its disk free, but that of {str(self.path)!r} is almost full: the "
                    f"recording {end if has_begun else 'cannot begin'}. Free some space, or choose another place."
                )
            if has_begun or self._file.is_in_place:
                _log.warning("%s", self._error)
        return self._is_open

    def _end(self) -> None:
        """Let the run go on without it, and end the file."""
        self._is_open = False
        self._writer.remove(self)
        try:
            self._file.close()
        except ParameterError as error:
            self._error = error
