"""`kiks host`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.desk import open_desk
from kiks.cli.engine_start import ready_engine
from kiks.cli.options import Address, Silence, World, public_address_of, say, show_log
from kiks.cli.outputs import has_results, leave_out, tell_results
from kiks.cli.record import RecordFile, recorded, tell_run
from kiks.errors import ParameterError, shown
from kiks.model.checks import ROBOTS_MAX

if TYPE_CHECKING:
    from kiks.clock.gate import Gate
    from kiks.desk.server.desk import Desk
    from kiks.ports.program_command import ProgramCommand
    from kiks.ports.programs import Programs
    from kiks.sim.simulation import Simulation


@has_results
def host(
    context: typer.Context,
    world: World,
    silence: Silence,
    project: Annotated[
        str | None, typer.Argument(metavar="[PROJECT]", help="A project (.kiks); a world from the options if left out.")
    ] = None,
    players: Annotated[
        int | None,
        typer.Option(
            help="Robots for programs elsewhere, from robot 1 on; programs of the project drive the others. All if "
            "left out.",
            min=1,
            max=ROBOTS_MAX,
        ),
    ] = None,
    thinking: Annotated[
        str | None,
        typer.Option(
            help="none or fixed:MS: the world waits for each program; live: it goes on in real time. The project's, "
            "else none, if left out."
        ),
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Simulated seconds per real second; 0 for no limit.")] = None,
    host: Annotated[
        str, typer.Option(help="Address that programs and pages reach; 0.0.0.0 for those of other computers.")
    ] = "127.0.0.1",
    port: Annotated[
        int | None, typer.Option(help="TCP port, 0 for a free one; 8123 if left out.", min=0, max=65535)
    ] = None,
    address: Address = None,
    browser: Annotated[bool, typer.Option(help="Open a browser.")] = True,
    record: RecordFile = None,
) -> None:
    """Let programs on other computers drive the robots of a world.

    It prints an address for each robot. A program there opens it like a serial port, or is run, unchanged, by kiks run
    --join ADDRESS. The world begins when all programs are there, or when a person starts it on the desk. Ctrl-C ends
    it.

    Example: kiks host --arena office --players 2 --host 0.0.0.0
    """
    from kiks.desk.server.access import is_private
    from kiks.desk.server.desk import Desk, usual_programs
    from kiks.desk.server.players import Players
    from kiks.desk.server.server import SERVER
    from kiks.ports.program_command import project_commands, project_supervisor
    from kiks.sim.from_project import simulation_of, with_kinds

    show_log()
    public = public_address_of(address)
    read, home = world.project(project, programs=players or 0, fills_starts=True)
    robots = range(1, (players or len(read.robots)) + 1)
    policy = thinking or read.thinking
    if policy.startswith("replay"):
        raise ParameterError(
            f"thinking must be none, fixed:MS or live for programs elsewhere, but it was {shown(policy)}."
        )
    if policy.startswith("live"):
        leave_out(context, f"with --thinking {policy}, where the world waits for no program", "when_silent", "patience")
    rules = silence.rules()
    read = with_kinds(read, world.robot or ())
    read = replace(read, thinking=policy, speed=read.speed if speed is None else speed or None)

    def new_programs(desk: Desk, sim: Simulation, commands: Sequence[ProgramCommand | None], gate: Gate) -> Programs:
        return usual_programs(desk, sim, commands, gate, say=tell, players=robots, gate=gate, thinking=policy, **rules)

    def tell(text: str) -> None:
        say(text)
        desk.say(text)

    def open_door() -> None:
        for key, robot in door.robots.items():
            typer.echo(f"Robot {robot}: kiks://{SERVER.place()}/{robot}?token={key.token}")
        SERVER.let_in(door)
        typer.echo("The run begins when a program is there for each, or when a person starts it on the desk.")

    runs: list[dict[str, Any]] = []

    def end(sim: Simulation) -> None:
        door.pause()
        runs.append(tell_run(sim, policy, desk.programs.doubt))

    own = [None if robot in robots else command for robot, command in enumerate(project_commands(read, home), 1)]
    desk = Desk(
        simulation_of(read, home, ready=ready_engine),
        project=read,
        speed=read.speed,
        folder=home,
        owns_world=True,
        may_run_programs=is_private(host, public),
        commands=own,
        supervisor=project_supervisor(read, home) if project is not None else None,
        new_programs=new_programs,
        is_held=True,
    )
    door = Players(desk, robots, tell)
    with recorded(desk.sim, record=record):
        open_desk(
            desk,
            host=host,
            port=port,
            public=public,
            browser=browser,
            waits=False,
            opened=open_door,
            programs_ended=end,
        )
    tell_results(context, {"runs": runs})
