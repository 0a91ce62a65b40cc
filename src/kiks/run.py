"""A run: the world of a project, the programs that drive its robots, its supervisor and judge, and what ends it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from kiks.ending import OUT_OF_TIME, ended_after
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand, project_commands, project_supervisor
from kiks.ports.programs import Programs
from kiks.sim.from_project import described, simulation_of, thinking_of
from kiks.sim.judge import POINTS, Judgement
from kiks.sim.simulation import Simulation
from kiks.sim.supervision import Supervision
from kiks.units import ns_from_s

SECONDS, WALL = "--seconds", "--max-wall"
"""The limits of a run, in simulated and in real time, as people name them."""


class Run:
    """A run, from the world at its start to its end.

    `supervise` lets the supervisor prepare the world, `take_programs` makes what runs the programs, `limited` ends what
    runs meanwhile, and `close` ends all.

    Args:
        project: What is run.
        folder: Where it lies, with all files that it names.
        commands: The program of each robot; None for a robot without one.
        supervisor: File of the supervisor.
        thinking: Thinking time of the programs, in place of the project's; a replay lies anywhere.
        sim: The world, if it is there already.
        ready: Called when all files are read, before the engine is needed.
        say: Called with a line of text about each program that has ended.
        rules: Other options of `Programs`.

    Attributes:
        sim: The world.
        seconds: Simulated time at which it ends [s]; at first that of the project. None for no limit.
        programs: What runs the programs, after `take_programs`.
        supervision: The supervisor and the judge, after `supervise`; None before.
        ended_by: The limit that has ended it; empty if none has.
    """

    programs: Programs

    def __init__(
        self,
        project: Project,
        folder: Path,
        commands: Sequence[ProgramCommand | None] = (),
        supervisor: Path | None = None,
        *,
        thinking: str | None = None,
        sim: Simulation | None = None,
        ready: Callable[[], object] = lambda: None,
        say: Callable[[str], None] = lambda text: None,
        **rules: Any,
    ) -> None:
        self.project, self.folder, self.seconds = project, folder, project.seconds
        self.commands, self.supervisor, self.say, self.rules = list(commands), supervisor, say, rules
        self._given_thinking = thinking
        self.thinking = thinking_of(project, folder) if thinking is None else thinking
        if sim is None:
            count = max(sum(each is not None for each in commands), 1)
            sim = simulation_of(project, folder, thinking=self.thinking, program_count=count, ready=ready)
        self.sim = sim
        self.supervision: Supervision | None = None
        self.ended_by = ""
        self._at_the_end = ExitStack()

    @classmethod
    def of(
        cls, project: Project, folder: Path, commands: Sequence[ProgramCommand | None] | None = None, **options: Any
    ) -> Run:
        """Return the run of a project with the supervisor that it names, and with its programs if none are given."""
        own = project_commands(project, folder) if commands is None else commands
        return cls(project, folder, own, project_supervisor(project, folder), **options)

    @classmethod
    def in_world(cls, sim: Simulation, folder: Path = Path(), *, speed: float | None = 1.0, **options: Any) -> Run:
        """Return the run of a world that was made without a project, at a speed on the desk."""
        return cls(replace(described(sim), speed=speed), folder, sim=sim, **{"thinking": sim.thinking, **options})

    @property
    def files(self) -> list[Path]:
        """The files of its programs and of its supervisor, which a recording keeps."""
        files = [each.file for each in self.commands if each is not None]
        return files if self.supervisor is None else [*files, self.supervisor]

    def again(
        self,
        project: Project,
        folder: Path,
        commands: Sequence[ProgramCommand | None],
        supervisor: Path | None,
        sim: Simulation | None = None,
    ) -> Run:
        """Return the next run, of this project or another one, with the same rules."""
        given = self._given_thinking or ""
        # Only a command line can name a replay that lies anywhere, and programs elsewhere keep the thinking time that
        # the host has checked; people change any other one at the desk.
        thinking = given if given.startswith("replay") or self.rules.get("players") else None
        return Run(project, folder, commands, supervisor, thinking=thinking, sim=sim, say=self.say, **self.rules)

    def supervise(self) -> Supervision:
        """Let the supervisor prepare the world, and the judge begin."""
        self.supervision = supervision = Supervision(self.sim, self.supervisor, self.project.goal)

        def close() -> None:
            with self.sim.lock:
                supervision.close()

        self._at_the_end.callback(close)
        return supervision

    def take_programs(self, *, starts: bool = True, **options: Any) -> Programs:
        """Make what runs the programs.

        Args:
            starts: Whether the commands start with the world; not in one that goes on from its past.
            options: More options of `Programs`.
        """
        options = {"say": self.say, **self.rules, **options}
        self.programs = Programs(self.sim, self.commands if starts else (), thinking=self.thinking, **options)
        self._at_the_end.callback(self.programs.close)
        return self.programs

    @contextmanager
    def limited(
        self,
        end: Callable[[int, str], NoReturn],
        end_soon: Callable[[int, str], object] | None = None,
        *,
        wall_s: float | None = None,
    ) -> Iterator[None]:
        """End what runs meanwhile at the first limit that it reaches, or when the supervisor or the judge ends it.

        Args:
            end: Ends it with an exit code and a message, by an exception.
            end_soon: The same from the handler of a signal; `end` if left out.
            wall_s: Its limit in real time [s]; that in simulated time is `seconds`.
        """
        seconds = self.seconds

        def end_in_simulated_time() -> None:
            self.ended_by = SECONDS
            end(0, f"the run has ended after {seconds:g} s of simulated time.")

        def end_in_real_time() -> None:
            self.ended_by = WALL
            (end_soon or end)(OUT_OF_TIME, f"{WALL} has ended the run after {wall_s:g} s of real time.")

        if seconds is not None:
            self.sim.loop.end_at(ns_from_s(seconds), end_in_simulated_time)
        if self.supervision is not None:
            self.supervision.end = end
        with ended_after(wall_s, end_in_real_time):
            yield

    def judgement(self) -> Judgement:
        """Let the judge decide, and return how it has done; without a goal, the points are the supervisor's."""
        if self.supervision is not None and self.supervision.judge is not None:
            return self.supervision.judge.end()
        points = self.sim.score.get(POINTS, 0)
        return Judgement(False, False, points if isinstance(points, float | int) else 0, self.sim.time_s)

    def close(self) -> None:
        """End the programs, then the supervisor; the judge decides."""
        self._at_the_end.close()

    def __enter__(self) -> Run:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()
