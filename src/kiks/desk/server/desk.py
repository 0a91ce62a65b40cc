"""The desk: one world and the state that all its browsers share."""

from __future__ import annotations

import asyncio
import logging
import secrets
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol, TypeVar

from kiks.clock.gate import Gate
from kiks.debug.session import DebugSession
from kiks.desk.server.debugging import DeskDebugger
from kiks.desk.server.desk_world import DeskWorld
from kiks.desk.server.home import Home
from kiks.desk.server.looking_back import LookingBack
from kiks.desk.server.player import Player
from kiks.desk.server.rights import Rights
from kiks.desk.server.scripts import EXAMPLES
from kiks.desk.server.tries import Tries, packed_untried
from kiks.desk.server.turns import Share
from kiks.errors import KiksError, LinkError, ParameterError
from kiks.model.arena import Arena
from kiks.model.checks import CLOCK_END_NS
from kiks.model.exercise import STUDENT
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.ports.program_permission import Permission
from kiks.ports.programs import Programs
from kiks.ports.sandbox import Sandbox
from kiks.run import Run
from kiks.sim.from_project import described, project_of
from kiks.sim.judge import Judgement
from kiks.sim.ring_buffer import RingBuffer
from kiks.sim.simulation import Simulation
from kiks.trials.submissions import submissions_in
from kiks.units import ns_from_s

NEWS_LIMIT = 200
"""Number of messages to people that are kept."""

LOG_LIMIT = 1000
"""Number of lines of the log that are kept, unless a program asks for another."""

LOCKED = (
    "Walls, things and settings of this exercise must stay as they are, because it is locked. Its lecturer changes it "
    "with kiks desk --edit."
)
"""What people read who try to change them."""

Done = TypeVar("Done")


@dataclass(frozen=True)
class OutsidePrograms:
    """Programs in a world that its desk has not started. The functions are called in the server's thread.

    Attributes:
        halt: Halts the programs: each ends its wait, or fails when it uses its robot again.
        interpreters: Returns the names of those that evaluate commands, by their numbers.
        evaluate: Lets an interpreter evaluate a command.
    """

    halt: Callable[[], None] = lambda: None
    interpreters: Callable[[], dict[int, str]] = dict
    evaluate: Callable[[int, str], None] = lambda number, command: None


class Showing(Protocol):
    """What shows runs on a desk by itself, such as the games of a tournament."""

    async def poll(self, desk: Desk) -> None:
        """Show the next run when it is time; called about once a second."""

    def describe(self) -> dict[str, Any]:
        """Return what the board shows of it."""


class Desk:
    """A world on a desk.

    Requests to the world run between two of its events: in the thread that moves the world, or at once if no thread
    moves it. So the server never blocks on the world, and the world never waits for the server.

    Programs wait for `begin`.

    Args:
        run: What runs at first; its programs are always permitted, and its supervisor is.
        rights: What people may do here.
        folder: Where files are opened and saved; the current folder if left out.

    Attributes:
        run: What runs in the world that goes on.
        present: That world.
        looking: How people look back.
        project: The project it was built from, which names the programs that start with the world.
        home: Where the project lies, and its programs.
        programs_ended: Called with the locked world when all of them have ended: a run of an exercise is over then.
        is_seen: Set when a page has shown it for the first time.
        scene: Counts up whenever a thing appears, disappears or changes its looks.
        halt_count: How often Halt was pressed.
        outside: The programs in the world that this desk has not started.
        has_old_coordinates: Whether people see the coordinates of KiKS 2.2.0.
        project_of: Makes the project of an arena that people open.
        news: Messages to people, the newest last.
        log: These and what programs of Octave and MATLAB tell, each line with the time of day, the newest last.
        drafts: What people have written in programs and not saved, by file; None: in a new one. The newest is the last.
        tries: How a person's program has done in all cases of the exercise.
        debugging: The debugger of its programs.
        hand_in: Takes a file that a person hands in, and its name, with `is_again` if it was taken before and now has
            its run and its score; it is on the disk when that returns. A ParameterError has a message for that person.
            None: the browser downloads it.
        may_hand_in: Whether a file would be taken now.
        hall: The tournament whose games are shown; None without one.
        share: What its people have had of the processors for films.
        secret: What a page knows it by after the connection was lost.
    """

    def __init__(self, run: Run, rights: Rights = Rights.VISITOR, *, folder: Path | None = None) -> None:
        self.folder = (Path.cwd() if folder is None else folder).resolve()
        self.rights = rights
        self.has_old_coordinates = False
        self.project_of: Callable[[Arena], Project] = Project.of_arena
        self.scene = 0
        self.halt_count = 0
        self.news: RingBuffer[str] = RingBuffer(NEWS_LIMIT)
        self.log: RingBuffer[str] = RingBuffer(LOG_LIMIT)
        self.outside = OutsidePrograms()
        self.hand_in: Callable[..., None] | None = None
        self.may_hand_in = True
        self.hall: Showing | None = None
        self.share = Share()
        self.secret = secrets.token_urlsafe()
        self.drafts: dict[Path | None, str] = {}
        self._giving = asyncio.Lock()
        self._sandbox: Sandbox | None = run.rules.get("sandbox")
        self.tries = Tries(is_for_others=rights.is_for_others, is_trusted=self.is_trusted)
        self.debugging = DeskDebugger(self)
        self.is_seen = threading.Event()
        # What browsers show while the run is made again up to where a debugger wants to stand.
        self._still: DeskWorld | None = None
        self.looking = LookingBack(lambda: self.present, self.say)
        self._has_begun = False
        self.home = Home(run.folder)
        self.project = self.home.named(run.project, run.commands, run.supervisor)
        again = zip(self.home.commands(self.project), run.commands, strict=False)
        self._granted = [
            *run.commands,
            _supervisor_command(run.supervisor),
            *(own for own, given in again if given is not None),
        ]
        self._retired: list[Run] = []
        world = DeskWorld(run.sim, run.project.speed)
        self._supervise(run, world)
        self._take(run, world)

    def _take(
        self, run: Run, world: DeskWorld, *, is_branch: bool = False, session: DebugSession | None = None
    ) -> None:
        """Show another present world, with programs that begin with it unless it is a branch of the past.

        Args:
            run: What runs in it.
            world: The world.
            is_branch: Whether it is a branch.
            session: The debugger that follows its programs.
        """
        sim = world.sim
        # First, because it may fail: then the old world stays.
        programs = run.take_programs(
            starts=not is_branch,
            keeps_output=True,
            gate=world.gate,
            say=lambda text: self._tell_end(run, text),
            consult=None if session is None else session.consult,
        )
        programs.permission = self._permission()
        if session is not None:
            session.begin(run)
        if self._has_begun:
            programs.begin()
        self._still = (self._still or self.shown) if session is not None and session.is_going_back else None
        self.debugging.session = session
        self.looking.begin(sim, is_branch=is_branch)
        self.present, self.run = world, run
        self._mark = sim.checkpoint()
        sim.loop.gate = world.gate
        self.looking.stop()
        self.renew_scene()

    def _tell_end(self, run: Run, text: str) -> None:
        """Tell that a program has ended, at the terminal, too."""
        run.say(text)
        self.say(text)

    @property
    def programs(self) -> Programs:
        """The programs in the present world."""
        return self.run.programs

    @property
    def is_trusted(self) -> bool:
        """Whether people's programs run with the rights of this process, without a sandbox."""
        return self._sandbox is None

    @property
    def past(self) -> Player | None:
        """What is shown of the past; None while the present is shown."""
        return self.looking.past

    @property
    def shown(self) -> DeskWorld:
        """The world that browsers show: that of the past, if there is one."""
        return self.past or self._still or self.present

    def show_again(self) -> None:
        """Show the present world again, which a debugger has brought to where it wants to stand, at its speed."""
        if (still := self._still) is not None:
            self._still, present = None, self.present
            present.gate.ask(lambda: present.gate.set_speed(still.gate.speed, present.sim.now_ns))
            self.renew_scene()

    @property
    def sim(self) -> Simulation:
        """The world that browsers show."""
        return self.shown.sim

    @property
    def gate(self) -> Gate:
        """Where the time of that world passes."""
        return self.shown.gate

    @property
    def judgement(self) -> Judgement | None:
        """How the present run has ended; None while it is not decided, and without a goal."""
        judge = None if self.run.supervision is None else self.run.supervision.judge
        return None if judge is None else judge.judgement

    @property
    def has_beginners(self) -> bool:
        """Whether programs start with the world."""
        return any(command is not None for command in self.run.commands)

    def begin(self) -> None:
        """Start the programs of this world; those of later worlds start with them. A recording is played."""
        self._has_begun = True
        self.programs.begin()
        if (past := self.past) is not None:
            past.gate.ask(past.gate.go_on)

    def _permission(self) -> Permission:
        return Permission(
            self._granted, folders=(self.folder, EXAMPLES.parent), may_start_others=self.rights.may_run_programs
        )

    def _permitted(self, commands: Sequence[ProgramCommand | None]) -> list[ProgramCommand | None]:
        """Return the programs with None for each that may not start; people get a message about those."""
        permission, permitted = self._permission(), list(commands)
        for number, command in enumerate(commands):
            try:
                if command is not None:
                    permission.check(command)
            except ParameterError as error:
                self.say(f"A program was left out: {error}")
                permitted[number] = None
        return permitted

    def names(self) -> list[str]:
        """Return the names of the robots; a robot without a name has its number."""
        given = [robot.name for robot in self.project.robots]
        given += [""] * (self.sim.robot_count - len(given))
        return [name or str(number) for number, name in enumerate(given[: self.sim.robot_count], 1)]

    def sides(self) -> list[str]:
        """Return what a score calls the robots: their names, else those of their programs, else their numbers."""
        running = {each.robot: each.command for each in self.programs.handles}
        found = []
        for number, name in enumerate(self.names(), 1):
            command = running.get(number, self.attached(number))
            program = f"robot {number}" if command is None else command.title
            found.append(program if name == str(number) else name)
        return [f"{name} {number}" if found.count(name) > 1 else name for number, name in enumerate(found, 1)]

    def renew_scene(self) -> None:
        """Make all browsers load the scene again: a thing has appeared, disappeared or changed its looks."""
        self.scene += 1

    def show_old_coordinates(self, are_old: bool) -> None:
        """Show the coordinates and the numbers of sensors of KiKS 2.2.0, or those of this KiKS."""
        self.has_old_coordinates = are_old
        self.renew_scene()

    def say(self, text: str) -> None:
        """Show a message in all browsers; from any thread."""
        self.news.append(text)
        self.note(text)

    def note(self, text: str, *, replaces: bool = False) -> None:
        """Write into the log, or put the text in the place of its last line; from any thread."""
        now = time.strftime("%H:%M:%S")
        lines = [f"{now} {line}" for line in text.split("\n")]
        if replaces:
            self.log.replace_last(lines.pop(0))
        self.log.add(lines)

    async def do(self, act: Callable[[Simulation], Done]) -> Done:
        """Run a function with the locked world between two events, and return or raise its outcome.

        The function must not let time pass.
        """
        return await self.shown.do(act)

    async def change(self, act: Callable[[Simulation], Done]) -> Done:
        """Do that with a function that changes the world."""
        self.check_present()
        if act != self.mark:
            self.debugging.note_change()
        return await self.do(act)

    def check_present(self) -> None:
        """Check that the present is shown, which may be changed."""
        if self.past is not None:
            back = "'Back to now' or " if self.looking.has_present else ""
            raise ParameterError(
                f"You are looking at the past, which cannot be changed. Press {back}'Go on from here' below the arena "
                "first."
            )

    @property
    def is_locked(self) -> bool:
        """Whether walls, things and settings must stay as the exercise has them."""
        exercise = self.project.exercise
        return exercise is not None and exercise.is_locked and not self.rights.may_edit

    def check_unlocked(self) -> None:
        """Check that people may change walls, things and settings."""
        if self.is_locked:
            raise ParameterError(LOCKED)

    def try_all(self, command: ProgramCommand, hand_in: Callable[[bytes], object] | None = None) -> None:
        """Try a person's program in all cases of the project, while the world goes on; see `tries`.

        Args:
            command: The program.
            hand_in: Takes the file that is handed in, when all cases have come out; called in another thread.
        """
        self._permission().check(command)
        self._try(command, hand_in)

    def _try(self, command: ProgramCommand, hand_in: Callable[[bytes], object] | None) -> None:
        has_hidden = self.rights.may_edit or not self.is_locked
        project = self.home.alone(self.project)
        self.tries.begin(project, self.home.folder, command, has_hidden=has_hidden, hand_in=hand_in)

    async def give(self, command: ProgramCommand, name: str) -> None:
        """Hand a program in at once, and then try it: what comes out takes the place of what was handed in.

        Raises:
            ParameterError: If it is not taken.
        """
        hand_in = self.hand_in
        assert hand_in is not None
        data = await asyncio.to_thread(packed_untried, self.project, command)
        async with self._giving:  # another page may hand in, too, and the later program counts
            self.tries.stop()
            await self.tries.ended()
            await asyncio.to_thread(hand_in, data, name)
            self.try_all(command, partial(hand_in, name=name, is_again=True))

    async def give_again(self, file: Path) -> None:
        """Try what was handed in when this desk was last open, and was not tried to the end then."""
        assert self.hand_in is not None
        with TemporaryDirectory(prefix="kiks-again-") as place:
            (found,) = await asyncio.to_thread(submissions_in, [file], Path(place, "copies"))
            async with self._giving:
                if found.command is not None and self.tries.project is None:  # else its student was faster
                    self._try(found.command, partial(self.hand_in, name=file.name, is_again=True))

    # ---- another world ----

    async def replace(self, project: Project, folder: Path | None = None) -> None:
        """Replace the world by that of a project, with the permitted ones of its programs; the old world ends.

        Args:
            project: The project.
            folder: Where its programs lie; where those of the present project lie if left out.

        Raises:
            LinkError: If the world cannot be replaced.
            ParameterError: If it is another project, and the desk is for others.
        """
        if folder is not None and self.rights.is_for_others:
            raise ParameterError("This desk must stay with its exercise, so no other world can be opened here.")
        home = self.home if folder is None else Home(folder)
        await self._put(project, home.commands(project), _supervisor_command(home.supervisor(project)), home)
        self.home = home

    async def alter(self, project: Project) -> None:
        """Replace the world by that of its own project with another arena, other robots or other settings.

        Raises:
            LinkError: If the world cannot be replaced.
            ParameterError: If it is an exercise that is locked.
        """
        self.check_unlocked()
        await self.replace(project)

    async def start_over(self, session: DebugSession | None = None) -> None:
        """Begin again with the same world, seed and programs.

        Args:
            session: The debugger that follows the programs.

        Raises:
            LinkError: If the world cannot be replaced.
        """
        await self._put(self.project, self.run.commands, _supervisor_command(self.run.supervisor), self.home, session)

    async def _put(
        self,
        project: Project,
        commands: Sequence[ProgramCommand | None],
        supervisor: ProgramCommand | None,
        home: Home,
        session: DebugSession | None = None,
    ) -> None:
        """Begin the world of a project."""
        self._check_owns()
        if self._sandbox is not None:
            # A program that has broken a limit has ended it, and the programs below are not to wait for another one.
            await asyncio.to_thread(self._sandbox.warm)
        *commands, supervisor = self._permitted([*commands, supervisor])
        judge = None if supervisor is None else supervisor.program
        run = await asyncio.to_thread(self.run.again, project, home.folder, commands, judge)
        old = self.present
        was_paused = old.gate.is_paused
        is_hidden = session is not None and session.is_going_back
        world = DeskWorld(run.sim, None if is_hidden else (self._still or old).gate.speed)
        if was_paused and self.past is None and session is None:
            world.pause()
        # Its recording ends without a wait for the thread that moves it.
        await old.do(lambda _: old.pause())
        try:
            self._supervise(run, world)
            self._replace(run, world, session=session)
        except KiksError:
            run.close()
            if not was_paused:
                await old.do(lambda _: old.gate.go_on())
            raise
        self.project = project

    def _supervise(self, run: Run, world: DeskWorld) -> None:
        """Let the supervisor prepare a world, and let the world pause where a run of the project would end."""
        sim, project = world.sim, run.project

        def end(_code: int, message: str) -> None:
            how = supervision.decide()
            if not self.debugging.is_going_back:  # else people have seen it
                self.say(f"{message} {how}".strip())
                world.gate.pause(sim.now_ns)

        def end_time() -> None:
            sim.loop.end_at(CLOCK_END_NS, end_time)  # a person may let it go on
            end(0, f"The project ends after {project.seconds:g} s of simulated time.")

        if project.exercise is not None and not any(run.commands[STUDENT - 1 : STUDENT]):
            world.pause()  # its clock runs for a program
        supervision = run.supervise()
        supervision.end = end
        judge = None if project.exercise is None else supervision.judge

        def end_with_programs() -> None:
            if judge is not None and judge.judgement is None and self.present is world:
                end(0, "All programs have ended.")

        self.programs_ended = end_with_programs
        if project.seconds is not None:
            sim.loop.end_at(ns_from_s(project.seconds), end_time)

    def _replace(self, run: Run, world: DeskWorld, **how: Any) -> None:
        """Put another world in the place of the present one; see `_take`."""
        old, before = self.present, self.run
        self._take(run, world, **how)
        # Last: the thread that moves the world ends them at once, and then needs the new ones.
        self._retired.append(before)
        old.gate.close()

    def _check_owns(self) -> None:
        if not self.rights.owns_world:
            raise LinkError(
                "the world must be this desk's own to be replaced, but a program outside holds it. Begin it again "
                "there, or open another desk: kiks desk."
            )

    def clear_away(self) -> None:
        """End the programs and supervisors of replaced worlds; called by the thread that moves the world."""
        while self._retired:
            self._retired.pop().close()

    async def present_project(self, world: DeskWorld | None = None) -> Project:
        """Return the project with the poses in a world: the one that is shown if left out."""
        world, project = world or self.shown, self.project
        return replace(await world.do(lambda sim: project_of(sim, project)), speed=self.present.gate.speed)

    async def project_to_save(
        self, file: str, change: Callable[[Project], Project] = lambda project: project
    ) -> tuple[Project, dict[str, bytes]]:
        """Return the present project for a file, and what else has to be in its folder, by names.

        Args:
            file: Its name in the desk's folder; without its ending, that of the arena.
            change: Changes the project first.
        """
        changed, path = change(await self.present_project()), self.folder / file
        project, beside = await asyncio.to_thread(self.home.moved, changed, path.parent)
        pairs = zip(self.home.commands(changed), project.robots, strict=True)
        if left := [command.name for command, robot in pairs if command is not None and robot.program is None]:
            self.say(
                f"Not saved with the project: {', '.join(left)}. A project's program is a file, which may import "
                "the folder or module."
            )
        return replace(project, arena=replace(project.arena, name=path.stem)), beside

    # ---- programs of the project ----

    def attached(self, robot: int) -> ProgramCommand | None:
        """Return the program that starts with the world, and is saved with it, on a robot."""
        return next(iter(self.run.commands[robot - 1 : robot]), None)

    def attach(self, command: ProgramCommand | None, robot: int) -> None:
        """Let a program start with this world from now on, and be saved with it; None for none."""
        commands = self.run.commands
        commands += [None] * (robot - len(commands))
        commands[robot - 1] = command
        robots = list(self.project.robots)
        if robot <= len(robots):
            robots[robot - 1] = self.home.with_program(robots[robot - 1], command)
            self.project = replace(self.project, robots=tuple(robots))

    # ---- time ----

    @property
    def is_paused(self) -> bool:
        """Whether the time of the world that is shown stands still."""
        return self.gate.is_paused

    async def pause(self) -> None:
        """Pause simulated time."""
        world = self.shown
        await world.do(lambda _: world.pause())

    async def go_on(self) -> None:
        """Resume simulated time; where the past ends, the present goes on, and a recording starts again."""
        await self.looking.turn_at_the_end()
        world = self.shown
        await world.do(lambda _: world.gate.go_on())

    async def run_or_pause(self) -> None:
        """Resume simulated time, or pause it."""
        await (self.go_on() if self.is_paused else self.pause())

    async def step(self, seconds: float) -> None:
        """Let `seconds` of simulated time pass, then pause."""
        world = self.shown

        def step(_sim: Simulation) -> None:
            world.pause()
            world.gate.step(seconds)

        await world.do(step)

    async def set_speed(self, speed: float | None) -> None:
        """Set the speed [simulated seconds per real second]; None for full speed."""
        if (inf if speed is None else speed) > (most := self.rights.speed_max):
            raise ParameterError(
                f"The speed must be at most {most:g} x here, as many share this computer, but it was "
                f"{'full speed' if speed is None else f'{speed:g} x'}."
            )
        world = self.shown
        await world.do(lambda sim: world.gate.set_speed(speed, sim.now_ns))

    async def halt(self) -> None:
        """Stop all programs and all robots."""
        self.halt_count += 1
        self.check_present()
        for handle in list(self.programs.handles):
            self.programs.stop(handle)
        self.outside.halt()

        def stop(sim: Simulation) -> None:
            self.programs.dismiss_players("Halt was pressed on the desk of the host.")
            for wire in sim.wires:
                wire.stop(sim.now_ns)

        await self.do(stop)

    # ---- branches ----

    async def go_on_from_here(self) -> None:
        """Let the world of the past go on from its time as the desk's world, paused; its programs have hung up.

        Raises:
            LinkError: If the world cannot be replaced, or the present is shown.
        """
        self._check_owns()
        if (past := self.past) is None:
            raise LinkError("Cannot go on from the past: the present is shown. Move the time bar back first.")
        sim = await past.do(lambda _: past.let_go())
        world = DeskWorld(sim, self.present.gate.speed)
        world.pause()
        if len(self.project.robots) != sim.robot_count:
            self.project = described(sim)
        run = self.run.again(self.project, self.home.folder, self.run.commands, self.run.supervisor, sim)
        try:
            self._replace(run, world, is_branch=True)
        except KiksError:
            self.looking.stop()
            raise

    # ---- checkpoints ----

    def mark(self, sim: Simulation) -> None:
        """Take a checkpoint of the present world for `reset`; the caller holds its lock."""
        self._mark = sim.checkpoint()

    def reset(self, sim: Simulation) -> None:
        """Restore the last checkpoint, or the initial state; time and programs go on. The caller holds the lock."""
        self.present.drop_all()
        sim.reset(self._mark)

    # ---- hands ----

    async def grab(self, owner: str, what: str, index: int) -> None:
        """Let the hand of `owner` take a thing."""
        self.check_unlocked()
        world = self.present

        def take(_sim: Simulation) -> None:
            if world.hands.are_empty:
                world.gate.keep(world.hands.keep)
            try:
                world.hands.grab(owner, what, index)
            finally:
                world.leave_if_empty()

        await self.change(take)

    async def drop(self, owner: str) -> None:
        """Let the hand of `owner` drop what it holds."""
        world = self.shown

        def let_go(_sim: Simulation) -> None:
            if not world.hands.are_empty:
                world.hands.drop(owner)
                world.leave_if_empty()

        await world.do(let_go)

    def close(self) -> None:
        """End the programs, release the world, and forget its past."""
        self.tries.close()
        self.looking.close()
        self.present.gate.close()
        self.clear_away()
        self.run.close()
        with self.present.sim.lock:
            self.present.sim.loop.gate = None


class NewsHandler(logging.Handler):
    """Log handler that shows warnings in the browsers of a desk.

    Args:
        desk: The desk.

    Attributes:
        thread: Number of the only thread whose warnings it shows; None for all.
    """

    def __init__(self, desk: Desk) -> None:
        super().__init__(logging.WARNING)
        self._desk = desk
        self.thread: int | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Show a log record."""
        if self.thread in (None, record.thread):
            self._desk.say(self.format(record))


def _supervisor_command(supervisor: Path | None) -> ProgramCommand | None:
    return None if supervisor is None else ProgramCommand(supervisor)
