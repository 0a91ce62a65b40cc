"""`kiks room`: a class at its desks."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Annotated

import typer

from kiks.cli.desk import wait_for
from kiks.cli.engine_start import ready_engine
from kiks.cli.options import Address, Trusted, public_address_of, say
from kiks.ending import end_as_with_ctrl_c, leave_interrupted


def room(
    exercise: Annotated[
        Path, typer.Argument(help="A project, or the folder of an exercise: each desk begins with it.")
    ],
    students: Annotated[Path, typer.Option(metavar="FILE", help="The names, one on each line, or a CSV; at most 200.")],
    host: Annotated[str, typer.Option(help="Address to listen at: 0.0.0.0 for all of this computer's.")] = "127.0.0.1",
    port: Annotated[
        int | None, typer.Option(help="TCP port, 0 for a free one; 8123 if left out.", min=0, max=65535)
    ] = None,
    code: Annotated[
        str | None, typer.Option(help="Code that lets students in; that of the last time, or a random one if left out.")
    ] = None,
    folder: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Where students' files and what they hand in are kept.")
    ] = Path("room"),
    address: Address = None,
    trusted: Trusted = False,
) -> None:
    """Open a room: one address for a class, and a desk for each student.

    Students give the code and choose their names. The address that is printed for you shows all desks. Ctrl-C ends it;
    what students have written is there again the next time.

    Example: kiks room examples/exercises/lamp --students names.txt --host 0.0.0.0
    """
    from kiks.desk.room.entrance import check_code
    from kiks.desk.room.names import read_names
    from kiks.model.project import Project, project_file

    names, code = read_names(students), check_code(code) if code is not None else ""
    public = public_address_of(address)
    project, home = Project.load(exercise), project_file(exercise).parent
    ready_engine()
    from kiks.desk.room.page import open_room
    from kiks.desk.room.room import Room
    from kiks.ports.program_command import project_supervisor
    from kiks.sim.from_project import simulation_of
    from kiks.sim.supervision import Supervision

    # What is wrong with the goal is said before a class has come.
    supervision = Supervision(simulation_of(project, home), project_supervisor(project, home), project.goal)
    for doubt in supervision.doubts:
        say(doubt)
    supervision.close()
    opened = Room(project, home, names, folder, code=code, address=public, is_trusted=trusted)
    try:
        with open_room(opened, host=host, port=port):
            end_as_with_ctrl_c()
            typer.echo(f"For the class: {opened.address}   The code: {opened.code}")
            typer.echo(f"For you alone: {opened.lecturer_address}   Ctrl-C ends the room.")
            wait_for(threading.Event())
    except KeyboardInterrupt:
        leave_interrupted()
