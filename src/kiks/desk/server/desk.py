"""The desk: one world and the state that all its browsers share."""

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
"""Window of the momentary speed [ns of real time]."""


class Speedometer:
    """Measures how fast simulated time passes, from samples of both clocks.

    Args:
        wall_ns: Monotonic clock [ns]; tests pass their own.

    Attributes:
        average: Simulated seconds per real second since the start, without pauses.
        momentary: Simulated seconds per real second over the last second.

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
        """Take a sample at the simulated time `now_ns` [ns]."""
        wall_ns = self._wall_ns()
        if self._last is not None:
            last_wall_ns, last_ns = self._last
            self._passed_ns += now_ns - last_ns
            # A single step during a pause takes hardly any real time.
            self._running_ns += 0 if is_paused else wall_ns - last_wall_ns
        self._last = wall_ns, now_ns
        self._recent.append(self._last)
        while wall_ns - self._recent[0][0] > WINDOW_NS and len(self._recent) > 2:
            self._recent.popleft()
        first_wall_ns, first_ns = self._recent[0]
        self.momentary = (now_ns - first_ns) / (wall_ns - first_wall_ns) if wall_ns > first_wall_ns else 0.0
        self.average = self._passed_ns / self._running_ns if self._running_ns else 0.0


RETRY_S = 0.02
"""Period at which a request is offered again while no thread moves the world [s]."""

NEWS_LIMIT = 200
"""Number of messages to people that are kept."""

Done = TypeVar("Done")

NewPrograms = Callable[[Simulation, Sequence[Command | None], Gate], Programs]


class Desk:
    """A world on a desk.

    Requests to the world run between two of its events: in the thread that moves the world, or at once if no thread
    moves it. So the server never blocks on the world, and the world never waits for the server.

    Args:
        sim: The world.
        project: The project it was built from; derived from the world if left out.
        speed: Simulated seconds per real second; None for full speed.
        folder: Where files are opened and saved.
        owns_world: Whether the world may be replaced; False if a program outside holds it.
        may_run_programs: Whether a browser or a project may start programs other than `commands`.
        commands: Programs that start with the world, the first for robot 1 and so on; they are always permitted.
        new_programs: Factory of a world's program host; the default takes the project's settings.
        is_held: Whether programs wait for `begin`; else they start at once.

    Attributes:
        sim: The world.
        project: The project it was built from.
        gate: Where its time passes.
        hands: The things that people hold.
        programs: The programs in it.
        is_seen: Set when a page has shown it for the first time.
        meter: Measures how fast its time passes.
        scene: Counts up whenever a thing appears, disappears or changes its looks.
        news: Messages to people, the newest last.
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
        self._take(sim, speed)

    def _take(self, sim: Simulation, speed: float | None) -> None:
        gate = Gate(sim.lock, speed=speed)
        # First, because it may fail: then the old world stays.
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
        """Whether programs start with the world."""
        return any(command is not None for command in self._commands)

    def begin(self) -> None:
        """Start the programs of this world; those of later worlds start with them.

        Raises:
            KiksError: If one of them cannot start.
        """
        self._has_begun = True
        self.programs.begin()

    def _usual_programs(self, sim: Simulation, commands: Sequence[Command | None], gate: Gate) -> Programs:
        return Programs(
            sim, commands, thinking=self.project.thinking, say=self.say, keeps_output=True, new_patience=gate.patience
        )

    def _permission(self) -> Permission:
        return Permission(self._granted, folders=(self.folder, EXAMPLES), may_start_others=self.may_run_programs)

    def _permitted(self, commands: Sequence[Command | None]) -> list[Command | None]:
        """Return the programs with None for each that may not start; people get a message about those."""
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
        """Return the names of the robots; a robot without a name has its number."""
        given = [robot.name for robot in self.project.robots]
        given += [""] * (self.sim.robot_count - len(given))
        return [name or str(number) for number, name in enumerate(given[: self.sim.robot_count], 1)]

    def tell(self) -> None:
        """Make all browsers load the scene again: a thing has appeared, disappeared or changed its looks."""
        self.scene += 1

    def say(self, text: str) -> None:
        """Show a message in all browsers; from any thread."""
        self.news.add([text])

    async def do(self, act: Callable[[Simulation], Done]) -> Done:
        """Run a function with the locked world between two events, and return or raise its outcome.

        The function must not let time pass.
        """
        sim, gate = self.sim, self.gate
        future = gate.ask(lambda: act(sim))
        if future.done():
            return future.result()
        # The thread that moves the world serves the request, unless it has just stopped.
        served = asyncio.wrap_future(future)
        while not (await asyncio.wait([served], timeout=RETRY_S))[0]:
            gate.serve()
        return served.result()

    # ---- another world ----

    async def replace(self, project: Project) -> None:
        """Replace the world by that of a project, with the permitted ones of its programs; the old world ends.

        Raises:
            LinkError: If the world cannot be replaced.
            ParameterError: If the project or one of its programs is not valid.
            ArenaError: If a thing has no free place.
        """
        await self._put(project, commands_of(project, self.folder))

    async def start_over(self) -> None:
        """Begin again with the same world, seed and programs.

        Raises:
            LinkError: If the world cannot be replaced.
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
        # Last: the thread that moves the world ends them at once, and then needs the new ones.
        self._retired.append(programs)
        if is_paused:
            self.gate.pause(sim.now_ns)
        old.close()

    def clear_away(self) -> None:
        """End the programs of replaced worlds; called by the thread that moves the world."""
        while self._retired:
            self._retired.pop().close()

    async def present_project(self) -> Project:
        """Return the project with the present poses.

        Raises:
            ArenaError: If there is no room for a thing that a gripper holds up.
        """
        sim, project = self.sim, self.project
        return replace(await self.do(lambda _: project_of(sim, project)), speed=self.gate.speed)

    # ---- time ----

    async def pause(self) -> None:
        """Pause simulated time."""
        await self.do(lambda sim: self.gate.pause(sim.now_ns))

    async def go_on(self) -> None:
        """Resume simulated time."""
        await self.do(lambda sim: self.gate.go_on())

    async def step(self, seconds: float) -> None:
        """Let `seconds` of simulated time pass, then pause."""

        def begin(sim: Simulation) -> None:
            self.gate.pause(sim.now_ns)
            self.gate.step(seconds)

        await self.do(begin)

    async def set_speed(self, speed: float | None) -> None:
        """Set the speed [simulated seconds per real second]; None for full speed.

        Raises:
            ParameterError: If it is out of range.
        """
        await self.do(lambda sim: self.gate.set_speed(speed, sim.now_ns))

    # ---- checkpoints ----

    async def mark(self) -> None:
        """Take a checkpoint for `reset`."""
        self._mark = await self.do(lambda sim: sim.checkpoint())

    async def reset(self) -> None:
        """Restore the last checkpoint, or the initial state; time and programs go on."""

        def restore(sim: Simulation) -> None:
            self.hands.drop_all()
            self._leave_if_empty()
            sim.reset(self._mark)

        await self.do(restore)

    # ---- hands ----

    async def grab(self, owner: str, what: str, index: int) -> None:
        """Let the hand of `owner` take a thing.

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
        """Let the hand of `owner` drop what it holds."""

        def let_go(_sim: Simulation) -> None:
            if not self.hands.are_empty:
                self.hands.drop(owner)
                self._leave_if_empty()

        await self.do(let_go)

    def _leave_if_empty(self) -> None:
        """Remove the keeper from the gate when all hands are empty."""
        if self.hands.are_empty:
            self.gate.leave(self.hands.keep)

    def close(self) -> None:
        """End the programs and release the world."""
        self.gate.close()
        self.clear_away()
        self.programs.close()
        self.sim.gate = None


class NewsHandler(logging.Handler):
    """Log handler that shows warnings in the browsers of a desk.

    Args:
        desk: The desk.
    """

    def __init__(self, desk: Desk) -> None:
        super().__init__(logging.WARNING)
        self._desk = desk

    def emit(self, record: logging.LogRecord) -> None:
        """Show a log record."""
        self._desk.say(self.format(record))


def foreign_project(sim: Simulation) -> Project:
    """Return a project that describes a world built without one.

    Robots of an unknown kind become Kheperas; turrets of unknown classes are left out.
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
