"""The desk: one world, and all that the people at its browsers share."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from kiks.clock.gate import Gate
from kiks.desk.server.live_editing import Editing
from kiks.desk.server.scripts import EXAMPLES
from kiks.errors import KiksError, LinkError, ParameterError
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import RobotSpec, robot_names
from kiks.ports.program_process import Command, Permission, commands_of
from kiks.ports.programs import Programs
from kiks.sim.drag import Drags
from kiks.sim.from_project import project_of, simulation_of
from kiks.sim.ring_buffer import RingBuffer
from kiks.sim.simulation import Simulation
from kiks.sim.turret_host import name_of

WINDOW_NS = 1_000_000_000
"""What 'at this moment' is [ns of real time]."""


class Speedometer:
    """Looks at both clocks again and again.

    Args:
        wall_ns: A clock that only goes forwards [ns]; a test hands in its own.

    Attributes:
        average: Simulated seconds in a real one since the beginning; pauses do not count.
        momentary: The same over the last second.

    Example:
        >>> wall = [0]
        >>> meter = Speedometer(wall_ns=lambda: wall[0])
        >>> meter.note(0, is_paused=False)
        >>> wall[0] = 1_000_000_000
        >>> meter.note(5_000_000_000, is_paused=False)
        >>> meter.average, meter.momentary
        (5.0, 5.0)
    """

    def __init__(self, *, wall_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.average = 0.0
        self.momentary = 0.0
        self._wall_ns = wall_ns
        self._last: tuple[int, int] | None = None
        self._running_ns = self._passed_ns = 0
        self._recent: deque[tuple[int, int]] = deque()

    def note(self, now_ns: int, *, is_paused: bool) -> None:
        """Look: simulated time is now at `now_ns` [ns]."""
        wall_ns = self._wall_ns()
        if self._last is not None:
            last_wall_ns, last_ns = self._last
            self._passed_ns += now_ns - last_ns
            # A step in a pause takes no time to speak of.
            self._running_ns += 0 if is_paused else wall_ns - last_wall_ns
        self._last = wall_ns, now_ns
        self._recent.append(self._last)
        while wall_ns - self._recent[0][0] > WINDOW_NS and len(self._recent) > 2:
            self._recent.popleft()
        first_wall_ns, first_ns = self._recent[0]
        self.momentary = (now_ns - first_ns) / (wall_ns - first_wall_ns) if wall_ns > first_wall_ns else 0.0
        self.average = self._passed_ns / self._running_ns if self._running_ns else 0.0


LOOK_S = 0.003
"""How often it is looked whether somebody has done what was asked for [s]."""

NEWS_LIMIT = 200
"""How many of the last words to people are kept."""

Done = TypeVar("Done")

NewPrograms = Callable[[Simulation, Sequence[Command | None], Gate], Programs]


class Desk:
    """A world on a desk.

    Nobody here waits for the world, and the world waits for nobody here: what is to be done with it is done between two
    of its events, by whoever moves it, or at once if nobody does.

    Args:
        sim: The world.
        project: What it was built from; what can be told of it is found out if left out.
        speed: Simulated seconds in a real one; None for as fast as possible.
        folder: Where files are opened and saved.
        owns_world: Whether it may be replaced by another one; False if a program outside holds it.
        may_run_programs: Whether others than `commands` may be started, from a browser or by a project.
        commands: Programs that begin with the world, the first for robot 1 and so on; they may always be started.
        new_programs: Makes the host of a world's programs, for who wants other settings than the project's.
        is_held: Whether programs begin with `begin` only; else at once.

    Attributes:
        sim: The world.
        project: What it was built from.
        gate: Where its time passes.
        hands: What is held in it.
        editing: What people draw in it.
        programs: The programs in it.
        is_seen: Set when a page has shown it for the first time.
        meter: How fast its time passes.
        scene: Number of what there is to be seen; another one whenever something has come, gone or changed its looks.
        news: What people are told, the newest last.
    """

    def __init__(
        self,
        sim: Simulation,
        *,
        project: Project | None = None,
        speed: float | None = 1.0,
        folder: Path | None = None,
        owns_world: bool = False,
        may_run_programs: bool = False,
        commands: Sequence[Command | None] = (),
        new_programs: NewPrograms | None = None,
        is_held: bool = False,
    ) -> None:
        self.folder = (Path.cwd() if folder is None else folder).resolve()
        self.owns_world = owns_world
        self.may_run_programs = may_run_programs
        self.scene = 0
        self.news: RingBuffer[str] = RingBuffer(NEWS_LIMIT)
        self.is_seen = threading.Event()
        self._has_begun = not is_held
        self._commands = self._granted = list(commands)
        self._new_programs = new_programs or self._usual_programs
        self._retired: list[Programs] = []
        self.project = foreign_project(sim) if project is None else project
        self.editing = Editing(self)
        self._take(sim, speed)

    def _take(self, sim: Simulation, speed: float | None) -> None:
        gate = Gate(sim.lock, speed=speed)
        # First, because it may fail: then the world that was there stays.
        programs = self._new_programs(sim, self._commands, gate)
        programs.permission = self._permission()
        if self._has_begun:
            programs.begin()
        self.sim, self.gate, self.programs = sim, gate, programs
        self.hands = Drags(sim)
        self.meter = Speedometer()
        self._mark = sim.checkpoint()
        sim.gate = gate
        self.tell()

    @property
    def has_beginners(self) -> bool:
        """Say whether there are programs that begin with the world."""
        return any(command is not None for command in self._commands)

    def begin(self) -> None:
        """Let the programs begin that begin with the world, and with each one that replaces it.

        Raises:
            KiksError: If one of them cannot start.
        """
        self._has_begun = True
        self.programs.begin()

    def _usual_programs(self, sim: Simulation, commands: Sequence[Command | None], gate: Gate) -> Programs:
        return Programs(
            sim, commands, thinking=self.project.thinking, say=self.say, is_heard=True, new_patience=gate.patience
        )

    def _permission(self) -> Permission:
        return Permission(self._granted, folders=(self.folder, EXAMPLES), may_start_others=self.may_run_programs)

    def _permitted(self, commands: Sequence[Command | None]) -> list[Command | None]:
        """Return the programs that may start; people are told of the others."""
        permission = self._permission()

        def permitted(command: Command | None) -> Command | None:
            try:
                if command is not None:
                    permission.check(command)
                return command
            except ParameterError as error:
                self.say(f"A program was left out: {error}")
                return None

        return [permitted(command) for command in commands]

    def names(self) -> list[str]:
        """Return what people call the robots: their numbers, if nothing else."""
        given = [robot.name for robot in self.project.robots]
        given += [""] * (self.sim.robot_count - len(given))
        return [name or str(number) for number, name in enumerate(given[: self.sim.robot_count], 1)]

    def tell(self) -> None:
        """Let all browsers see that something has come, gone, or looks different."""
        self.scene += 1

    def say(self, text: str) -> None:
        """Tell all people something; from any thread."""
        self.news.add([text])

    async def do(self, act: Callable[[Simulation], Done]) -> Done:
        """Do something with the world, locked, between two events; what it returns or raises comes out here.

        It must not let time pass.
        """
        sim, gate = self.sim, self.gate
        future = gate.ask(lambda: act(sim))
        while not future.done():
            await asyncio.sleep(LOOK_S)
            gate.serve()
        return future.result()

    # ---- another world ----

    async def replace(self, project: Project) -> None:
        """Put the world of a project on the desk, with those of its programs that may start; the old one ends.

        Raises:
            ParameterError: If the world cannot be replaced, the project is none, or a program of it is none.
            ArenaError: If something has no free place.
        """
        await self._put(project, commands_of(project, self.folder))

    async def start_over(self) -> None:
        """Begin again: the same world, seed and programs.

        Raises:
            ParameterError: If the world cannot be replaced.
        """
        await self._put(self.project, self._commands)

    async def _put(self, project: Project, commands: Sequence[Command | None]) -> None:
        if not self.owns_world:
            raise LinkError(
                "the world must be this desk's own to be replaced, but a program outside holds it. Begin it again "
                "there, or open another desk: kiks desk."
            )
        sim = await asyncio.to_thread(simulation_of, project, self.folder)
        old, programs, before = self.gate, self.programs, (self.project, self._commands)
        is_paused = old.is_paused
        self.project, self._commands = project, self._permitted(commands)
        try:
            self._take(sim, old.speed)
        except KiksError:
            self.project, self._commands = before
            raise
        # Only now: whoever moves the world ends them at once, and must have the new ones to turn to.
        self._retired.append(programs)
        if is_paused:
            self.gate.pause(sim.now_ns)
        old.close()

    def clear_away(self) -> None:
        """End the programs of worlds that lay here before; for the thread that moves the world."""
        while self._retired:
            self._retired.pop().close()

    async def present_project(self) -> Project:
        """Return the project with everything where it is now.

        Raises:
            ArenaError: If there is no room for what a gripper holds up.
        """
        sim, project = self.sim, self.project
        return replace(await self.do(lambda _: project_of(sim, project)), speed=self.gate.speed)

    # ---- time ----

    async def pause(self) -> None:
        """Let time stand still."""
        await self.do(lambda sim: self.gate.pause(sim.now_ns))

    async def go_on(self) -> None:
        """Let it pass again."""
        await self.do(lambda sim: self.gate.go_on())

    async def step(self, seconds: float) -> None:
        """Let so much time pass [s], then let it stand still."""

        def begin(sim: Simulation) -> None:
            self.gate.pause(sim.now_ns)
            self.gate.step(seconds)

        await self.do(begin)

    async def set_speed(self, speed: float | None) -> None:
        """Let time pass at another speed; None for as fast as possible.

        Raises:
            ParameterError: If it is out of range.
        """
        await self.do(lambda sim: self.gate.set_speed(speed, sim.now_ns))

    # ---- back to where it was ----

    async def mark(self) -> None:
        """Remember where everything stands, for `reset`."""
        self._mark = await self.do(lambda sim: sim.checkpoint())

    async def reset(self) -> None:
        """Put everything back where it stood when it was remembered, or at the beginning; time and programs go on."""

        def put_back(sim: Simulation) -> None:
            self.hands.drop_all()
            self._leave_if_empty()
            sim.reset(self._mark)

        await self.do(put_back)

    # ---- hands ----

    async def grab(self, owner: str, what: str, index: int) -> None:
        """Take a thing in somebody's hand.

        Raises:
            ParameterError: If there is no such thing, or another hand has it.
        """

        def take(_sim: Simulation) -> None:
            if self.hands.are_empty:
                self.gate.keep(self.hands.keep)
            try:
                self.hands.grab(owner, what, index)
            finally:
                self._leave_if_empty()

        await self.do(take)

    async def drop(self, owner: str) -> None:
        """Let go of what somebody's hand holds."""

        def let_go(_sim: Simulation) -> None:
            if not self.hands.are_empty:
                self.hands.drop(owner)
                self._leave_if_empty()

        await self.do(let_go)

    def _leave_if_empty(self) -> None:
        """Stop holding things in their places when nobody holds any."""
        if self.hands.are_empty:
            self.gate.leave(self.hands.keep)

    def close(self) -> None:
        """End its programs, and let the world go its way."""
        self.gate.close()
        self.clear_away()
        self.programs.close()
        self.sim.gate = None


class NewsHandler(logging.Handler):
    """Tells the people at a desk what the log says.

    Args:
        desk: The desk.
    """

    def __init__(self, desk: Desk) -> None:
        super().__init__(logging.WARNING)
        self._desk = desk

    def emit(self, record: logging.LogRecord) -> None:
        """Tell it."""
        self._desk.say(self.format(record))


def foreign_project(sim: Simulation) -> Project:
    """Return what can be told of a world that was not built from a project.

    Robots of another kind than KiKS has become Kheperas, and turrets of a user's own are left out.
    """
    known = {RobotSpec.load(kind): kind for kind in robot_names()}
    robots = tuple(
        ProjectRobot(
            kind=known.get(spec, "khepera"),
            turrets=tuple(name for each in sim.turrets(number) if (name := name_of(each)) is not None),
        )
        for number, spec in enumerate(sim.specs, 1)
    )
    return project_of(sim, Project(sim.arena, robots=robots, seed=sim.seed, thinking=sim.thinking))
