"""`kiks desk`, and `--desk` of other commands."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.job import Job, job_of
from kiks.cli.options import Address, WorldOptions, public_address_of
from kiks.cli.record import RecordFile, recorded
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError

if TYPE_CHECKING:
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.public_address import PublicAddress
    from kiks.desk.server.rights import Rights
    from kiks.sim.simulation import Simulation

WithDesk = Annotated[bool, typer.Option("--desk", help="Show the world in a browser, at first in real time.")]
CTRL_C_S = 0.5
"""Longest wait until Ctrl-C acts [s]."""

NoWait = Annotated[bool, typer.Option("--no-wait", help="Begin at once, without waiting for the first page.")]


def desk(
    world: WorldOptions,
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
    from kiks.desk.server.access import is_private
    from kiks.desk.server.rights import Rights

    public = public_address_of(address)
    words = program or []
    job = job_of(words[0] if words else None, words[1:], world, needs_program=False, fills_starts=True)
    speed = job.project.speed if speed is None else speed or None
    project = replace(job.project, thinking=thinking or job.project.thinking, speed=speed)
    rights = Rights(owns_world=True, may_run_programs=run_programs or is_private(host, public), may_edit=edit)
    opened = desk_for(replace(job, project=project), rights, folder)
    with recorded(opened.sim, record, programs=opened.run.files, goal=opened.run.project.goal):
        open_desk(opened, host=host, port=port, public=public, browser=browser, waits=not no_wait)


def desk_for(job: Job, rights: Rights, folder: Path | None = None, **options: Any) -> Desk:
    """Return a desk for what the command line names.

    Args:
        job: What it names.
        rights: What people may do there.
        folder: Where files are opened and saved; the folder where the command was started if left out.
        options: Those of `Run`.
    """
    from kiks.desk.server.desk import Desk

    folder = folder or Path()
    if not folder.is_dir():
        raise ParameterError(f"--folder must be a folder, but {str(folder)!r} is none. Create it first.")
    run = replace(job, folder=job.folder or folder).run(ready=ready_engine, **options)
    return Desk(run, rights, folder=folder)


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
