"""`kiks serve`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.desk import WithDesk
from kiks.cli.engine_start import compile_everything, ready_engine
from kiks.cli.options import (
    ArenaFile,
    PatienceS,
    RobotKinds,
    Robots,
    SeedOrOwn,
    Turrets,
    WhenSilent,
    fit_turrets,
    load_world,
    show_log,
    with_robots,
)
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import LinkError

if TYPE_CHECKING:
    from kiks.desk.server.show import Shown
    from kiks.ports.endpoint import Endpoint
    from kiks.sim.simulation import Simulation

TCP_PORT = 10020
"""TCP port of robot 1, that of the next one for robot 2 and so on (khepera-protocol.md 3.3)."""


def serve(
    arena: ArenaFile = None,
    robots: Robots = None,
    robot: RobotKinds = None,
    turret: Turrets = None,
    seed: SeedOrOwn = None,
    speed: Annotated[float, typer.Option(help="Simulated seconds in a real one, for thinking live.")] = 1.0,
    thinking: Annotated[
        str, typer.Option(help="live: the world runs all the time; none or fixed:MS: it waits for each command.")
    ] = "live",
    programs: Annotated[
        int | None,
        typer.Option(help="How many programs begin together if the world waits for them; one a robot if left out."),
    ] = None,
    when_silent: WhenSilent = "ignore",
    patience: PatienceS = 2.0,
    baud: Annotated[
        int | None,
        typer.Option(
            help="Line speed until a program sets one; a project's or the robot's own, 9600, if left out.",
            min=75,
            max=4_000_000,
        ),
    ] = None,
    pty: Annotated[bool, typer.Option(help="Make a serial port for each robot.")] = True,
    link: Annotated[
        Path | None, typer.Option(help="Name of the serial port; with several robots a number is appended.")
    ] = None,
    tcp: Annotated[
        int | None, typer.Option(help="TCP port of robot 1, 0 for free ones; 10020, or a free one, if left out.")
    ] = None,
    rfc2217: Annotated[
        int | None, typer.Option(help="The same for ports that speak RFC 2217; none if left out.")
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address that the TCP ports listen at; this computer's own only.")
    ] = "127.0.0.1",
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but warnings.")] = False,
    desk: WithDesk = False,
) -> None:
    """Put simulated robots on real serial and TCP ports, for programs in any language.

    The program opens the port that is printed, in place of that of a real robot. Ctrl-C ends.

    Example: kiks serve --arena examples/arenas/maze.toml --link /tmp/khepera
    """
    from kiks.clock.patience import Patience
    from kiks.ports.server import Server
    from kiks.sim.from_project import simulation_of

    def say(text: str) -> None:
        if not quiet:
            typer.echo(text)

    show_log(is_quiet=quiet)
    kinds = robot or []
    project, home = load_world(arena)
    if any(each.program for each in project.robots):
        say(f"The programs of {arena} are left out: those take part that connect. kiks run {arena} starts them.")
    project = with_robots(project, robots, len(kinds))
    project = replace(project, seed=project.seed if seed is None else seed, baud=project.baud if baud is None else baud)
    sim = simulation_of(project, home, kinds=kinds, thinking="none")
    robots = sim.robot_count
    fit_turrets(sim, turret)
    if not quiet:
        ready_engine()
    compile_everything()  # or load it: before the first program waits for it
    ways: dict[int, list[Endpoint]] = {number: [] for number in range(1, robots + 1)}
    server = None
    shown = _show(sim, speed) if desk else None
    gate = None if shown is None else shown.desk.gate
    end_as_with_ctrl_c()  # so that the links are removed
    try:
        for number, endpoints in ways.items():
            say(f"Robot {number}")
            if pty:
                endpoints.append(_open_pty(number, robots, link, sim.wires[number - 1].line.baud))
                say(f"  serial port  {endpoints[-1].name}")
            endpoints.append(_open_tcp(number, tcp, host, say))
            say(f"  TCP          socket://{endpoints[-1].name}")
            if rfc2217 is not None:
                endpoints.append(_open_rfc2217(number, rfc2217, host))
                say(f"  RFC 2217     rfc2217://{endpoints[-1].name}")
        server = Server(
            sim,
            ways,
            speed=speed,
            thinking=thinking,
            programs=programs,
            when_silent=when_silent,
            patience_s=patience,
            pace=None if gate is None else gate.pace,
            new_patience=Patience if gate is None else gate.patience,
        )
        say(_what_is_repeatable(thinking, speed, robots if programs is None else programs))
        server.serve()
    except KeyboardInterrupt:
        state = "" if thinking == "live" else f" State {sim.state_hash()}."
        say(f"Stopped after {sim.time_s:.1f} s of simulated time.{state}")
    finally:
        if shown is not None:
            shown.close()
        if server is not None:
            server.close()
        else:
            for endpoints in ways.values():
                for endpoint in endpoints:
                    endpoint.close()


def _show(sim: Simulation, speed: float) -> Shown:
    """Show the world in a browser; time passes there as people want it."""
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.show import Shown

    shown = Shown(Desk(sim, speed=speed))
    typer.echo(f"The desk: {shown.url}")
    shown.browse()
    return shown


def _open_pty(number: int, robots: int, link: Path | None, baud: int) -> Endpoint:
    from kiks.ports.pty import PtyEndpoint, default_folder

    if link is None:
        return PtyEndpoint(default_folder() / str(number), baud=baud)
    return PtyEndpoint(link if robots == 1 else f"{link}{number}", baud=baud)


def _open_tcp(number: int, first: int | None, host: str, say: Callable[[str], None]) -> Endpoint:
    from kiks.ports.tcp import TcpEndpoint

    if first is not None:
        return TcpEndpoint(first + number - 1 if first else 0, host=host)
    try:
        return TcpEndpoint(TCP_PORT + number - 1, host=host)
    except LinkError:
        # Nobody asked for that number: a host that is refused is refused again, a busy port is replaced.
        endpoint = TcpEndpoint(0, host=host)
        say(f"  TCP port {TCP_PORT + number - 1} is busy; a free one takes its place.")
        return endpoint


def _open_rfc2217(number: int, first: int, host: str) -> Endpoint:
    from kiks.ports.rfc2217 import Rfc2217Endpoint

    return Rfc2217Endpoint(first + number - 1 if first else 0, host=host)


def _what_is_repeatable(thinking: str, speed: float, programs: int) -> str:
    if thinking == "live":
        return (
            f"The world runs at {speed:g} times real time. Not repeatable: when a program's bytes come depends on this "
            "computer; --thinking none makes it so."
        )
    if programs == 1:
        return (
            "The world waits for each command. Repeatable to the bit for a program that waits for each reply; its "
            "pauses take no time."
        )
    return (
        f"The world begins when {programs} programs are there, and waits for the commands of each. Repeatable to the "
        "bit for programs that wait for each reply; their pauses take no time."
    )
