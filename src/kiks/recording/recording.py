"""A recording that is read: the run's project, its tables, and its world at any time."""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, nearest, shown
from kiks.model.checks import check_number
from kiks.model.project import Project
from kiks.recording import tables
from kiks.recording.entries import LAST_INPUT, Columns, Entry, Kind
from kiks.recording.mcap_file import McapReader
from kiks.recording.motion import Motion
from kiks.recording.motion import decode as decode_motion
from kiks.recording.recorder import LOG, MOTION
from kiks.recording.replay import HASH_LENGTH, Replay
from kiks.sim.from_project import project_of
from kiks.sim.saved_state import Layout, SavedState, Setup
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s, s_from_ns

BLOCKS_KEPT = 4
"""Blocks of the log that are kept when they were read."""


class Row(NamedTuple):
    """The place of an entry: which block of the log it is in, and its row there."""

    block: int
    row: int


class Recording:
    """A recorded run.

    A recording whose run was killed, or goes on, ends with its last whole chunk.

    Args:
        file: The file that `--record` or `sim.record` wrote.

    Attributes:
        is_whole: Whether the run that wrote it came to its end.
        about: What is told of the run: the version of KiKS, the command, the policy of thinking.
        programs: Texts of the programs that drove its robots, by name.

    Raises:
        ParameterError: If it is missing, damaged or no recording of KiKS.

    Example:
        >>> import tempfile, kiks
        >>> file = Path(tempfile.mkdtemp(), "run.mcap")
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
        >>> with sim.record(file):
        ...     kiks.Khepera(sim.port(1)).set_speed(5, 5)
        ...     sim.run(2.5)
        >>> recording = Recording(file)
        >>> recording.world_at(2.5).state_hash() == sim.state_hash()
        True
    """

    def __init__(self, file: str | Path) -> None:
        self._reader = reader = McapReader(file)
        self.about: Mapping[str, str] = reader.told
        self._setups: dict[int, Setup] = {}
        self._blocks: OrderedDict[int, Columns] = OrderedDict()
        if "layout.json" not in reader.attachments or "setup/0.json" not in reader.attachments or not reader.chunks:
            raise ParameterError(
                f"{reader.what} must be a recording of KiKS, but it is another MCAP file, or the run was killed at its "
                "very beginning. `--record FILE` makes one."
            )
        self._layout = Layout.from_bytes(reader.attachments["layout.json"], reader.what)

    def __repr__(self) -> str:
        return f"<{self._reader.what}: {len(self.robots)} robots, {self.duration_s:.3f} s>"

    # ---- what ran ----

    @property
    def is_whole(self) -> bool:
        """Whether the run that wrote it came to its end."""
        return self._reader.is_whole

    @cached_property
    def programs(self) -> dict[str, str]:
        """Texts of the programs that drove its robots, by name."""
        files = self._reader.attachments.items()
        return {
            name[len("programs/") :]: data.decode("utf-8", "replace") for name, data in files if "programs/" in name
        }

    @cached_property
    def project(self) -> Project:
        """The world at the beginning, with its robots and its seed."""
        return self.project_at(s_from_ns(self.begin_ns))

    def project_at(self, time_s: float) -> Project:
        """Return the world at a time as a project, with robots, bodies and lamps where they are then."""
        sim = self.world_at(time_s)
        return project_of(sim, Setup.of(sim).project())

    @property
    def robots(self) -> range:
        """Numbers of the robots that it has in the end."""
        last = max(
            int(name[6:-5]) for name in self._reader.attachments if re.fullmatch(r"setup/[0-9]{1,9}\.json", name)
        )
        return range(1, len(self.setup(last).specs) + 1)

    @property
    def begin_ns(self) -> int:
        """When it begins [ns]."""
        return int(self._block(0).time_ns[0])

    @property
    def end_ns(self) -> int:
        """When it ends [ns]: at its last checkpoint."""
        columns = self._block(len(self._reader.chunks) - 1)
        return int(columns.time_ns[_is_input(columns)].max(initial=self._reader.chunks[-1].begin_ns))

    @property
    def duration_s(self) -> float:
        """How long it is [s of simulated time]."""
        return s_from_ns(self.end_ns - self.begin_ns)

    # ---- tables ----

    def table(self, name: str, robot: int | None = None) -> NDArray[np.void]:
        """Return a table: an array of records.

        Args:
            name: 'poses': where robots were, tick by tick. 'wheels': counters, speeds and contacts, every 40 ms.
                'readings': what programs read of the sensors. 'wire': characters both ways. 'events': contacts, lines
                of output, bookmarks, changes by hand.
            robot: Of this robot alone; of all if left out.

        Raises:
            ParameterError: If there is no such table or robot.

        Example:
            >>> Recording("run.mcap").table("poses")["x_mm"].mean()  # doctest: +SKIP
            312.4
        """
        if name not in tables.TABLES:
            raise ParameterError(
                f"name must be one of {', '.join(map(repr, tables.TABLES))}, but it was {shown(name)}."
                f"{nearest(str(name), list(tables.TABLES))}"
            )
        if robot is not None and robot not in self.robots:
            raise ParameterError(
                f"robot must be from 1 to {len(self.robots)}, but it was {shown(robot)}. Leave it out for all."
            )
        table = tables.TABLES[name](self)
        return table if robot is None else table[table["robot"] == robot]

    def motion(self) -> Iterator[Motion]:
        """Yield the records of robots and bodies, every fourth tick."""
        for chunk in self._reader.chunks:
            for topic, _, data in self._reader.messages(chunk):
                if topic == MOTION.name:
                    yield from decode_motion(data, self._layout, self._reader.what)

    def entries(self) -> Iterator[Entry]:
        """Yield all entries of the log."""
        for block in range(len(self._reader.chunks)):
            yield from self._block(block).entries()

    # ---- the world at a time ----

    def world_at(self, time_s: float) -> Simulation:
        """Return a simulation in the state that the world had at a time. It goes on without the recording.

        The programs that drove its robots have hung up: commands that they had sent still act, nobody gets the replies.

        Args:
            time_s: The time [s], from the beginning to the end of the recording.

        Raises:
            ParameterError: If it is no such time.
        """
        return self.replay(time_s).let_go()

    def replay(self, time_s: float | None = None) -> Replay:
        """Return the run from a time on, as a simulation that the recorded inputs move.

        Args:
            time_s: The time [s]; the beginning if left out.

        Raises:
            ParameterError: If the recording has no such time.
        """
        return Replay(self, self.begin_ns if time_s is None else self._time_ns(time_s))

    def _time_ns(self, time_s: float) -> int:
        begin_s, end_s = s_from_ns(self.begin_ns), s_from_ns(self.end_ns)
        time_s = check_number("time_s", time_s, begin_s, end_s, "That is where the recording begins and ends.")
        return min(max(ns_from_s(time_s), self.begin_ns), self.end_ns)

    # ---- the log, for `Replay` ----

    def find_more(self) -> None:
        """Find what a run that goes on has written since."""
        self._reader.find_more()

    def row_before(self, time_ns: int) -> Row:
        """Return the place of the last checkpoint at or before a time [ns], or of the first state."""
        chunks = self._reader.chunks
        last = max((number for number, chunk in enumerate(chunks) if chunk.begin_ns <= time_ns), default=0)
        for block in range(last, -1, -1):
            columns = self._block(block)
            is_state = (columns.kind == Kind.CHECK) | (columns.kind == Kind.STATE)
            rows = np.flatnonzero(is_state & (columns.time_ns <= max(time_ns, self.begin_ns)))
            if len(rows):
                return Row(block, int(rows[-1]))
        raise self._damaged("it has no state")

    def entry(self, row: Row) -> Entry:
        """Return the entry at a place."""
        return self._block(row.block).entry(row.row)

    def next_input(self, row: Row) -> tuple[Row, Entry, bool] | None:
        """Return the next input after a place, None after the last one.

        Returns:
            Its place, the entry, and whether robots acted between it and the place.
        """
        has_acted, begin = False, row.row + 1
        for block in range(row.block, len(self._reader.chunks)):
            kinds = self._block(block).kind
            for next_row in range(begin, len(kinds)):
                if kinds[next_row] <= LAST_INPUT:
                    return Row(block, next_row), self._block(block).entry(next_row), has_acted
                has_acted = has_acted or kinds[next_row] == Kind.ACT
            begin = 0
        return None

    def setup(self, number: int) -> Setup:
        """Return a setup by its number.

        Raises:
            ParameterError: If there is none.
        """
        if number not in self._setups:
            name = f"setup/{number}.json"
            if name not in self._reader.attachments:
                raise self._damaged(f"it has no {name}")
            self._setups[number] = Setup.from_bytes(self._reader.attachments[name], f"{self._reader.what}: {name}")
        return self._setups[number]

    def state_of(self, entry: Entry) -> tuple[Setup, SavedState]:
        """Return the setup and the state of an entry."""
        setup = self.setup(entry.number)
        data = entry.data[HASH_LENGTH:] if entry.kind == Kind.CHECK else entry.data
        return setup, SavedState.from_bytes(data, setup, self._layout, f"{self._reader.what}: state")

    def _block(self, number: int) -> Columns:
        """Return a block of the log."""
        if number not in self._blocks:
            found = (data for topic, _, data in self._reader.messages(self._reader.chunks[number]) if topic == LOG.name)
            columns = Columns.of_block(next(found, b""), self._reader.what)
            if not len(columns.kind):
                raise self._damaged("a part has no entries")
            self._blocks[number] = columns
            if len(self._blocks) > BLOCKS_KEPT:
                self._blocks.popitem(last=False)
        return self._blocks[number]

    def _damaged(self, why: str) -> ParameterError:
        return ParameterError(f"{self._reader.what} must be whole, but {why}. Take another copy of it.")


def _is_input(columns: Columns) -> NDArray[np.bool_]:
    return columns.kind <= LAST_INPUT
