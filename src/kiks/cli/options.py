"""Options and helpers that several commands share."""

from __future__ import annotations

import logging
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.errors import ParameterError, shown
from kiks.model.atomic_files import make_folder
from kiks.model.checks import ROBOTS_MAX

if TYPE_CHECKING:
    from kiks.learn.champion import Champion
    from kiks.model.arena import Arena
    from kiks.model.project import Project
    from kiks.ports.program_process import Command
    from kiks.sim.simulation import Simulation

ArenaFile = Annotated[
    str | None, typer.Option(help="Arena (.toml, .kad), picture, or project's world (.kiks); the classic box if none.")
]
Robots = Annotated[
    int | None,
    typer.Option(help="Robots in the arena; as many as a project has, else 1, if left out.", min=1, max=ROBOTS_MAX),
]
RobotKinds = Annotated[
    list[str] | None,
    typer.Option("--robot", help="Kind of robot: khepera, khepera_ii, or a file; once for all, or once for each."),
]
Turrets = Annotated[
    list[str] | None,
    typer.Option(
        "--turret", help="k213, gripper, radio, io or battle, for all robots; with a number, gripper=2, for that one."
    ),
]
WhenSilent = Annotated[
    str,
    typer.Option(help="A program that is silent while others wait: wait for it, drop it, or ignore: go on without it."),
]
PatienceS = Annotated[float, typer.Option("--patience", help="Time for which it may be silent [s of real time].")]
Seed = Annotated[int, typer.Option(help="Seed: the same seed, the same run.", min=0)]
SeedOrOwn = Annotated[
    int | None,
    typer.Option(help="Seed: the same seed, the same run; the own one of a project or champion, else 0.", min=0),
]


def written_folder(param: typer.CallbackParam, value: Path | None) -> Path | None:
    """Make the folder of an option whose results go there."""
    if value is not None:
        make_folder(value, param.opts[0])
    return value


def load_arena(file: str | None) -> Arena:
    """Return the arena of a file, the classic box if there is none; of a project say that nothing else is taken."""
    from kiks.model.arena import Arena

    if file is None:
        return Arena.default()
    arena = Arena.load(file)
    if is_project(file):
        say(f"the arena alone is taken from {file}; its robots, programs and settings are left out here.")
    return arena


def is_project(file: str | Path) -> bool:
    """Return whether a file's name is that of a project."""
    return str(file).lower().endswith(".kiks")


def load_world(file: str | None) -> tuple[Project, Path]:
    """Return the project of a file and its folder; a project of one Khepera if the file is another arena, or none."""
    from kiks.model.project import Project

    if file is not None and is_project(file):
        return Project.load(file), Path(file).parent
    return Project(load_arena(file)), Path()


def with_robots(project: Project, count: int | None, least: int) -> Project:
    """Return a project with the number of robots that the command line names.

    New robots are of the kind of the last, or Kheperas.

    Args:
        project: The project.
        count: Number of robots; None for the project's, or more if they are too few.
        least: Smallest number of robots.
    """
    from kiks.model.project import ProjectRobot

    robots = project.robots
    if count is not None and count < least:
        raise ParameterError(
            f"--robots must be at least {least}, for so many are named, but it was {count}. Leave it out."
        )
    count = max(len(robots) if count is None else count, least)
    kind = robots[-1].kind if robots else "khepera"
    more = (ProjectRobot(kind=kind),) * (count - len(robots))
    return replace(project, robots=robots[:count] + more)


def say(text: str) -> None:
    """Print a message for the user on the error output, apart from the results."""
    typer.echo(f"kiks: {text}", err=True)


@contextmanager
def progress_bar(work: str) -> Iterator[Callable[..., None]]:
    """Yield a function that shows on a terminal how much is done, as a share or of a number."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task(work, total=None)
        yield lambda done, count=1: progress.update(bar, completed=done, total=count)


def say_without_world(champion: Champion, arena: Arena | None) -> None:
    """Say so if a champion will drive in the default box because its file names no world."""
    if arena is None and champion.world is None:
        say("the champion's file names no world, so it drives in the default box. --arena names another arena.")


def fit_turrets(sim: Simulation, entries: list[str] | None) -> None:
    """Fit turrets to robots that do not have them."""
    from kiks.sim.turret_host import name_of

    for entry in entries or []:
        name, number = parse_turret(entry, sim.robot_count)
        for robot in range(1, sim.robot_count + 1) if number is None else [number]:
            if name not in map(name_of, sim.turrets(robot)):
                sim.fit(robot, name)


def parse_turret(entry: str, robot_count: int) -> tuple[str, int | None]:
    """Return the turret and the robot's number of 'gripper=2'; no number for all robots.

    Example:
        >>> parse_turret("gripper=2", 2), parse_turret("k213", 1)
        (('gripper', 2), ('k213', None))
    """
    name, equals, number = entry.partition("=")
    if not equals:
        return name, None
    if not (number.isascii() and number.isdigit() and 1 <= int(number) <= robot_count):
        raise ParameterError(
            f"--turret must be a turret, or one with = and a robot's number from 1 to {robot_count}, but it was "
            f"{shown(entry)}. Example: gripper=2."
        )
    return name, int(number)


class _Lines(logging.Handler):
    """Prints a line on the error output for each log entry."""

    def emit(self, record: logging.LogRecord) -> None:
        typer.echo(f"kiks: {self.format(record)}", err=True)


def show_log(*, is_quiet: bool = False) -> None:
    """Show the log; if quiet, only warnings and errors."""
    log = logging.getLogger("kiks")
    log.handlers = [_Lines()]
    log.setLevel(logging.WARNING if is_quiet else logging.INFO)


def parse_words(words: list[str]) -> list[Command]:
    """Return the programs that a command line names, each with its arguments.

    A word that names a .py file begins a program. A word with blanks that is no file is split like in a shell; if it
    begins with a .py file or -m, it is a program with all its arguments, which may be .py files themselves. The first
    program may also be -m and a module's name in words of their own, another file, or a folder with a `__main__.py`.
    """
    from kiks.ports.program_process import Command, module_command

    commands: list[Command] = []
    if words[:1] == ["-m"]:
        commands.append(module_command("".join(words[1:2]), []))
        words = words[2:]
    for word in words:
        parts = _split(word)
        if is_project(word):
            raise ParameterError(
                f"a project must come first, but {shown(word)} stands among the programs. Put it before them."
            )
        if Command(Path(word)).file.is_file() and (word.endswith(".py") or not commands):
            commands.append(Command(Path(word)))
        elif len(parts) > 1 and parts[0] == "-m":
            commands.append(module_command(parts[1], parts[2:]))
        elif len(parts) > 1 and parts[0].endswith(".py") and Path(parts[0]).is_file():
            commands.append(Command(Path(parts[0]), parts[1:]))
        elif commands:
            commands[-1].arguments.append(word)
        else:
            is_folder = Path(word).is_dir()
            found = (
                f"{shown(word)} is a folder without a __main__.py" if is_folder else f"there is no file {shown(word)}"
            )
            raise ParameterError(f"PROGRAM must be a Python file, but {found}. Give its path before its own arguments.")
    return commands


def _split(word: str) -> list[str]:
    """Return the parts of a quoted word; none if its quotes are not closed."""
    try:
        return shlex.split(word)
    except ValueError:
        return []
