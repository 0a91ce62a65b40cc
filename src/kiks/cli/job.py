"""What `kiks run` runs: programs in the world of an arena, of a project or demonstration, or of champions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kiks.cli.options import WorldOptions, is_project, load_arena, parse_words, say
from kiks.errors import ParameterError, shown

if TYPE_CHECKING:
    from kiks.model.project import Project
    from kiks.ports.program_command import ProgramCommand
    from kiks.run import Run

CHAMPION_S = 60.0
"""Simulated time for which a champion drives whose file does not say it [s]."""

TWO_SIDED = ("pursuit", "football")
"""Tasks of two sides, whose champions drive against each other until their supervisors end it."""


@dataclass(frozen=True)
class Job:
    """A world, and what drives its robots.

    Attributes:
        project: The world, with the changes of the command line.
        folder: Where the project lies; None for a world without one.
        commands: The program of each robot; None for a robot without one.
        supervisor: The file of the supervisor; None without one.
        demonstration: Name of the demonstration; empty for anything else.
        needs_little: Whether it is known that the program asks one robot among walls for no more than KiKS compiles for
            `ready_engine(as_needed=True)`.
    """

    project: Project
    folder: Path | None
    commands: list[ProgramCommand | None]
    supervisor: Path | None = None
    demonstration: str = ""
    needs_little: bool = False

    @property
    def home(self) -> Path:
        """Where the files that the project names are looked up."""
        return self.folder or Path()

    def run(self, **options: Any) -> Run:
        """Return the run of it; see `Run`."""
        from kiks.run import Run

        return Run(self.project, self.home, self.commands, self.supervisor, **options)


def takes_options_behind(word: str) -> bool:
    """Return whether a word is no program, whose arguments would follow, but a project, demonstration or champion."""
    return bool(demonstration_of(word)) or is_project(word) or _is_champion(word)


def demonstration_of(word: str) -> str:
    """Return the demonstration that a word names; empty if it names none, or a file or folder of a user."""
    return word if word.isidentifier() and not Path(word).exists() and word in _demonstrations() else ""


def job_of(
    word: str | None,
    arguments: Sequence[str],
    world: WorldOptions,
    *,
    needs_program: bool = True,
    fills_starts: bool = False,
) -> Job:
    """Return what the words after `kiks run` mean, or those after `kiks desk`.

    Args:
        word: A program, a project, a demonstration, a champion's file, or the folder of an evolution; None for a world
            alone.
        arguments: The words after it.
        world: The options that choose a world.
        needs_program: Whether a project must name a program; on a desk, a person starts one.
        fills_starts: Whether each start of an arena has a robot, or only the first.
    """
    from kiks.ports.program_command import project_commands, project_supervisor

    if word is None:
        project, home = world.project(fills_starts=fills_starts)
        folder = home if is_project(world.arena or "") else None
        return Job(project, folder, project_commands(project, home))
    if _is_champion(word):
        if arguments:
            raise ParameterError(
                f"a champion must drive all robots alone, but {shown(arguments[0])} follows it. Leave it out."
            )
        return _champion_job(Path(word), world)
    demonstration = demonstration_of(word)
    if not (demonstration or is_project(word)):
        named = parse_words([word, *arguments])
        project, home = world.project(programs=len(named), fills_starts=fills_starts)
        if any(each.program for each in project.robots):
            say(f"the programs of {world.arena} do not start here. kiks run {world.arena} starts them, too.")
        return Job(project, home if is_project(world.arena or "") else None, [*named])
    named = parse_words(list(arguments)) if arguments else []
    project, home = world.project(str(_demonstrations()[word]) if demonstration else word, programs=len(named))
    commands = project_commands(project, home)
    commands[: len(named)] = named
    while commands and commands[-1] is None:
        commands.pop()
    if not commands and needs_program:
        raise ParameterError(
            f"a project must name a program for a robot, but {word!r} names none. Name one after it: "
            f"kiks run {word} my_program.py."
        )
    supervisor = project_supervisor(project, home)
    has_more = any((named, supervisor, project.arena.balls, project.arena.cylinders, project.arena.lamps))
    needs_little = bool(demonstration) and len(project.robots) == 1 and not (project.robots[0].turrets or has_more)
    return Job(project, home, commands, supervisor, demonstration, needs_little)


def _demonstrations() -> dict[str, Path]:
    from kiks.model.shipped import demonstrations

    return demonstrations()


def _is_champion(word: str) -> bool:
    """Return whether a word names a champion's file, or the folder of an evolution."""
    folder = Path(word)
    if is_project(word):  # the folder of an exercise may hold arenas
        return False
    return word.endswith(".toml") or (any(folder.glob("*.toml")) and not (folder / "__main__.py").exists())


def _driver(files: Sequence[Path]) -> ProgramCommand:
    """Return the program that drives each robot with the controller of a champion's file."""
    from kiks.model.package import shipped
    from kiks.ports.program_command import ProgramCommand

    words = [word for number, file in enumerate(files, 1) for word in (str(file.absolute()), f"kiks://{number}")]
    return ProgramCommand(shipped("examples/players/drive.py"), words)


def _champion_job(path: Path, world: WorldOptions) -> Job:
    from kiks.learn.champion import Champion
    from kiks.model.data_file import read_file
    from kiks.model.limits import CHAMPION_FILE_BYTES_MAX
    from kiks.sim.from_project import with_kinds

    file = path / "champion.toml" if path.is_dir() else path
    if path.is_dir() and not file.exists():
        if (found := _two_sided_job(path, world)) is not None:
            return found
        raise ParameterError(
            f"PROGRAM must be a program, a project or the folder of an evolution, but {shown(str(path))} has neither a "
            "__main__.py nor a champion. Name a file in it."
        )
    data = read_file(file, f"Champion's file {str(file)!r}", bytes_max=CHAMPION_FILE_BYTES_MAX)
    if not re.search(rb"^\s*champion\s*=", data, re.MULTILINE):
        raise ParameterError(
            f"PROGRAM must be a program, a project or a champion, but {shown(str(file))} is none. An arena stands "
            "after --arena, a robot after --robot, a task after kiks evolve."
        )
    champion = Champion.load(file)
    arena = None if world.arena is None else load_arena(world.arena)
    if arena is None and champion.world is None:
        say("the champion's file names no world, so it drives in the default box. --arena names another arena.")
    project = world.changed(champion.project(arena))
    if not world.robot:
        project = with_kinds(project, [champion.robot])
    project = replace(project, seconds=project.seconds or CHAMPION_S)
    return Job(project, None, [_driver([file] * len(project.robots))])


def _two_sided_job(folder: Path, world: WorldOptions) -> Job | None:
    """Return the champions of both sides against each other; None if the folder has none."""
    import numpy as np

    from kiks.learn import tasks
    from kiks.learn.champion import Champion
    from kiks.model.arena import Pose
    from kiks.model.package import shipped
    from kiks.sim.from_project import with_kinds

    for task in map(tasks.load, TWO_SIDED):
        files = [folder / f"{side.name}.toml" for side in task.sides]
        if all(file.is_file() for file in files):
            break
    else:
        return None
    champions, seed = [Champion.load(file) for file in files], world.seed or 0
    arena = task.arenas[seed % len(task.arenas)] if world.arena is None else load_arena(world.arena)
    poses = task.with_changes(arenas=(arena,), worlds=1).start_poses(np.array([seed]))
    if poses is not None:
        arena = replace(arena, starts=tuple(Pose(*pose) for pose in poses[0].tolist()))
    sides = [number for number, side in enumerate(task.sides) for _ in range(side.robots)]
    projects = [each.project(arena) for each in champions]
    robots = tuple(projects[side].robots[0] for side in sides)
    project = world.changed(replace(projects[0], robots=robots, seconds=CHAMPION_S))
    project = with_kinds(project, [champions[side].robot for side in sides])
    commands: list[ProgramCommand | None] = [_driver([files[side] for side in sides])]
    supervisor = shipped(f"examples/demos/supervisors/{task.name}.py")
    return Job(project, None, commands, supervisor)
