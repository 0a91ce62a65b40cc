"""A session: one world at a time, shared by its clients."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from kiks.errors import LinkError, ParameterError
from kiks.model.arena import Arena
from kiks.model.project import Project
from kiks.recording.recorder import RunRecorder
from kiks.sim.from_project import spec_of
from kiks.sim.ring_buffer import RingBuffer
from kiks.sim.simulation import Simulation
from kiks.toolbox.given_robot import GivenRobot
from kiks.toolbox.preferences import Settings
from kiks.units import NS_PER_S

if TYPE_CHECKING:
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.show import Shown

WAIT_S = 0.05
"""Longest wait of one round [s of real time]."""

SLICE_NS = NS_PER_S // 50
"""Simulated time that passes in one piece while a program thinks [ns]."""

PATH_PERIOD_S = 0.04
"""Time between two points of a path [s]: KiKS moved its robot 25 times a second (kiks-behaviour.md 7.1)."""


COMMAND_MAX = 10_000
"""Longest command for Octave or MATLAB [characters]."""


class Interpreter(Protocol):
    """A program as the session sees it: an Octave or MATLAB."""

    number: int
    name: str
    typed: deque[str]

    def halt(self) -> None:
        """Stop the program."""

    def live(self, time_ns: int) -> bool:
        """Let time pass [ns] while the program thinks; return whether it did."""


class Session:
    """A world on a desk, with or without a browser.

    Args:
        ready: Prepares the engine; called once, before the first world.
        has_window: Whether the desk is shown in a browser.

    Attributes:
        settings: Settings of the next world.
        desk: The desk of the world; None before the first.
        given: The robot of its only program in a world that is there already; None: it begins worlds.
        clients: The programs that take part.
        owners: The client that owns each robot, by the robot's number.
        lock: Held while a client creates a world or takes a robot.
    """

    def __init__(self, *, ready: Callable[[], None] = lambda: None, has_window: bool = False) -> None:
        self.settings = Settings()
        self.desk: Desk | None = None
        self.given: GivenRobot | None = None
        self.clients: list[Interpreter] = []
        self.owners: dict[int, object] = {}
        self.lock = threading.RLock()
        self._ready = ready
        self._has_window = has_window
        self._shown: Shown | None = None
        self._has_world = threading.Event()
        self._traced: Simulation | None = None
        self._coarse_ns = 0
        self._recorder: RunRecorder | None = None

    @property
    def world(self) -> Simulation:
        """The world.

        Raises:
            LinkError: If there is none yet.
        """
        return self._present_desk().present.sim

    @property
    def has_begun(self) -> bool:
        """Whether it has a world, or a robot in a given one."""
        return self.desk is not None or self.given is not None

    @property
    def place(self) -> object:
        """What open ports belong to: the world, or the robot in a given one.

        Raises:
            LinkError: If there is none yet.
        """
        return self.given or self.world

    @property
    def url(self) -> str:
        """URL of the desk; an empty text if it is not shown."""
        return "" if self._shown is None else self._shown.url

    @property
    def thinking(self) -> str:
        """The policy for thinking times of its programs."""
        return self._present_desk().project.thinking if self.given is None else self.given.thinking

    def begin(self, project: Project, folder: Path) -> None:
        """Begin a world in place of the present one.

        Args:
            project: The project of the world.
            folder: The folder of its files.
        """
        visitors = self.settings.programs if self.settings.programs > 1 else 0
        with self.lock:
            self._check_is_here()
            if self.desk is None:
                self._ready()
                self.desk = self._new_desk(project, folder, visitors)
                self.desk.begin()
                if self._has_window:
                    self._show()
            else:
                self._end_recording()
                self.desk.folder = folder.resolve()
                self.desk.run.rules["visitors"] = visitors
                asyncio.run(self.desk.replace(project))
            self.owners.clear()
            self._has_world.set()

    def begin_arena(self, arena: Arena) -> None:
        """Begin the world of an arena with the present settings."""
        self.begin(self.settings.project_of(arena), self.settings.folder)

    def begin_file(self, path: str) -> None:
        """Begin the world of a file: a project with its own settings, or an arena with the present ones.

        The present settings may ask for a world without a robot in either case.
        """
        if path.lower().endswith(".kiks"):
            project = Project.load(path)
            self.begin(replace(project, robots=()) if self.settings.robots == 0 else project, Path(path).parent)
        else:
            self.begin_arena(Arena.load(path))

    # ---- what people do on the desk ----

    def halt(self) -> None:
        """Halt all programs of Octave and MATLAB."""
        for client in self.clients[:]:
            client.halt()

    def interpreters(self) -> dict[int, str]:
        """Return the names of these programs, each of which evaluates commands, by their numbers."""
        return {client.number: client.name for client in self.clients[:]}

    def evaluate(self, number: int, command: str) -> None:
        """Let one of them evaluate a command at its next request, or at its prompt."""
        client = next((each for each in self.clients[:] if each.number == number), None)
        if client is None:
            raise ParameterError(
                f"a command must be for a program that takes part, but program {number} has left. Choose another one."
            )
        if not 0 < len(command) <= COMMAND_MAX:
            raise ParameterError(
                f"a command must have 1 to {COMMAND_MAX} characters, but it has {len(command)}. Write a function and "
                "call it."
            )
        self.log(f">> {command}")
        client.typed.append(command)

    def log(self, text: str, over: int | None = None) -> int:
        """Write into the log of the desk, without the token of its address: a page shows that nowhere.

        Args:
            text: The text.
            over: Number of the line that it replaces if that is still the last one.

        Returns:
            Number of the last line, for `over`; 0 without a desk.
        """
        if self.desk is None:
            return 0
        text = text.replace(self.url, self.url.partition("?")[0]) if self.url else text
        self.desk.note(text, replaces=over is not None and 0 < over == self.desk.log.count)
        return self.desk.log.count

    def trace(self, *, for_new_port: bool = False) -> None:
        """Record the paths of all robots in this world from now on.

        Args:
            for_new_port: Whether a port is about to be opened. If it is the only one, and the paths are so long that
                points were dropped, they begin anew.
        """
        sim = self.world
        is_only = for_new_port and all(wire.holder is None for wire in sim.wires)
        if self._traced is not sim or (is_only and sim.now_ns > self._coarse_ns):
            self._traced = sim
            self._coarse_ns = sim.now_ns + int(self.settings.path_points * PATH_PERIOD_S * NS_PER_S)
            sim.record_paths(PATH_PERIOD_S, points_max=self.settings.path_points)

    def record(self, path: Path | None) -> None:
        """Record this world from now on, until it ends or the next call; with None, record no more."""
        with self.lock:
            recorder, self._recorder = self._recorder, None
            if recorder is not None:
                recorder.close()
            if path is not None:
                self._recorder = RunRecorder(self.world, path)

    def _end_recording(self) -> None:
        with suppress(ParameterError):  # it has ended by itself, with a warning
            self.record(None)

    def take_robot(self, owner: object, wanted: int) -> int:
        """Assign a robot to a client: the wanted, a free or a new one; return its number.

        Args:
            owner: The client.
            wanted: Number of the preferred robot.
        """
        with self.lock:
            desk = self._present_desk()
            sim = desk.present.sim
            robots: list[int] = [wanted, *range(1, sim.robot_count + 1)]
            for robot in robots:
                is_there = robot <= sim.robot_count
                if is_there and self.owners.get(robot, owner) is owner and sim.wires[robot - 1].holder is None:
                    self.owners[robot] = owner
                    return robot
            if desk.project.robots:
                plan, folder = desk.project.robots[-1], desk.folder
            else:
                plan, folder = self.settings.project_robot, self.settings.folder
            added = sim.add_robot(spec_of(plan, desk.project, folder))
            for turret in plan.turrets:
                sim.fit(added, turret)
            desk.project = replace(desk.project, robots=(*desk.project.robots, replace(plan, name="", program=None)))
            desk.renew_scene()
            self.mark()
            self.owners[added] = owner
            return added

    def release_robots(self, owner: object) -> None:
        """Let other clients take the robots of a client that leaves."""
        with self.lock:
            self.owners = {robot: client for robot, client in self.owners.items() if client is not owner}

    def mark(self) -> None:
        """Take a checkpoint."""
        if self.desk is not None:
            asyncio.run(self.desk.present.do(self.desk.mark))

    def reset(self) -> None:
        """Restore the checkpoint.

        Raises:
            LinkError: If there is no world.
        """
        desk = self._present_desk()
        asyncio.run(desk.present.do(desk.reset))

    def present_project(self) -> Project:
        """Return the project with the present poses.

        Raises:
            LinkError: If there is no world.
        """
        desk = self._present_desk()
        return asyncio.run(desk.present_project(desk.present))

    # ---- the thread that moves the world ----

    def round(self) -> None:
        """Move the world as far as its programs let it, and handle their requests.

        At real-time speeds, measured thinking time passes as it happens: the robot drives on while a person types the
        next command, and the command does not wait for that time afterwards.
        """
        if not self._has_world.wait(WAIT_S):
            return
        desk = self.desk
        assert desk is not None
        is_seen = desk.present.gate.speed is not None and desk.project.thinking == "live" and len(self.clients) == 1
        has_lived = is_seen and any(client.live(SLICE_NS) for client in self.clients)
        desk.programs.round(0 if has_lived else WAIT_S)
        desk.clear_away()

    def let_go(self) -> None:
        """Let time pass even if the world is paused, when all clients have left."""
        if self.desk is not None:
            self.desk.present.gate.close()

    def close(self) -> None:
        """End the world and all programs in it."""
        if self._recorder is not None:
            self._end_recording()
        if self._shown is not None:
            self._shown.close()
        elif self.desk is not None:
            self.desk.close()

    def _check_is_here(self) -> None:
        if self.given is not None:
            raise LinkError(self.given.why_not)

    def _present_desk(self) -> Desk:
        self._check_is_here()
        if self.desk is None:
            raise LinkError("there must be a world first, but none was begun. Call kiks(ARENA) or kiks_kopen.")
        return self.desk

    def _new_desk(self, project: Project, folder: Path, visitors: int) -> Desk:
        """Return the desk of the first world, where programs of Octave and MATLAB take part."""
        from kiks.desk.server.desk import Desk, OutsidePrograms
        from kiks.desk.server.rights import Rights
        from kiks.run import Run

        project = replace(project, speed=1.0 if self._has_window else None)
        desk = Desk(Run.of(project, folder, (), visitors=visitors), Rights.OWNER, folder=folder)
        desk.has_old_coordinates = True
        desk.project_of = lambda arena: self.settings.project_of(arena)
        desk.log = RingBuffer(self.settings.log_lines)
        desk.outside = OutsidePrograms(self.halt, self.interpreters, self.evaluate)
        return desk

    def _show(self) -> None:
        from kiks.desk.server.show import Shown

        assert self.desk is not None
        self._shown = Shown(self.desk)
        self._shown.browse()
