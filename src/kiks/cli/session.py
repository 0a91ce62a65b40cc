"""`kiks session`."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import KiksError
from kiks.toolbox.framing import BUSY, Exchange, Heartbeat, write_all


def session(
    join: Annotated[
        int | None, typer.Option(help="Take part in the session of this number; 0: the one started last.")
    ] = None,
    where: Annotated[int | None, typer.Option(help="Only print the address of this session.")] = None,
    listen: Annotated[
        Path | None, typer.Option(help="Serve TCP clients only; write the address of the session into this new file.")
    ] = None,
    window: Annotated[
        bool | None,
        typer.Option(
            envvar="KIKS_WINDOW", help="Show the desk in a browser; only where there is a screen if left out."
        ),
    ] = None,
) -> None:
    """Serve the toolbox for Octave and MATLAB, which starts it.

    It takes requests, one per line, on its standard input, and ends when the last client has gone.
    """
    # Only answers go to the standard output: other output goes to the error output.
    sink = os.dup(1)
    os.dup2(2, 1)
    # Ctrl-C in Octave is meant for the program there. At a terminal, and before a first client comes, it is meant for
    # this process. Octave blocks all signals in its children.
    if listen is None and not os.isatty(0):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    if where is None and listen is None:
        # Octave waits for the greeting, and handles Ctrl-C when a frame has arrived: the first one comes at once.
        write_all(sink, BUSY)
    from kiks.toolbox.session_files import find_session

    exchange = Exchange(0, sink, close=lambda: _close(0, sink), parent=os.getppid())
    try:
        if where is not None:
            os.write(sink, find_session(where).line().encode())
        elif listen is not None:
            _serve(Heartbeat(), window, listen=listen)
        else:
            heartbeat = Heartbeat()
            heartbeat.acts.append(exchange.beat)
            if join is None:
                _serve(heartbeat, window, exchange=exchange)
            else:
                from kiks.toolbox.session_process import join as take_part

                take_part(find_session(join), exchange, 0, sink)
    except KiksError as error:
        text = f"kiks: {error}\n"
        if where is not None:
            os.write(sink, text.encode())
        else:
            exchange.reply(text)
        raise typer.Exit(2) from None


def _serve(
    heartbeat: Heartbeat, window: bool | None, *, exchange: Exchange | None = None, listen: Path | None = None
) -> None:
    from kiks.desk.screen import has_screen
    from kiks.toolbox.session import Session
    from kiks.toolbox.session_files import write_session_file
    from kiks.toolbox.session_process import SessionProcess

    end_as_with_ctrl_c()
    host = SessionProcess(Session(ready=ready_engine, has_window=has_screen() if window is None else window), heartbeat)

    def interrupt(number: int, frame: FrameType | None) -> None:
        if not host.was_joined:
            signal.default_int_handler(number, frame)

    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, interrupt)
    try:
        if exchange is not None:
            host.add(exchange)
        if listen is not None:
            write_session_file(host.address, listen)
        host.run()
    except KeyboardInterrupt:
        pass
    finally:
        host.close()
    # Threads that still read are not needed any more.
    sys.stdout.flush()
    os._exit(0)


def _close(*descriptors: int) -> None:
    """Redirect descriptors to /dev/null. They stay open so that no other file gets their numbers."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in descriptors:
        os.dup2(nothing, descriptor)
    os.close(nothing)
