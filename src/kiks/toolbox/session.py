"""A session: one world at a time, and what all who take part in it share."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from kiks.clock.gate import Gate
from kiks.errors import LinkError
from kiks.model.arena import Arena
from kiks.model.project import Project, ProjectRobot
from kiks.ports.program_process import Command
from kiks.ports.programs import Programs
from kiks.sim.from_project import simulation_of, spec_of
from kiks.sim.simulation import Simulation
from kiks.toolbox.preferences import Settings
from kiks.units import NS_PER_S

if TYPE_CHECKING:
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.show import Shown

WAIT_S = 0.05
"""Longest time for which the world does not look around [s of real time]."""

SLICE_NS = NS_PER_S // 50
"""Simulated time that passes in one go while a program thinks [ns]."""

PATH_PERIOD_S = 0.04
"""Time between two points of a path [s]: KiKS moved its robot 25 times a second (kiks-behaviour.md 7.1)."""


class Client(Protocol):
    """What a session asks of a program that takes part in it; see `kiks.toolbox.session_client.SessionClient`."""

    def live(self, slice_ns: int) -> bool:
        """Let time pass as the wall clock does, while the program thinks; return whether any has."""
        ...


class Session:
    """A world on a desk, whether there is a browser or not.

    Args:
        ready: Called once, before the first world: gets the engine ready.
        has_window: Whether the desk is shown in a browser.

    Attributes:
        settings: What is wanted of the next world.
        desk: The world and all that belongs to it; None before the first.
        clients: The programs that take part.
        owners: Who has which robot as its own, by the robot's number.
        lock: Held by whoever makes a world or takes a robot.
    """

    def __init__(self, *, ready: Callable[[], None] = lambda: None, has_window: bool = False) -> None:
        self.settings = Settings()
        self.desk: Desk | None = None
        self.clients: list[Client] = []
        self.owners: dict[int, object] = {}
        self.lock = threading.RLock()
        self._ready = ready
        self._has_window = has_window
        self._shown: Shown | None = None
        self._has_world = threading.Event()
        self._traced: Simulation | None = None

    @property
    def world(self) -> Simulation:
        """The world.

        Raises:
            LinkError: If there is none yet.
        """
        if self.desk is None:
            raise LinkError("there must be a world first, but none was begun. Call kiks(ARENA) or kiks_kopen.")
        return self.desk.sim

    @property
    def url(self) -> str:
        """Where a browser finds the desk; nothing if it is not shown."""
        return "" if self._shown is None else self._shown.url

    def begin(self, project: Project, folder: Path) -> None:
        """Put a world in the place of the one that there is, if any.

        Args:
            project: The world.
            folder: Where its files lie.

        Raises:
            KiksError: If it is none.
        """
        from kiks.desk.server.desk import Desk

        with self.lock:
            if self.desk is None:
                self._ready()
                sim = simulation_of(project, folder)
                self.desk = Desk(
                    sim,
                    project=project,
                    # Who looks on wants to see something.
                    speed=1.0 if self._has_window else None,
                    folder=folder,
                    owns_world=True,
                    may_run_programs=True,
                    new_programs=self._new_programs,
                )
                if self._has_window:
                    self._show()
            else:
                self.desk.folder = folder.resolve()
                asyncio.run(self.desk.replace(project))
            self.owners.clear()
            self._has_world.set()

    def begin_arena(self, arena: Arena) -> None:
        """Begin the world of an arena with the settings that there are.

        Raises:
            KiksError: If they do not fit each other.
        """
        self.begin(self.settings.project_of(arena), self.settings.folder)

    def begin_default(self) -> None:
        """Begin the classic arena with the settings that there are."""
        self.begin_arena(Arena.default())

    def begin_file(self, path: str) -> None:
        """Begin the world of a file: a project as it is, any other arena with the settings that there are.

        Raises:
            ArenaError: If the file is none.
        """
        if path.lower().endswith(".kiks"):
            self.begin(Project.load(path), Path(path).parent)
        else:
            self.begin_arena(Arena.load(path))

    def trace(self) -> None:
        """See to it that paths are kept from now on, if they are not."""
        if self._traced is not self.world:
            self._traced = self.world
            self._traced.record_paths(PATH_PERIOD_S)

    def take_robot(self, owner: object, wanted: int) -> int:
        """Return the number of a robot that belongs to somebody from now on: the wanted, a free or a new one.

        Args:
            owner: Who it belongs to.
            wanted: Number of the robot that would be best.

        Raises:
            KiksError: If there is no room for one more.
        """
        with self.lock:
            sim, desk = self.world, self.desk
            assert desk is not None
            robots: list[int] = [wanted, *range(1, sim.robot_count + 1)]
            for robot in robots:
                is_there = robot <= sim.robot_count
                if is_there and self.owners.get(robot, owner) is owner and sim.wires[robot - 1].holder is None:
                    self.owners[robot] = owner
                    return robot
            plan = desk.project.robots[-1]
            came = sim.add_robot(spec_of(plan, desk.project, desk.folder))
            self._equip(came, plan)
            self.owners[came] = owner
            return came

    def _equip(self, robot: int, plan: ProjectRobot) -> None:
        """Give a robot that has come what the others carry, and let it be seen."""
        desk, sim = self.desk, self.world
        assert desk is not None
        for turret in plan.turrets:
            sim.fit(robot, turret)
        desk.project = replace(desk.project, robots=(*desk.project.robots, replace(plan, name="", program=None)))
        desk.tell()
        self.mark()

    def leave(self, owner: object) -> None:
        """Let the robots of somebody who goes belong to others."""
        with self.lock:
            self.owners = {robot: who for robot, who in self.owners.items() if who is not owner}

    def mark(self) -> None:
        """Remember where everything stands."""
        if self.desk is not None:
            asyncio.run(self.desk.mark())

    def reset(self) -> None:
        """Put everything back where it stood when that was remembered.

        Raises:
            LinkError: If there is no world.
        """
        _ = self.world
        assert self.desk is not None
        asyncio.run(self.desk.reset())

    def present_project(self) -> Project:
        """Return the project with everything where it is now.

        Raises:
            LinkError: If there is no world.
        """
        _ = self.world
        assert self.desk is not None
        return asyncio.run(self.desk.present_project())

    # ---- the thread that moves the world ----

    def round(self) -> None:
        """Do what may be done, and listen to those who take part; nothing moves unless one of them lets it.

        At a pace that people see, thinking that is measured passes as it happens: who has let a robot drive sees it
        drive while the next command is being typed, and does not wait afterwards for that to pass.
        """
        if not self._has_world.wait(WAIT_S):
            return
        desk = self.desk
        assert desk is not None
        is_seen = desk.gate.speed is not None and desk.project.thinking == "live" and len(self.clients) == 1
        has_lived = is_seen and any(client.live(SLICE_NS) for client in self.clients)
        desk.programs.round(0 if has_lived else WAIT_S)
        desk.clear_away()

    def let_go(self) -> None:
        """Let time pass even if the world is paused: nobody is there any more who could want that."""
        if self.desk is not None:
            self.desk.gate.close()

    def close(self) -> None:
        """End the world, and all programs in it."""
        if self._shown is not None:
            self._shown.close()
        elif self.desk is not None:
            self.desk.close()

    def _new_programs(self, sim: Simulation, commands: Sequence[Command | None], gate: Gate) -> Programs:
        return Programs(
            sim,
            commands,
            thinking=sim.thinking,
            say=self._say,
            is_heard=True,
            new_patience=gate.patience,
            visitors=self.settings.programs if self.settings.programs > 1 else 0,
        )

    def _say(self, text: str) -> None:
        if self.desk is not None:
            self.desk.say(text)

    def _show(self) -> None:
        from kiks.desk.server.show import Shown

        assert self.desk is not None
        self._shown = Shown(self.desk)
        self._shown.browse()
