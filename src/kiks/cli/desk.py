"""`kiks desk`, and `--desk` of other commands."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.options import Address, World, is_project, parse_words
from kiks.cli.record import RecordFile, recorded
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, counted

if TYPE_CHECKING:
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.public_address import PublicAddress
    from kiks.model.project import Project
    from kiks.sim.simulation import Simulation

WithDesk = Annotated[bool, typer.Option("--desk", help="Show the world in a browser, at first in real time.")]
CTRL_C_S = 0.5
"""Longest wait until Ctrl-C acts [s]."""

NoWait = Annotated[bool, typer.Option("--no-wait", help="Begin at once, without waiting for the first page.")]


def desk(
    world: World,
    program: Annotated[
        list[str] | None,
        typer.Argument(help="Programs to begin with, in robots 1, 2, and so on; a project may stand first."),
    ] = None,
    thinking: Annotated[
        str | None, typer.Option(help="Thinking time of programs: none, fixed:MS, live, live:FACTOR.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Simulated seconds per real second; 0 for no limit.")] = None,
    folder: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Where projects and programs lie; no file outside it is opened or saved."),
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="TCP port of the page, 0 for a free one; 8123 if left out.", min=0, max=65535)
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address of the page. All but this computer's own need a token.")
    ] = "127.0.0.1",
    address: Address = None,
    run_programs: Annotated[
        bool, typer.Option("--run-programs", help="Let browsers on other computers start programs, too.")
    ] = False,
    browser: Annotated[bool, typer.Option(help="Open a browser.")] = True,
    edit: Annotated[
        bool, typer.Option("--edit", help="Change an exercise that is locked for students, as its lecturer.")
    ] = False,
    record: RecordFile = None,
    no_wait: NoWait = False,
) -> None:
    """Open the desk: a world in the browser.

    Drag robots, watch their sensors and their lines, type commands, draw arenas, write and run programs. Ctrl-C ends
    the desk.

    Example: kiks desk --arena maze
    """
    from kiks.desk.server.access import LOOPBACK
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.public_address import public_address
    from kiks.ports.program_process import commands_of, supervisor_of
    from kiks.sim.from_project import simulation_of

    public = None if address is None else public_address(address)
    words = list(program or [])
    file = words.pop(0) if words and is_project(words[0]) else None
    begin = parse_words(words)
    project, home = world.project(file, programs=len(begin), fills_starts=True)
    folder = folder or home
    if not folder.is_dir():
        raise ParameterError(f"--folder must be a folder, but {str(folder)!r} is none. Create it first.")
    if not is_project(file or world.arena or ""):
        home = folder
    project = replace(
        with_kinds(project, world.robot or []),
        thinking=thinking or project.thinking,
        speed=project.speed if speed is None else speed or None,
    )
    commands = commands_of(project, home)
    commands[: len(begin)] = begin
    sim = simulation_of(project, home, ready=ready_engine)
    shown = Desk(
        sim,
        project=project,
        speed=project.speed,
        folder=folder,
        home=home,
        owns_world=True,
        may_run_programs=run_programs or (host in LOOPBACK and public is None),
        commands=commands,
        supervisor=supervisor_of(project, home) if file is not None else None,
        is_held=not no_wait,
        may_edit=edit,
    )
    # A new start makes another world: the recording ends with the first one.
    with recorded(sim, record=record, programs=[each.file for each in commands if each is not None]):
        open_desk(shown, host=host, port=port, public=public, browser=browser, waits=not no_wait)


def with_kinds(project: Project, kinds: list[str]) -> Project:
    """Return a project with other kinds of robots, whose files lie in its folder: the desk saves it and begins anew."""
    robots = project.robots
    if kinds and len(kinds) not in (1, len(robots)):
        raise ParameterError(
            f"--robot must name one kind for all or one for each of {counted(len(robots), 'robot')}, but it named "
            f"{len(kinds)}."
        )
    named = kinds * len(robots) if len(kinds) == 1 else kinds or [each.kind for each in robots]
    return replace(project, robots=tuple(replace(each, kind=kind) for each, kind in zip(robots, named, strict=True)))


def open_desk(
    desk: Desk,
    *,
    host: str = "127.0.0.1",
    port: int | None = None,
    public: PublicAddress | None = None,
    browser: bool = True,
    waits: bool = True,
    opened: Callable[[], None] = lambda: None,
    programs_ended: Callable[[Simulation], None] = lambda sim: None,
) -> None:
    """Show a desk until Ctrl-C.

    Args:
        desk: The desk.
        host: Address of the page.
        port: TCP port of the page.
        public: The address that people open, if a proxy stands before the page.
        browser: Whether to open a browser.
        waits: Whether programs begin when the first page shows the world; otherwise at once.
        opened: Called when the page can be opened.
        programs_ended: Called with the world, locked, when its programs have ended.
    """
    from kiks.desk.server.show import Driver, Shown

    shown = Shown(desk, host=host, port=port, public=public)
    end_as_with_ctrl_c()
    typer.echo(f"The desk: {shown.url}   Ctrl-C ends it.")
    opened()
    try:
        if browser:
            shown.browse()
        if waits and (desk.has_beginners or desk.past is not None):
            typer.echo("The run begins when a page shows it; with --no-wait it begins at once.")
            wait_for(desk.is_seen)
        desk.begin()
        Driver(desk, programs_ended).run()
        wait_for(threading.Event())
    except KeyboardInterrupt:
        typer.echo(f"Stopped after {desk.sim.time_s:.1f} s of simulated time.")
    finally:
        shown.close()


def wait_for(event: threading.Event) -> None:
    """Wait for an event or Ctrl-C: a signal that comes just before a wait acts after it, so no wait may be long."""
    while not event.wait(CTRL_C_S):
        pass
