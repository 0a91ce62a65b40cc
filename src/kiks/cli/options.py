"""Options that several commands have, in one wording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kiks.errors import ParameterError

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
            f"{entry!r}. Example: gripper=2."
        )
    return name, int(number)
