"""From a project to a simulation and back."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any

from kiks.clock.program_clock import ProgramClock
from kiks.clock.thinking import own_policy
from kiks.engine.state import BALL
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.atomic_files import inside
from kiks.model.exercise import Case
from kiks.model.family import family
from kiks.model.free_disc import free_place
from kiks.model.project import Project, ProjectRobot
from kiks.model.radio_link import parse_link
from kiks.model.robot import RobotSpec, robot_names, specs_of
from kiks.model.thinking_policy import split_thinking
from kiks.sim.simulation import Simulation
from kiks.sim.turret_host import name_of
from kiks.sim.world import World


def simulation_of(
    project: Project,
    folder: str | Path = ".",
    *,
    thinking: str | None = None,
    program_count: int = 1,
    ready: Callable[[], object] = lambda: None,
) -> Simulation:
    """Return the world of a project at its start, with turrets fitted and lines set; programs are not begun.

    Args:
        project: The project.
        folder: Where it lies: robot files and replays are looked up from there.
        thinking: What programs' computing costs, in place of what the project says; a replay lies anywhere.
        program_count: Number of programs. Of several, each has a clock of its own, and the simulation has none; here
            they are only checked.
        ready: Called when all files are read, before the engine is needed.

    Example:
        >>> from kiks.model.project import ProjectRobot
        >>> sim = simulation_of(Project(robots=(ProjectRobot(turrets=("k213",)),), baud=38400))
        >>> sim.wires[0].line.baud, len(sim.image(1))
        (38400, 64)
    """
    home = Path(folder)
    specs = [spec_of(robot, project, home) for robot in project.robots]
    thinking = thinking_of(project, home) if thinking is None else thinking
    clocks = [ProgramClock(own_policy(thinking, number, program_count)) for number in range(1, program_count + 1)]
    ready()
    world = World(project.arena, specs, project.seed)
    sim = Simulation.of_world(world, thinking, clocks[0]) if program_count == 1 else Simulation.of_world(world)
    sim.loop.link = parse_link(project.link)
    for number, (robot, wire) in enumerate(zip(project.robots, sim.wires, strict=True), start=1):
        for turret in robot.turrets:
            sim.fit(number, turret)
        if project.baud is not None:
            wire.set_baud(project.baud)
        wire.keeps_baud = project.keeps_baud
    return sim


FAMILY_SEED = 0
"""Seed of the family whose robots have numbers in cases."""


def in_case(project: Project, case: Case, folder: Path) -> Project:
    """Return a project as a case changes it, with neither cases nor an exercise.

    Args:
        project: The project.
        case: One of its cases, or another.
        folder: Where the project lies: robot files and arenas are looked up from there.

    Example:
        >>> case = Case(seed=7, baud=38400, family=2)
        >>> made = in_case(Project(), case, Path())
        >>> made.seed, made.baud, sorted(made.robots[0].changes)
        (7, 38400, ['body', 'motor', 'proximity'])
    """
    arena = project.arena if case.arena is None else _case_arena(case.arena, folder)
    if case.start is not None:
        arena = replace(arena, starts=(case.start, *arena.starts[1:]))
    robots = project.robots
    if case.family:
        robots = tuple(_imperfect(robot, project, case.family, folder) for robot in robots)
    names = ("seed", "baud", "thinking", "link")
    changes = {name: value for name in names if (value := getattr(case, name)) is not None}
    # The case tries a speed: a program that set another one at its start would undo that.
    changes["keeps_baud"] = project.keeps_baud or case.baud is not None
    return replace(project, arena=arena, robots=robots, cases=(), exercise=None, **changes)


def _case_arena(name: str, folder: Path) -> Arena:
    """Return an arena of a case: one that comes with KiKS, or a file in the project's folder."""
    return Arena.load(inside(folder, name, "arena") if Path(name).suffix else name)


def _imperfect(robot: ProjectRobot, project: Project, number: int, folder: Path) -> ProjectRobot:
    """Return a robot of a project as the imperfect one with a number."""
    exact = spec_of(robot, project, folder)
    # A larger family begins with the same robots.
    made = family(exact, number, seed=FAMILY_SEED)[-1]
    changes = {name: robot.changes.get(name, {}) | values for name, values in _changes(exact, made).items()}
    return replace(robot, changes=robot.changes | changes)


def with_kinds(project: Project, kinds: Sequence[str | RobotSpec]) -> Project:
    """Return a project whose robots are of other kinds: of those that come with KiKS, with what differs in the project.

    Args:
        project: The project.
        kinds: One for all or one for each, names, files or specs; none for those of the project.

    Example:
        >>> wide = RobotSpec.load("khepera_ii").with_changes(body__diameter_mm=80.0)
        >>> robot = with_kinds(Project(), [wide]).robots[0]
        >>> robot.kind, robot.changes
        ('khepera_ii', {'body': {'diameter_mm': 80.0}})
    """
    if not kinds:
        return project
    known = {name: RobotSpec.load(name) for name in robot_names()}
    robots = []
    for robot, given in zip(project.robots, specs_of(kinds, len(project.robots), project.response), strict=True):
        # Its response needs one of these sections at most, and no robot that comes with KiKS has both.
        response = given.proximity.response
        spec = replace(
            given,
            curve=given.curve if response == "curve" else None,
            reflection=given.reflection if response == "reflection" else None,
        )
        alike = [
            (name, each)
            for name, each in known.items()
            if each.kind == spec.kind and _sections(spec) <= _sections(each)
        ]
        found = {name: _changes(each, spec) for name, each in alike}
        # The one that the file was a copy of, most likely.
        kind = min(found, key=lambda name: sum(map(len, found[name].values())))
        name = "" if spec.name == known[kind].name else spec.name
        robots.append(replace(robot, kind=kind, changes=found[kind], kind_name=name))
    return replace(project, robots=tuple(robots))


def _sections(spec: RobotSpec) -> set[str]:
    return {name for name, value in vars(spec).items() if is_dataclass(value)}


def _changes(old: RobotSpec, new: RobotSpec) -> dict[str, dict[str, Any]]:
    """Return what of a kind of robot is another than in an old one: the keys of each section and their values."""
    found = {}
    for name in sorted(_sections(new)):
        before, after = vars(getattr(old, name)), vars(getattr(new, name))
        if changed := {key: value for key, value in after.items() if value != before[key]}:
            found[name] = changed
    return found


def spec_of(robot: ProjectRobot, project: Project, folder: Path) -> RobotSpec:
    """Return what a robot of a project is.

    Args:
        robot: The robot.
        project: The project, whose response and noise are its own.
        folder: Where the project lies.
    """
    path = inside(folder, robot.kind, "kind") if robot.kind.lower().endswith(".toml") else robot.kind
    spec = RobotSpec.load(path, response=project.response)
    if robot.changes:
        tables = robot.changes.items()
        spec = spec.with_changes(
            **{f"{section}__{key}": value for section, values in tables for key, value in values.items()}
        )
    if robot.brightness is not None:
        spec = spec.with_changes(body__brightness=robot.brightness)
    if robot.kind_name:
        spec = replace(spec, name=robot.kind_name)
    return spec if project.noise else spec.without_noise()


def thinking_of(project: Project, folder: Path) -> str:
    """Return what the computing of a project's programs costs; a replay with its whole path."""
    kind, file = split_thinking(project.thinking)
    return f"{kind}:{inside(folder, file, 'replay')}" if isinstance(file, str) else project.thinking


def project_of(sim: Simulation, project: Project) -> Project:
    """Return the project with everything where it is now: robots start there, bodies and lamps too.

    Places are rounded to a thousandth of a millimetre, headings to a thousandth of a degree. What a gripper holds up
    goes to the nearest place with room.

    Args:
        sim: A simulation of the project, or of one with as many robots.
        project: Where all the rest comes from.
    """
    with sim.lock:
        poses, bodies, lamps = sim.poses(), sim.bodies(), sim.world.lamps.copy()
        arena, radii_mm = sim.arena, [spec.body.radius_mm for spec in sim.specs]
    starts = [rounded_pose(*pose) for pose in poses.tolist()]
    discs = [(pose.x_mm, pose.y_mm, radius_mm) for pose, radius_mm in zip(starts, radii_mm, strict=True)]
    discs += [_disc(body) for body in bodies if not body["is_lifted"]]
    balls: list[Ball] = []
    cylinders: list[Cylinder] = []
    for body in bodies:
        x_mm, y_mm, radius_mm = _disc(body)
        # A project has no body in the air: it would begin inside whatever is below it.
        if body["is_lifted"]:
            x_mm, y_mm = free_place(arena, discs, radius_mm, (x_mm, y_mm), "what a gripper holds up")
            discs.append((x_mm, y_mm, radius_mm))
        place = (round(x_mm, 3), round(y_mm, 3), radius_mm, float(body["friction_mm_s2"]), int(body["brightness"]))
        if body["what"] == BALL:
            balls.append(Ball(*place))
        else:
            cylinders.append(Cylinder(*place))
    hung = [Lamp(round(x_mm, 3), round(y_mm, 3), power_w, is_on != 0) for x_mm, y_mm, power_w, is_on in lamps.tolist()]
    # Without robots, the arena's starts wait for those to come.
    kept = tuple(starts) or arena.starts
    return replace(
        project, arena=replace(arena, starts=kept, lamps=tuple(hung), balls=tuple(balls), cylinders=tuple(cylinders))
    )


def described(sim: Simulation) -> Project:
    """Return a project of a simulation that was made without one, with everything where it is now.

    Robots of an unknown kind become Kheperas; custom turrets are left out.
    """
    known = {RobotSpec.load(kind): kind for kind in robot_names()}
    robots = tuple(
        ProjectRobot(
            kind=known.get(spec, "khepera"),
            turrets=tuple(name for each in sim.turrets(number) if (name := name_of(each)) is not None),
        )
        for number, spec in enumerate(sim.specs, 1)
    )
    return project_of(sim, Project(sim.arena, robots=robots, seed=sim.seed, thinking=sim.thinking, link=sim.link))


def rounded_pose(x_mm: float, y_mm: float, heading_rad: float) -> Pose:
    """Return a pose that a file, which holds degrees, gives back to the bit.

    Example:
        >>> rounded_pose(100.00049, 50.0, -1e-9)
        Pose(x_mm=100.0, y_mm=50.0, heading_rad=6.283185307179586)
    """
    return Pose(round(x_mm, 3), round(y_mm, 3), math.radians(round(math.degrees(heading_rad) % 360, 3)))


def _disc(body: Any) -> tuple[float, float, float]:
    return float(body["x_mm"]), float(body["y_mm"]), float(body["radius_mm"])
