"""`kiks serve`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.desk import WithDesk
from kiks.cli.engine_start import compile_everything, ready_engine
from kiks.cli.options import LINK_HELP, Silence, WorldOptions, show_log
from kiks.cli.outputs import leave_out
from kiks.cli.record import RecordFile, recorded
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import LinkError, ParameterError

if TYPE_CHECKING:
    from kiks.desk.server.show import Shown
    from kiks.ports.endpoint import Endpoint
    from kiks.ports.server import Server
    from kiks.sim.simulation import Simulation

TCP_PORT = 10020
"""TCP port of robot 1; robot 2 has the next one, and so on (khepera-protocol.md 3.3)."""


def serve(
    context: typer.Context,
    world: WorldOptions,
    silence: Silence,
    speed: Annotated[float, typer.Option(help="Simulated seconds per real second, for thinking live.")] = 1.0,
    thinking: Annotated[
        str, typer.Option(help="live: the world runs all the time; none or fixed:MS: it waits for each command.")
    ] = "live",
    programs: Annotated[
        int | None,
        typer.Option(help="Programs that begin together if the world waits for them; one per robot if left out."),
    ] = None,
    pty: Annotated[bool, typer.Option(help="Make a serial port for each robot.")] = True,
    link: Annotated[
        Path | None, typer.Option(help="Name of the serial port; with several robots a number is appended.")
    ] = None,
    radio_link: Annotated[str | None, typer.Option("--radio", metavar="LINK", help=LINK_HELP)] = None,
    tcp: Annotated[
        int | None, typer.Option(help="TCP port of robot 1, 0 for free ones; 10020, or a free one, if left out.")
    ] = None,
    rfc2217: Annotated[
        int | None, typer.Option(help="The same for ports that speak RFC 2217; none if left out.")
    ] = None,
    by_character: Annotated[
        bool,
        typer.Option(
            "--by-character",
            help="Send replies over TCP as a serial line does, character by character, instead of whole (live only).",
        ),
    ] = False,
    host: Annotated[
        str, typer.Option(help="Address that the TCP ports listen at; this computer's own only.")
    ] = "127.0.0.1",
    record: RecordFile = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but warnings.")] = False,
    desk: WithDesk = False,
) -> None:
    """Put simulated robots on real serial and TCP ports.

    Programs in any language can use them. The program opens the printed port in place of that of a real robot. Ctrl-C
    ends the server.

    Example: kiks serve --arena maze --link /tmp/khepera
    """
    from kiks.clock.thinking import parse_thinking
    from kiks.model.radio_link import LINKS
    from kiks.sim.from_project import simulation_of

    def say(text: str) -> None:
        if not quiet:
            typer.echo(text)

    if thinking == "live":
        leave_out(context, "with --thinking live", "programs", "when_silent", "patience")
    elif not desk:
        leave_out(context, f"with --thinking {thinking}", "speed")
    if thinking != "live":
        leave_out(context, f"with --thinking {thinking}, where replies come whole", "by_character")
    if not pty:
        leave_out(context, "with --no-pty", "link")
    if str(link) in LINKS:
        raise ParameterError(f"--link must be a name for the serial port, but it was '{link}'. Write --radio {link}.")
    show_log(is_quiet=quiet)
    project, home = replace(world, radio_link=radio_link).project()
    if any(each.program for each in project.robots):
        say(f"The programs of {world.arena} do not start here; other programs may connect. kiks run starts them.")
    parse_thinking(thinking)
    silence.rules()
    sim = simulation_of(project, home, thinking="none", ready=ready_engine)
    compile_everything()  # or load it, so that the first program does not wait for it
    ports = _Ports(sim, pty, link, tcp, rfc2217, host, by_character, say)
    server = None
    shown = _show_desk(sim, speed) if desk else None
    end_as_with_ctrl_c()  # so that the links are removed
    try:
        ports.open()
        server = _server(ports, shown, speed=speed, thinking=thinking, programs=programs, **silence.rules())
        say(_repeatability(thinking, speed, sim.robot_count if programs is None else programs))
        with recorded(sim, record=record):
            server.serve()
    except KeyboardInterrupt:
        state = "" if thinking == "live" else f" State {sim.state_hash()}."
        say(f"Stopped after {sim.time_s:.1f} s of simulated time.{state}")
    finally:
        if shown is not None:
            shown.close()
        (ports if server is None else server).close()


def _server(ports: _Ports, shown: Shown | None, **options: Any) -> Server:
    """Return the server of the ports, at the pace of the desk if there is one, where Halt drops all programs."""
    from kiks.ports.server import Server

    if shown is None:
        return Server(ports.sim, ports.endpoints, **options)
    from kiks.desk.server.desk import OutsidePrograms

    gate = shown.desk.present.gate
    server = Server(ports.sim, ports.endpoints, pace=gate.pace, new_patience=gate.patience, **options)
    shown.desk.outside = OutsidePrograms(server.drop_clients)
    return server


@dataclass
class _Ports:
    """The ports of all robots.

    Attributes:
        tcp: TCP port of robot 1, 0 for free ones; None for the default.
        rfc2217: The same for RFC 2217; None for no such ports.
        endpoints: The open ports by the robot's number.
    """

    sim: Simulation
    has_pty: bool
    link: Path | None
    tcp: int | None
    rfc2217: int | None
    host: str
    by_character: bool
    say: Callable[[str], None]
    endpoints: dict[int, list[Endpoint]] = field(default_factory=dict)

    def open(self) -> None:
        """Open the ports and print their names."""
        from kiks.ports.rfc2217 import Rfc2217Endpoint

        for number in range(1, self.sim.robot_count + 1):
            endpoints = self.endpoints[number] = []
            self.say(f"Robot {number}")
            if self.has_pty:
                endpoints.append(self._open_pty(number))
                self.say(f"  serial port  {endpoints[-1].name}")
            endpoints.append(self._open_tcp(number))
            self.say(f"  TCP          socket://{endpoints[-1].name}")
            if self.rfc2217 is not None:
                endpoints.append(Rfc2217Endpoint(_tcp_port_of(self.rfc2217, number), host=self.host))
                self.say(f"  RFC 2217     rfc2217://{endpoints[-1].name}")

    def close(self) -> None:
        """Close the ports that are open."""
        for endpoints in self.endpoints.values():
            for endpoint in endpoints:
                endpoint.close()

    def _open_pty(self, number: int) -> Endpoint:
        from kiks.ports.pty import PtyEndpoint, default_folder

        baud = self.sim.wires[number - 1].line.baud
        if self.link is None:
            return PtyEndpoint(default_folder() / str(number), baud=baud)
        return PtyEndpoint(self.link if self.sim.robot_count == 1 else f"{self.link}{number}", baud=baud)

    def _open_tcp(self, number: int) -> Endpoint:
        from kiks.ports.tcp import TcpEndpoint

        open_at = partial(TcpEndpoint, host=self.host, by_character=self.by_character)
        if self.tcp is not None:
            return open_at(_tcp_port_of(self.tcp, number))
        try:
            return open_at(_tcp_port_of(TCP_PORT, number))
        except LinkError:
            # The user did not ask for this number, so a free one will do. An invalid host fails again.
            endpoint = open_at(0)
            self.say(f"  TCP port {_tcp_port_of(TCP_PORT, number)} is busy; a free one takes its place.")
            return endpoint


def _tcp_port_of(first: int, number: int) -> int:
    """Return the TCP port of a robot, given that of robot 1; 0 stays 0."""
    return first + number - 1 if first else 0


def _show_desk(sim: Simulation, speed: float) -> Shown:
    """Show the world in a browser, where people may pause it or change its speed."""
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.show import Shown
    from kiks.run import Run

    shown = Shown(Desk(Run.in_world(sim, speed=speed)))
    typer.echo(f"The desk: {shown.url}")
    shown.browse()
    return shown


def _repeatability(thinking: str, speed: float, programs: int) -> str:
    if thinking == "live":
        return (
            f"The world runs at {speed:g} times real time. Not repeatable, because the time of a program's bytes "
            "depends on this computer; --thinking none makes it repeatable."
        )
    if programs == 1:
        begins, which = "waits for each command", "a program that waits for each reply; its"
    else:
        begins = f"begins when {programs} programs are there, and waits for the commands of each"
        which = "programs that wait for each reply; their"
    return f"The world {begins}. Repeatable to the bit for {which} pauses take no time."
