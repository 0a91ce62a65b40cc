"""`kiks run`."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.desk import WithDesk, open_desk
from kiks.cli.engine_start import ready_engine
from kiks.cli.log import show_log
from kiks.cli.options import (
    ArenaFile,
    PatienceS,
    RobotKinds,
    Seed,
    Turrets,
    WhenSilent,
    fit_turrets,
    load_arena,
    written_file,
)
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, shown

if TYPE_CHECKING:
    from kiks.clock.gate import Gate
    from kiks.ports.process import Command
    from kiks.ports.programs import Programs
    from kiks.sim.simulation import Simulation


def run(
    context: typer.Context,
    program: Annotated[
        Path, typer.Argument(help="A Python program that talks to a Khepera through pyserial, or a champion's file.")
    ],
    arguments: Annotated[
        list[str] | None,
        typer.Argument(help="What the program finds in sys.argv; each .py file among it begins one more program."),
    ] = None,
    arena: ArenaFile = None,
    robots: Annotated[int, typer.Option(help="Robots in the arena; at least one a program.", min=1, max=1000)] = 1,
    robot: RobotKinds = None,
    turret: Turrets = None,
    seed: Seed = 0,
    thinking: Annotated[
        str, typer.Option(help="What the program's computing costs: none, fixed:MS, live, live:FACTOR, replay:FILE.")
    ] = "none",
    map_: Annotated[
        list[str] | None,
        typer.Option("--map", help="Port name and robot, like /dev/ttyS0=1; else in the order of opening."),
    ] = None,
    save_thinking: Annotated[
        Path | None,
        typer.Option(help="Write the thinking times of a live run here, for replay:FILE.", callback=written_file),
    ] = None,
    when_silent: WhenSilent = "ignore",
    patience: PatienceS = 2.0,
    seconds: Annotated[float, typer.Option(help="How long a champion drives [s]; programs end by themselves.")] = 60.0,
    desk: WithDesk = False,
) -> None:
    """Run a program for a real robot on a simulated one, unchanged; its waits and sleeps cost no time.

    Its serial ports become simulated robots, and its time.sleep, time.time and time.monotonic simulated time. Several
    programs share a world, each in a process of its own: the first drives robot 1, the second robot 2, and so on.

    A file that `kiks evolve` has left lets its champion drive all robots.

    Example: kiks run --arena examples/arenas/maze.toml --map /dev/ttyUSB0=1 wander.py
    """
    ready_engine()
    show_log()
    # A program may go to another folder.
    record = None if save_thinking is None else save_thinking.absolute()
    if program.suffix == ".toml":
        from kiks.cli.drive import run_champion

        run_champion(program, **_options_of_champion(context, program, arguments or []))
        return
    kinds = robot or ["khepera"]
    from kiks.ports.programs import Programs
    from kiks.ports.turns import check_policy
    from kiks.sim.simulation import Simulation

    commands = parse_words([str(program), *(arguments or [])])
    mapping = dict(parse_map(entry) for entry in map_ or [])
    check_policy(when_silent, patience)
    sim = Simulation(
        load_arena(arena),
        robots=max(robots, len(kinds), len(commands)),
        seed=seed,
        thinking=thinking if len(commands) == 1 else "none",
        robot=kinds,
    )
    fit_turrets(sim, turret)
    host = partial(
        Programs,
        told=mapping,
        thinking=thinking,
        record=record,
        when_silent=when_silent,
        patience_s=patience,
        say=lambda text: typer.echo(f"kiks: {text}", err=True),
    )
    if desk:
        _run_on_desk(sim, commands, host, thinking)
        return
    end_as_with_ctrl_c()
    code, doubt = 1, ""
    try:
        if len(commands) == 1:
            code = _run_one(sim, commands[0], mapping, record)
        else:
            programs = host(sim, commands)
            code = programs.run()
            doubt = programs.doubt
    finally:
        _tell(sim, thinking, doubt)
    raise typer.Exit(code)


def _options_of_champion(context: typer.Context, file: Path, after: list[str]) -> dict[str, Any]:
    """Return the options for a champion, which has no arguments of its own: what stands after it is for us, too."""
    given = dict(context.params)
    with context.command.make_context("kiks run", [*after, str(file)], parent=context.parent) as later:
        for name, value in later.params.items():
            source = later.get_parameter_source(name)
            if source is not None and source.name == "COMMANDLINE":
                given[name] = value
    return {name: given[name] for name in ("arena", "robots", "turret", "seed", "seconds", "desk")}


def _tell(sim: Simulation, thinking: str, doubt: str) -> None:
    """Say how the run has ended, and whether it is repeatable."""
    if thinking.startswith("live"):
        doubt = "thinking was live"
    repeatable = f"not repeatable: {doubt}" if doubt else f"state {sim.state_hash()}"
    typer.echo(f"kiks: {sim.time_s:.3f} s simulated, seed {sim.seed}, {repeatable}", err=True)


def _run_on_desk(sim: Simulation, commands: list[Command], host: Callable[..., Programs], thinking: str) -> None:
    """Run programs in processes of their own in a world that browsers see, until Ctrl-C."""
    from kiks.desk.desk import Desk

    def host_at(sim: Simulation, commands: Sequence[Command | None], gate: Gate) -> Programs:
        return host(sim, commands, new_patience=gate.patience)

    desk = Desk(sim, commands=commands, new_programs=host_at)
    open_desk(desk, programs_ended=lambda sim: _tell(sim, thinking, desk.programs.doubt))


def _run_one(sim: Simulation, command: Command, told: dict[str, int], record: Path | None) -> int:
    """Run a program in this process; return its exit code."""
    from kiks.script.runner import run_here

    try:
        return run_here(sim, command.program, command.arguments, told)
    finally:
        if record is not None:
            from kiks.clock.thinking import save_thinking

            save_thinking(sim.program.measured_ns, record)


def parse_words(words: list[str]) -> list[Command]:
    """Return the programs that the words of a command line name, each with its arguments.

    A word that names a file ending in .py begins a program. A word with blanks that is no file is split as a shell
    does; if it begins with such a file, it is a program with all its arguments, which may then be .py files themselves.

    Raises:
        ParameterError: If the first word is no file.
    """
    from kiks.ports.process import Command

    commands: list[Command] = []
    for word in words:
        parts = _split(word)
        if Path(word).is_file() and (word.endswith(".py") or not commands):
            commands.append(Command(Path(word)))
        elif len(parts) > 1 and parts[0].endswith(".py") and Path(parts[0]).is_file():
            commands.append(Command(Path(parts[0]), parts[1:]))
        elif commands:
            commands[-1].arguments.append(word)
        else:
            raise ParameterError(
                f"PROGRAM must be a Python file, but {shown(word)} is none. Give its path before its own arguments."
            )
    return commands


def _split(word: str) -> list[str]:
    """Return the words of a quoted word; none if its quotes are not closed."""
    try:
        return shlex.split(word)
    except ValueError:
        return []


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
            f"--map must be a port's name, = and a robot's number, but it was {shown(entry)}. Example: /dev/ttyUSB0=1."
        )
    return name, int(number)
