"""`kiks host`."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.desk import open_desk
from kiks.cli.engine_start import ready_engine
from kiks.cli.options import Address, Silence, WorldOptions, public_address_of, say, show_log
from kiks.cli.outputs import has_results, leave_out, tell_results
from kiks.cli.record import RecordFile, recorded, tell_run
from kiks.errors import ParameterError, shown
from kiks.model.checks import ROBOTS_MAX

if TYPE_CHECKING:
    from kiks.desk.server.players import Players
    from kiks.sim.simulation import Simulation


@has_results
def host(
    context: typer.Context,
    world: WorldOptions,
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
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.players import Players
    from kiks.desk.server.rights import Rights
    from kiks.ports.program_command import project_commands, project_supervisor
    from kiks.run import Run

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
    read = replace(read, thinking=policy, speed=read.speed if speed is None else speed or None)
    own = [None if robot in robots else command for robot, command in enumerate(project_commands(read, home), 1)]
    supervisor = project_supervisor(read, home) if project is not None else None
    run = Run(read, home, own, supervisor, thinking=policy, ready=ready_engine, say=say, players=robots, **rules)
    desk = Desk(run, Rights(owns_world=True, may_run_programs=is_private(host, public)), folder=home)
    runs: list[dict[str, Any]] = []

    def tell(text: str) -> None:
        say(text)
        desk.say(text)

    def end(sim: Simulation) -> None:
        door.pause()
        runs.append(tell_run(sim, policy, desk.programs.doubt))

    door = Players(desk, robots, tell)
    with recorded(desk.sim, record=record):
        open_desk(
            desk,
            host=host,
            port=port,
            public=public,
            browser=browser,
            waits=False,
            opened=partial(_open_door, door),
            programs_ended=end,
        )
    tell_results(context, {"runs": runs})


def _open_door(door: Players) -> None:
    """Print the address of each robot, and let programs in."""
    from kiks.desk.server.server import SERVER

    for key, robot in door.robots.items():
        typer.echo(f"Robot {robot}: kiks://{SERVER.place()}/{robot}?token={key.token}")
    SERVER.let_in(door)
    typer.echo("The run begins when a program is there for each, or when a person starts it on the desk.")
