"""A recording that is read: the run's project, its tables, and its world at any time."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks import upwards
from kiks.errors import ParameterError, counted
from kiks.model.checks import check_count, check_number
from kiks.model.columns import Columns, columns_of
from kiks.model.project import Project
from kiks.recording.log import RecordedLog, Source
from kiks.recording.mcap_file import McapReader
from kiks.recording.recorder import PROGRAMS
from kiks.recording.replay import Replay
from kiks.recording.rerun import run_again
from kiks.recording.tables import TableParts
from kiks.sim.from_project import described
from kiks.sim.saved_state import SavedState
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s, s_from_ns

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@upwards.shown_in_notebooks("kiks.export.notebook", "recording")
class Recording:
    """A recorded run.

    A recording whose run was killed, or goes on, ends with its last whole chunk.

    Args:
        source: The file that `--record` or `sim.record` wrote, or what reads a recording.

    Attributes:
        log: All that was recorded, entry by entry.
        is_whole: Whether the run that wrote it came to its end.
        about: Description of the run: the version of KiKS, the command, the policy of thinking.
        programs: Texts of the programs that drove its robots, by name.

    Example:
        >>> import tempfile, kiks
        >>> file = Path(tempfile.mkdtemp(), "run.mcap")
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
        >>> with sim.record(file):
        ...     kiks.Khepera(sim.port(1)).set_speed(5, 5)
        ...     sim.run(2.5)
        >>> recording = Recording(file)
        >>> recording.world_at(sim.time_s).state_hash() == sim.state_hash()
        True
    """

    def __init__(self, source: str | Path | Source) -> None:
        self.log = RecordedLog(McapReader(source) if isinstance(source, str | Path) else source)
        self._reader = self.log.reader
        self.about: Mapping[str, str] = self._reader.about

    def __repr__(self) -> str:
        return f"<{self._reader.what}: {counted(len(self.robots), 'robot')}, {self.duration_s:.3f} s>"

    def __enter__(self) -> Recording:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: a recording holds no file open."""

    # ---- what ran ----

    @property
    def is_whole(self) -> bool:
        """Whether the run that wrote it came to its end."""
        return not isinstance(self._reader, McapReader) or self._reader.is_whole

    @cached_property
    def programs(self) -> dict[str, str]:
        """Texts of the programs that drove its robots, by name."""
        files = self._reader.attachments.items()
        found = {name: data.decode("utf-8", "replace") for name, data in files if name.startswith(PROGRAMS)}
        return {name.removeprefix(PROGRAMS): text for name, text in found.items()}

    @cached_property
    def project(self) -> Project:
        """The world at the beginning, with its robots and its seed."""
        return self.project_at(s_from_ns(self.log.begin_ns))

    @cached_property
    def start(self) -> SavedState:
        """The state at the beginning, with the arena, the kinds of robots and the seed."""
        return self.log.state_before(self.log.begin_ns)

    @property
    def what(self) -> str:
        """What ran: its programs, the arena, and the seed."""
        programs = ", ".join(dict.fromkeys(name.partition("-")[2] or name for name in self.programs))
        ran = " in ".join(filter(None, (programs, self.start.arena.name)))
        return ", ".join(filter(None, (ran, f"seed {self.start.head.seed}")))

    @property
    def title(self) -> str:
        """What ran, and for how long."""
        return f"{self.what}, {self.duration_s:.1f} s"

    def project_at(self, time_s: float) -> Project:
        """Return the world at a time as a project, with robots, bodies and lamps where they are then."""
        return described(self.world_at(time_s))

    @property
    def robots(self) -> range:
        """Numbers of the robots that it has in the end."""
        return range(1, len(self.log.state_before(self.log.end_ns).specs) + 1)

    def check_robot(self, robot: object, advice: str = "", name: str = "robot") -> int:
        """Return the number of a robot."""
        if not self.robots:
            raise ParameterError(f"{self._reader.what} must have a robot for this, but its world has none.")
        return check_count(name, robot, 1, len(self.robots), advice)

    @property
    def duration_s(self) -> float:
        """How long it is [s of simulated time]."""
        return s_from_ns(self.log.end_ns - self.log.begin_ns)

    # ---- tables ----

    def tables(self, *names: str) -> list[NDArray[np.void]]:
        """Return several tables, [row] each, by names of `table`, in the time of one: the run is repeated for them."""
        parts = TableParts(names)
        for piece in run_again(self.log):
            parts.add(piece)
        return parts.tables(self.log)

    def table(self, name: str, robot: int | None = None) -> NDArray[np.void]:
        """Return a table: an array of records, [row].

        Args:
            name: 'poses': where robots were, tick by tick. 'wheels': counters, speeds and contacts, every 40 ms.
                'readings': what programs read of the proximity and light sensors. 'wire': characters both ways.
                'events': contacts, scores, lines of output, bookmarks, changes by hand. Or what programs read by a
                command, such as 'E' or 'T,2,N', or by a sense of controllers, such as 'camera'.
            robot: Of this robot alone; of all if left out.

        Example:
            >>> import tempfile, kiks
            >>> file = tempfile.mkdtemp() + "/run.mcap"
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> with sim.record(file):
            ...     sim.run(2.5)
            >>> kiks.Recording(file).table("poses").dtype.names
            ('time_s', 'robot', 'x_mm', 'y_mm', 'heading_rad')
        """
        if robot is not None:
            self.check_robot(robot, "Leave it out for all.")
        (table,) = self.tables(name)
        return table if robot is None else table[table["robot"] == robot]

    def columns(self, name: str, robot: int | None = None) -> Columns:
        """Return a table as columns, [row] each, as files have it and `pandas.DataFrame` takes it.

        There is a column for each number, such as counts_0 to counts_7, and bytes are texts.

        Args:
            name: As for `table`.
            robot: As for `table`.

        Example:
            >>> import tempfile, kiks
            >>> file = tempfile.mkdtemp() + "/run.mcap"
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> with sim.record(file):
            ...     _ = kiks.Khepera(sim.port(1)).encoders()
            >>> columns = kiks.Recording(file).columns("positions")
            >>> list(columns), columns["value_0"]
            (['time_s', 'robot', 'value_0', 'value_1'], array([0]))
        """
        table = self.table(name, robot)
        return columns_of({each: table[each] for each in table.dtype.names or ()})

    # ---- the world at a time ----

    def world_at(self, time_s: float) -> Simulation:
        """Return a simulation in the state that the world had at a time. It goes on without the recording.

        The programs that drove its robots have hung up: their last commands still act, and the replies are dropped.

        Args:
            time_s: The time [s], from the beginning to the end of the recording.

        Example:
            >>> import tempfile, kiks
            >>> file = tempfile.mkdtemp() + "/run.mcap"
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> with sim.record(file):
            ...     sim.run(2.5)
            >>> world = kiks.Recording(file).world_at(1.5)
            >>> world.time_s
            1.5
        """
        return self.replay(time_s).let_go()

    def replay(self, time_s: float | None = None) -> Replay:
        """Return the run from a time on, as a simulation that the recorded inputs move."""
        return Replay(self.log, self.log.begin_ns if time_s is None else self.time_ns(time_s))

    def plot(self, *, robot: int = 1) -> Figure:
        """Draw the run: paths and odometry, where robots were, readings, speeds, and where the time went.

        Args:
            robot: Number of the robot whose readings, speeds and time are drawn.

        Returns:
            A Matplotlib figure, which notebooks show.

        Example:
            >>> import tempfile
            >>> from pathlib import Path
            >>> import kiks
            >>> file = Path(tempfile.mkdtemp(), "run.mcap")
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> with sim.record(file):
            ...     sim.run(1.5)
            >>> len(kiks.Recording(file).plot(robot=1).axes) > 1
            True
        """
        return upwards.plot_recordings([self], robot=robot)

    def export(self, path: str | Path, *, kind: str | None = None, **options: Any) -> None:
        """Write a film, a picture, figures, a photo, a table or a page of it: see `kiks.export.kinds.export`.

        Args:
            path: The file, whose ending says what it becomes.
            kind: Which kind, where the ending leaves a choice.
            options: Those of the kind.

        Example:
            >>> import tempfile, kiks
            >>> file = tempfile.mkdtemp() + "/run.mcap"
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> with sim.record(file):
            ...     sim.run(1)
            >>> kiks.Recording(file).export(file + ".csv", table="poses")
        """
        upwards.export_recording(self, path, kind=kind, **options)

    def time_ns(self, time_s: float, name: str = "time_s") -> int:
        """Return a time of the recording [ns]."""
        begin_s, end_s = s_from_ns(self.log.begin_ns), s_from_ns(self.log.end_ns)
        time_s = check_number(name, time_s, begin_s, end_s, "That is where the recording begins and ends.")
        return min(max(ns_from_s(time_s), self.log.begin_ns), self.log.end_ns)
