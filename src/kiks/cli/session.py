"""`kiks session`."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.log import show_log
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import KiksError


def session(
    join: Annotated[
        int | None, typer.Option(help="Take part in the session of this number; 0: the one started last.")
    ] = None,
    where: Annotated[int | None, typer.Option(help="Only say where that session is found.")] = None,
    listen: Annotated[
        Path | None, typer.Option(help="Speak with nobody here; write into this new file where the session is found.")
    ] = None,
    window: Annotated[
        bool | None,
        typer.Option(
            envvar="KIKS_WINDOW", help="Show the desk in a browser; only where there is a screen if left out."
        ),
    ] = None,
) -> None:
    """Be the simulator of the toolbox for Octave and MATLAB, which starts this by itself.

    It is asked line by line on its standard input, and ends when the last program that takes part has gone.
    """
    # What is written there is an answer: whatever else prints shall not come in between.
    sink = os.dup(1)
    os.dup2(2, 1)
    # Ctrl-C in Octave is meant for the program there.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    show_log(is_quiet=True)
    try:
        if where is not None:
            from kiks.toolbox.host import find_door

            os.write(sink, find_door(where).line().encode())
        elif join is not None:
            from kiks.toolbox.host import find_door
            from kiks.toolbox.host import join as take_part

            take_part(find_door(join), 0, sink)
        else:
            _serve(listen, window, sink)
    except KiksError as error:
        from kiks.toolbox.words import frame

        text = f"kiks: {error}\n"
        os.write(sink, text.encode() if where is not None else frame(text))
        raise typer.Exit(2) from None


def _serve(listen: Path | None, window: bool | None, sink: int) -> None:
    from kiks.desk.screen import has_screen
    from kiks.toolbox.host import Host, write_door
    from kiks.toolbox.session import Session

    end_as_with_ctrl_c()
    host = Host(Session(ready=ready_engine, has_window=has_screen() if window is None else window))
    try:
        if listen is None:
            host.speak_on(0, sink)
        else:
            write_door(host.door, listen)
        host.run()
    except KeyboardInterrupt:
        pass
    finally:
        host.close()
    # Threads that still read are of no use any more.
    sys.stdout.flush()
    os._exit(0)
