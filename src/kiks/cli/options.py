"""Options that several commands have, in one wording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.errors import ParameterError, shown
from kiks.model.files import check_writable, make_folder

if TYPE_CHECKING:
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

ArenaFile = Annotated[str | None, typer.Option(help="Arena (.toml, .kiks, .kad) or picture; the classic box if none.")]
Robots = Annotated[int, typer.Option(help="Robots in the arena.", min=1, max=1000)]
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
PatienceS = Annotated[float, typer.Option("--patience", help="How long it may be silent, in real seconds.")]
Seed = Annotated[int, typer.Option(help="Seed: the same seed, the same run.", min=0)]


def written_file(param: typer.CallbackParam, value: Path | None) -> Path | None:
    """Check an option's file before the run whose result goes there: callback of every option that names one.

    Raises:
        ParameterError: If it could not be written.
    """
    if value is not None:
        check_writable(value, _name(param))
    return value


def new_file(param: typer.CallbackParam, value: Path | None) -> Path | None:
    """Check the file of an option that replaces none.

    Raises:
        ParameterError: If it is there or could not be written.
    """
    if value is not None:
        check_writable(value, _name(param), is_new=True)
    return value


def written_folder(param: typer.CallbackParam, value: Path | None) -> Path | None:
    """Make the folder of an option whose results go there.

    Raises:
        ParameterError: If nothing could be written into it.
    """
    if value is not None:
        make_folder(value, _name(param))
    return value


def _name(param: typer.CallbackParam) -> str:
    return param.opts[0] if param.opts[0].startswith("-") else param.opts[0].upper()


def load_arena(file: str | None) -> Arena:
    """Return the arena of a file, the classic box if there is none.

    Raises:
        ArenaError: If the file is no arena.
    """
    from kiks.model.arena import Arena

    return Arena.default() if file is None else Arena.load(file)


def fit_turrets(sim: Simulation, entries: list[str] | None) -> None:
    """Put turrets on robots.

    Raises:
        ParameterError: If an entry is no turret, or names no robot.
    """
    for entry in entries or []:
        name, number = parse_turret(entry, sim.robot_count)
        for robot in range(1, sim.robot_count + 1) if number is None else [number]:
            sim.fit(robot, name)


def parse_turret(entry: str, robot_count: int) -> tuple[str, int | None]:
    """Return the turret and the robot's number of 'gripper=2'; no number for all robots.

    Raises:
        ParameterError: If it has another form, or there is no such robot.

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
