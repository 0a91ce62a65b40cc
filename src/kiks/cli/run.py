"""`kiks run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.options import ArenaFile, RobotKind, Robots, Seed, load_arena
from kiks.errors import ParameterError


def run(
    program: Annotated[Path, typer.Argument(help="A Python program that talks to a Khepera through pyserial.")],
    arguments: Annotated[list[str] | None, typer.Argument(help="What the program finds in sys.argv.")] = None,
    arena: ArenaFile = None,
    robots: Robots = 1,
    robot: RobotKind = "khepera",
    seed: Seed = 0,
    thinking: Annotated[
        str, typer.Option(help="What the program's computing costs: none, fixed:MS, live, live:FACTOR, replay:FILE.")
    ] = "none",
    map_: Annotated[
        list[str] | None,
        typer.Option("--map", help="Port name and robot, like /dev/ttyS0=1; else in the order of opening."),
    ] = None,
    save_thinking: Annotated[
        Path | None, typer.Option(help="Write the thinking times of a live run here, for replay:FILE.")
    ] = None,
) -> None:
    """Run a program for a real robot on a simulated one, unchanged; its waits and sleeps cost no time.

    Its serial ports become simulated robots, and its time.sleep, time.time and time.monotonic simulated time.

    Example: kiks run --arena examples/arenas/maze.toml --map /dev/ttyUSB0=1 wander.py
    """
    ready_engine()
    from kiks.ports.unchanged import run_program
    from kiks.sim.simulation import Simulation

    if not program.is_file():
        raise ParameterError(
            f"PROGRAM must be a Python file, but {str(program)!r} is none. Give its path before its own arguments."
        )
    mapping = dict(parse_map(entry) for entry in map_ or [])
    sim = Simulation(
        load_arena(arena),
        robots=robots,
        seed=seed,
        thinking=thinking,
        robot=robot,
    )
    code = 1
    try:
        code = run_program(sim, program, arguments or [], mapping)
    finally:
        if save_thinking is not None:
            from kiks.clock.thinking import save_thinking as save

            save(sim.program.measured_ns, save_thinking)
        repeatable = (
            f"state {sim.state_hash()}" if not thinking.startswith("live") else "not repeatable: thinking was live"
        )
        typer.echo(f"kiks: {sim.time_s:.3f} s simulated, seed {seed}, {repeatable}", err=True)
    raise typer.Exit(code)


def parse_map(entry: str) -> tuple[str, int]:
    """Return port name and robot of '/dev/ttyS0=1'.

    Raises:
        ParameterError: If it has another form.

    Example:
        >>> parse_map("/dev/ttyS0=1")
        ('/dev/ttyS0', 1)
    """
    name, equals, number = entry.rpartition("=")
    if not (equals and name and number.isascii() and number.isdigit()):
        raise ParameterError(
            f"--map must be a port's name, = and a robot's number, but it was {entry!r}. Example: /dev/ttyUSB0=1."
        )
    return name, int(number)
