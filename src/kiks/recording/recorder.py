"""Records a run while it goes on: its inputs, a checkpoint each second, and the motion.

The recorder only reads. It looks at the state where the run stops anyway or may stop without a difference, so that a
run is the same with it, to the bit.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from kiks.ending import postponing_endings
from kiks.errors import ParameterError
from kiks.recording import foxglove, motion
from kiks.recording.entries import EntryList, Kind
from kiks.recording.mcap_file import McapFile, Topic
from kiks.recording.motion import MotionWatcher
from kiks.sim.saved_state import Layout, Setup, TurretOfUser, state_bytes
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S
from kiks.version import __version__

LOG = Topic("/kiks/log", "kiks")
MOTION = Topic("/kiks/motion", "kiks")

CHECK_NS = NS_PER_S
"""Simulated time between two checkpoints [ns]."""

CHUNK_S = 0.1
"""Least real time between two chunks [s]. A crash costs what came after the last chunk: at most a second of a world in
real time, and a tenth of a second's work of one at full speed."""

PROGRAMS = "programs/"
"""Folder of the programs' texts in the file."""

SEND, TYPE, ACT = (int(kind) for kind in (Kind.SEND, Kind.TYPE, Kind.ACT))
"""Kinds of most entries, as plain numbers: an enumeration costs a tenth of a microsecond."""

WAITING_BYTES_MAX = 16 << 20
"""Most bytes of states that wait for a chunk."""


class RunRecorder:
    """Records a simulation from now on, as a `kiks.sim.event_loop.Recorder`; `close`, or the end of `with`, ends it.

    Args:
        sim: The simulation.
        path: The file, which ends in .mcap.
        programs: Texts of the programs that drive its robots, by name.
        about: What else belongs to the run, such as the command that started it.

    Attributes:
        path: The file.
        next_ns: When the next checkpoint is due [ns].
        change_count: Of the world, when its changes were noted last.
        has_lamps: Whether there are lamps.

    Raises:
        ParameterError: If the file cannot be written, or the simulation is being recorded already.
    """

    def __init__(
        self,
        sim: Simulation,
        path: str | Path,
        *,
        programs: Mapping[str, str] | None = None,
        about: Mapping[str, str] | None = None,
    ) -> None:
        if sim.loop.recorder is not None:
            raise ParameterError(f"{sim} must not be recorded yet, but it is. End that recording first.")
        self.path = Path(path).absolute()
        self._sim, self._world, self._loop = sim, sim.world, sim.loop
        self._file = McapFile(path, (LOG, MOTION, *foxglove.TOPICS))
        self._entries = EntryList()
        self._add_numbers, self._add_data = self._entries.numbers.extend, self._entries.data.append
        self._waiting_bytes = 0
        self._chunk_ns = sim.now_ns
        self._setup: tuple[Any, ...] = ()
        self._setup_count = 0
        self._drawn: tuple[int, bytes] = (0, b"")
        self._own_turrets: set[int] = set()
        self._messages: list[tuple[Topic, int, bytes]] = []
        with sim.lock:
            sim.sync()
            self._motion = MotionWatcher(self._world.state)
            self.next_ns = (sim.now_ns // CHECK_NS + 1) * CHECK_NS
            self._file.attach("layout.json", Layout().to_bytes(), "application/json")
            for name, text in (programs or {}).items():
                self._file.attach(PROGRAMS + name, text.encode(), "text/x-python")
            told = {"kiks": __version__, "thinking": sim.thinking, "arena": sim.arena.name, **(about or {})}
            self._file.describe("run", told)
            self._note_state()
            sim.watchers.append(self._motion)
            self._loop.recorder = self
            self._write_chunk()

    def __enter__(self) -> RunRecorder:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the recording."""
        self.close()

    def close(self) -> None:
        """End the recording with the present state.

        Raises:
            ParameterError: If it could not be written.
        """
        with self._sim.lock, postponing_endings():
            if self._loop.recorder is not self:
                return
            self.flush()
            self._loop.recorder = None
            for wire in self._sim.wires:
                wire.recorder = None
            self._sim.watchers.remove(self._motion)
            self._file.close()

    def flush(self) -> None:
        """Write all that has happened up to now, with the present state, so that a reader of the file finds it."""
        with self._sim.lock, postponing_endings():
            self.note_changes()
            self._note_check()
            self._motion.look(self._world.state)
            self._write_chunk()

    # ---- from outside ----

    def sent(self, robot: int, data: bytes, at_ns: int, start_ns: int, is_typed: bool) -> None:
        """Note that characters for a robot's index were sent, when, and when the first one starts [ns]."""
        self._add_numbers((TYPE if is_typed else SEND, self._world.now_ns, robot, at_ns, start_ns, len(data)))
        self._add_data(data)

    def hung_up(self, robot: int) -> None:
        """Note that the host has hung up."""
        self._entries.add(Kind.HANG_UP, self._world.now_ns, robot, 0, 0, b"")

    def dropped(self, robot: int, until_ns: int, now_ns: int) -> None:
        """Note a call of `Wire.drop_after`."""
        self._entries.add(Kind.DROP, self._world.now_ns, robot, until_ns, now_ns, b"")

    def baud_set(self, robot: int, baud: int) -> None:
        """Note that the mode selector was turned."""
        self._entries.add(Kind.SET_BAUD, self._world.now_ns, robot, baud, 0, b"")

    def note_changes(self) -> None:
        """Note what was changed from outside."""
        world = self._world
        if world.change_count != self.change_count or world.lamps.tobytes() != self._lamps:
            self._note_state()

    def _note_state(self) -> None:
        """Note all that the simulation is, as something was changed, or at the beginning."""
        sim, world = self._sim, self._world
        self.change_count, self._lamps = world.change_count, world.lamps.tobytes()
        self.has_lamps = self._lamps != b""
        setup = (world.arena, *world.specs, *(turret for wire in sim.wires for turret in wire.firmware.fitted))
        if len(setup) != len(self._setup) or any(a is not b for a, b in zip(setup, self._setup, strict=True)):
            self._setup = setup
            self._note_setup()
        data = state_bytes(sim)
        self._entries.add(Kind.STATE, world.now_ns, 0, self._setup_count - 1, 0, data)
        self._waiting_bytes += len(data)
        drawn = sim.robot_count, world.state.bodies["number"].tobytes()
        if drawn != self._drawn:
            self._drawn = drawn
            scene = foxglove.scene(world.specs, world.state.bodies[0], world.now_ns)
            self._messages.append((foxglove.SCENE, world.now_ns, scene))

    def _note_setup(self) -> None:
        sim, now_ns = self._sim, self._world.now_ns
        setup = Setup.of(sim)
        self._file.attach(f"setup/{self._setup_count}.json", setup.to_bytes(), "application/json", now_ns)
        self._setup_count += 1
        self._own_turrets = {
            index for index, turrets in enumerate(setup.turrets) if any(isinstance(t, TurretOfUser) for t in turrets)
        }
        for wire in sim.wires:
            wire.recorder = self
        self._messages.append((foxglove.WALLS, now_ns, foxglove.walls(sim.arena, now_ns)))

    # ---- what follows from it ----

    def acted(self, robot: int, reply: bytes, start_ns: int, character_ns: int) -> None:
        """Note that a robot has acted, with its reply, when that starts [ns], and the time of a character [ns]."""
        self._add_numbers((ACT, self._world.now_ns, robot, start_ns, character_ns, len(reply)))
        self._add_data(reply)
        if robot in self._own_turrets:
            # What a turret of a user's own does, no replay can know.
            self._note_state()

    def thought(self, robot: int, from_ns: int, until_ns: int) -> None:
        """Note that the program has thought."""
        self._entries.add(Kind.THINK, until_ns, robot, from_ns, until_ns, b"")

    def say(self, robot: int, line: str) -> None:
        """Note a line that the program of a robot's index has printed."""
        with self._sim.lock:
            now_ns = self._world.now_ns
            self._entries.add(Kind.TEXT, now_ns, robot, 0, 0, line.encode())
            self._messages.append((foxglove.TEXT, now_ns, foxglove.text(f"robot {robot + 1}", line, now_ns)))

    def mark(self, note: str) -> None:
        """Set a bookmark at this time."""
        with self._sim.lock:
            now_ns = self._world.now_ns
            self._entries.add(Kind.MARK, now_ns, 0, 0, 0, note.encode())
            self._messages.append((foxglove.TEXT, now_ns, foxglove.text("bookmark", note, now_ns)))

    # ---- the file ----

    def check(self) -> None:
        """Note the state, after all events up to `next_ns`, and choose a later `next_ns`."""
        self._note_check()
        self.next_ns += CHECK_NS
        if time.monotonic() >= self._chunk_at_s or self._waiting_bytes > WAITING_BYTES_MAX:
            with postponing_endings():
                self._write_chunk()

    def _note_check(self) -> None:
        data = state_bytes(self._sim)
        state_hash = self._world.state.hash().encode()
        self._entries.add(Kind.CHECK, self._world.now_ns, 0, self._setup_count - 1, 0, state_hash + data)
        # Motion has 25 looks in this time.
        self._waiting_bytes += 25 * len(data)

    def _write_chunk(self) -> None:
        """Write what waits."""
        looks, self._motion.looks = self._motion.looks, []
        messages, self._messages = self._messages, []
        blocks = [(LOG, self._chunk_ns, self._entries.take()), (MOTION, self._chunk_ns, motion.encode(looks, _LAYOUT))]
        self._chunk_ns = self._world.now_ns
        self._file.write(blocks + messages + foxglove.poses(looks))
        self._waiting_bytes = 0
        self._chunk_at_s = time.monotonic() + CHUNK_S


_LAYOUT = Layout()
