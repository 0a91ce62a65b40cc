"""Options and helpers that several commands share."""

from __future__ import annotations

import logging
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from kiks.cli.command_line import ARENAS, opening
from kiks.cli.engine_start import ready_engine
from kiks.cli.outputs import is_quiet
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, counted, shown
from kiks.meant import nearest_file
from kiks.model.atomic_files import make_folder, path_of
from kiks.model.checks import ROBOTS_MAX
from kiks.model.package import where_from
from kiks.model.program_kinds import A_PROGRAM, ENDINGS
from kiks.model.robot_kinds import ROBOTS
from kiks.model.turrets import TURRETS

if TYPE_CHECKING:
    from kiks.desk.server.public_address import PublicAddress
    from kiks.model.arena import Arena
    from kiks.model.project import Project
    from kiks.ports.program_command import ProgramCommand
    from kiks.trials.trial import Outcome, Trial

OTHERS = (*ARENAS, ".mcap", ".csv", ".c", ".java")
"""Endings of files that are no programs which KiKS runs."""

OTHER_LANGUAGES = "Programs in other languages reach robots by kiks serve."

Seed = Annotated[int, typer.Option(help="Seed: the same seed, the same run.", min=0)]
Address = Annotated[
    str | None,
    typer.Option(metavar="URL", help="The address that people open, behind a proxy: https://school.example/robots/."),
]
SeedOrOwn = Annotated[
    int | None,
    typer.Option(help="Seed: the same seed, the same run; the own one of a project or champion, else 0.", min=0),
]

LINK_HELP = (
    "What is between program and robot: cable, bluetooth, wifi, or numbers such as "
    "latency_ms=60,jitter_ms=10,loss=0.01; a project's own, else cable, if left out."
)
RadioLinkName = Annotated[str | None, typer.Option("--link", metavar="LINK", help=LINK_HELP)]


def public_address_of(address: str | None) -> PublicAddress | None:
    """Read --address."""
    from kiks.desk.server.public_address import public_address

    return None if address is None else public_address(address)


def arena_names(incomplete: str) -> list[str]:
    """Return the arenas that come with KiKS, for a shell that completes a name."""
    from kiks.model.shipped import shipped_arenas

    return [name for name in shipped_arenas() if name.startswith(incomplete)]


@dataclass(frozen=True)
class WorldOptions:
    """The options that choose a world: an arena or a project, and what differs from it."""

    arena: Annotated[
        str | None,
        typer.Option(
            help="Arena by name (kiks arena list), .toml, .kad, picture, or a project's .kiks; the classic box if "
            "none.",
            autocompletion=arena_names,
        ),
    ] = None
    robots: Annotated[
        int | None,
        typer.Option(help="Robots in the arena; as many as a project has, else 1, if left out.", min=1, max=ROBOTS_MAX),
    ] = None
    robot: Annotated[
        list[str] | None,
        typer.Option(help=f"Kind of robot: {', '.join(ROBOTS)}, or a file; once for all, or once for each."),
    ] = None
    turret: Annotated[
        list[str] | None,
        typer.Option(help=f"One of {', '.join(TURRETS)}, for all robots; with a number, gripper=2, for that one."),
    ] = None
    seed: SeedOrOwn = None
    baud: Annotated[
        int | None,
        typer.Option(
            help="Line speed until a program sets one; a project's or the robot's own, 9600, if left out.",
            min=75,
            max=4_000_000,
        ),
    ] = None
    radio_link: RadioLinkName = None

    def project(
        self, file: str | None = None, *, programs: int = 0, fills_starts: bool = False
    ) -> tuple[Project, Path]:
        """Return the project that these options describe, and its folder.

        Args:
            file: A project, whose arena `arena` replaces.
            programs: Number of programs for robots 1, 2, and so on, named apart from the project.
            fills_starts: Whether each start of an arena has a robot, or only the first.
        """
        from kiks.model.project import Project, project_file

        read, home = self.arena if file is None else file, Path()
        if read is not None and is_project(read):
            project, home = Project.load(read), project_file(Path(read)).parent
        else:
            project = (Project.of_arena if fills_starts else Project)(load_arena(read))
        if file is not None and self.arena is not None:
            project = replace(project, arena=load_arena(self.arena))
        return self.changed(project, programs), home

    def changed(self, project: Project, programs: int = 0) -> Project:
        """Return a project with what the options change in it. New robots are of the kind of the last, or Kheperas."""
        from kiks.model.project import ProjectRobot
        from kiks.sim.from_project import with_kinds

        robots, least = list(project.robots), max(len(self.robot or ()), programs)
        if self.robots is not None and self.robots < least:
            raise ParameterError(
                f"--robots must be at least {least}, for so many are named, but it was {self.robots}. Leave it out."
            )
        count = max(len(robots) if self.robots is None else self.robots, least)
        kind = robots[-1].kind if robots else "khepera"
        robots = robots[:count] + [ProjectRobot(kind=kind)] * (count - len(robots))
        for entry in self.turret or []:
            name, number = parse_turret(entry, count)
            for index in range(count) if number is None else [number - 1]:
                if name not in robots[index].turrets:
                    robots[index] = replace(robots[index], turrets=(*robots[index].turrets, name))
        given: dict[str, Any] = {"seed": self.seed, "baud": self.baud, "link": self.radio_link}
        settings = {name: value for name, value in given.items() if value is not None}
        return with_kinds(replace(project, robots=tuple(robots), **settings), self.robot or ())


@dataclass(frozen=True)
class Silence:
    """The options for programs that are silent while others wait."""

    when_silent: Annotated[
        str,
        typer.Option(
            help="A program that is silent while others wait: wait for it, drop it, or ignore: go on without it."
        ),
    ] = "ignore"
    patience: Annotated[float, typer.Option(help="Time for which it may be silent [s of real time].")] = 2.0

    def rules(self) -> dict[str, Any]:
        """Return them as options of `Programs` and `Server`; raise if there are no such rules."""
        from kiks.ports.program_scheduler import check_policy

        check_policy(self.when_silent, self.patience)
        return {"when_silent": self.when_silent, "patience_s": self.patience}


def with_options(function: Callable[..., None]) -> Callable[..., None]:
    """Return a command that takes the fields of its dataclass parameters as options of their own.

    A parameter of the command takes the place of a field of its name, which keeps its default.
    """
    hints = get_type_hints(function, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    options: list[Parameter] = []
    for name, parameter in signature(function).parameters.items():
        group = groups.get(name)
        if group is None:
            options.append(parameter.replace(annotation=hints[name], kind=Parameter.KEYWORD_ONLY))
            continue
        kinds = get_type_hints(group, include_extras=True)
        options += [
            Parameter(each.name, Parameter.KEYWORD_ONLY, default=each.default, annotation=kinds[each.name])
            for each in fields(group)
            if each.name not in hints
        ]

    @wraps(function)
    def command(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{each.name: given.pop(each.name) for each in fields(group) if each.name not in hints})
        function(**given)

    command.__signature__ = Signature(options)  # type: ignore[attr-defined]
    command.__annotations__ = {each.name: each.annotation for each in options}
    return command


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
    arena = Arena.load(path_of(file, "--arena"))
    if is_project(file):
        say(f"the arena alone is taken from {file}; its robots, programs and settings are left out here.")
    return arena


def is_project(file: str | Path) -> bool:
    """Return whether a file's name is that of a project, or a folder is that of an exercise."""
    return str(file).lower().endswith(".kiks") or (Path(file) / "exercise.kiks").is_file()


ExerciseFile = Annotated[
    Path, typer.Argument(help="A project with a goal and a time limit (.kiks), or the folder of an exercise.")
]
Workers = Annotated[int | None, typer.Option(help="Worlds at once; one for each core if left out.", min=1, max=1000)]
Trusted = Annotated[
    bool, typer.Option("--trusted", help="Run the programs without a sandbox: they may do all that you may.")
]


def say(text: str) -> None:
    """Print a message for the user on the error output, apart from the results."""
    typer.echo(f"kiks: {text}", err=True)


@contextmanager
def progress_bar(work: str, each: str = "") -> Iterator[Callable[..., None]]:
    """Yield a function that shows on a terminal how much is done, as a share or of a number, unless --quiet.

    Args:
        work: What is done.
        each: What is counted, if the same command goes on after Ctrl-C: then people read how far it has come.
    """
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    progress = Progress(console=console, transient=True, disable=is_quiet() or not console.is_terminal)
    bar = progress.add_task(work, total=None)
    try:
        with progress:
            yield lambda done, count=1: progress.update(bar, completed=done, total=count)
    except KeyboardInterrupt:
        if each and (count := progress.tasks[bar].total) is not None:
            done = progress.tasks[bar].completed
            say(f"stopped after {done:.0f} of {counted(count, each)}. The same command goes on from there.")
        raise


def run_and_show(trials: Sequence[Trial], out: Path, work: str, *, workers: int | None = None) -> list[Outcome]:
    """Run trials, show on a terminal how far they are, and say how many are taken from an earlier run in the folder."""
    from kiks.trials.runner import run_trials

    count = len(trials)

    def tell_taken(taken: int) -> None:
        if taken:
            say(f"{taken} of {counted(count, 'run')} taken from {out}: nothing on which they depend has changed.")

    ready_engine()
    end_as_with_ctrl_c()
    with progress_bar(work, "run") as show:
        return run_trials(
            trials, out, workers=workers, on_outcome=lambda _, done: show(done, count), on_taken=tell_taken
        )


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
            f"{shown(entry)}. Example: gripper={robot_count}."
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


def parse_words(words: list[str]) -> list[ProgramCommand]:
    """Return the programs that a command line names, each with its arguments.

    A word that names a file of Python, Jupyter or Octave begins a program. A word with blanks that is no file is split
    like in a shell; if it begins with such a file or -m, it is a program with all its arguments. The first
    program may also be -m and a module's name in words of their own, another file, or a folder with a `__main__.py`.
    """
    from kiks.model.shipped import demonstrations, shipped_arenas
    from kiks.ports.program_command import ProgramCommand, module_command

    commands: list[ProgramCommand] = []
    if words[:1] == [""]:
        raise ParameterError("PROGRAM must be the name of a file, but it is empty. Write one.")
    if words[:1] == ["-m"]:
        commands.append(module_command("".join(words[1:2]), []))
        words = words[2:]
    for word in words:
        parts = _split(word)
        if is_project(word):
            raise ParameterError(
                f"a project must come first, but {shown(word)} stands among the programs. Put it before them."
            )
        if ProgramCommand(Path(word)).file.is_file() and (_is_program(word) or not commands):
            if Path(word).suffix.lower() in OTHERS:
                hint = f"Did you mean 'kiks {meant}'?" if (meant := opening(Path(word))) else OTHER_LANGUAGES
                raise ParameterError(f"PROGRAM must be {A_PROGRAM}, but {shown(word)} is none. {hint}")
            commands.append(ProgramCommand(Path(word)))
        elif len(parts) > 1 and parts[0] == "-m":
            commands.append(module_command(parts[1], parts[2:]))
        elif len(parts) > 1 and _is_program(parts[0]) and Path(parts[0]).is_file():
            commands.append(ProgramCommand(Path(parts[0]), parts[1:]))
        elif commands:
            commands[-1].arguments.append(word)
        else:
            is_folder = Path(word).is_dir()
            found = (
                f"{shown(word)} is a folder without a __main__.py" if is_folder else f"there is no file {shown(word)}"
            )
            raise ParameterError(
                f"PROGRAM must be {A_PROGRAM}, but {found}. "
                f"{where_from(word, 'Give its path before its own arguments.')}"
                f"{nearest_file(Path(word), [*demonstrations(), *(f'--arena {name}' for name in shipped_arenas())])}"
            )
    return commands


def _is_program(word: str) -> bool:
    return Path(word).suffix in ENDINGS


def _split(word: str) -> list[str]:
    """Return the parts of a quoted word; none if its quotes are not closed."""
    try:
        return shlex.split(word)
    except ValueError:
        return []
