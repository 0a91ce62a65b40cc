"""A warm worker of a crew: `python -m kiks.trials.worker SOCKET` takes orders and answers each."""

from __future__ import annotations

import gc
import logging
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path

from kiks.ending import end_with_parent
from kiks.errors import KiksError
from kiks.trials.crew import Answer
from kiks.trials.one_run import run_trial
from kiks.trials.sandboxes import Sandboxes

RUN, SHOW = "run", "show"
"""Kinds of orders: to run a trial, and to prepare the player of its recording."""


def _show(recording: Path) -> dict[str, str]:
    """Return what `web/grades.js` puts together to a page that plays a recording."""
    from kiks.export.page import page_template, player_values
    from kiks.export.run_frames import RunFrames
    from kiks.recording.recording import Recording

    frames = RunFrames.of(Recording(recording).log)
    section = page_template("run_player.html").render(player_values(frames))
    return {"section": section, "frames": frames.pack()}


def main() -> None:
    """Take orders from the socket until it ends."""
    end_with_parent()
    # Ctrl-C is for the process that hands out the orders, which ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.getLogger("kiks").setLevel(logging.CRITICAL)
    sandboxes = Sandboxes()
    kinds: dict[str, Callable[..., object]] = {RUN: partial(run_trial, sandboxes=sandboxes), SHOW: _show}
    gc.freeze()
    # Who has asked may have been killed.
    with suppress(EOFError, ConnectionError), Connection(int(sys.argv[1])) as connection:
        while True:
            kind, arguments = connection.recv()
            try:
                answer = Answer(kinds[kind](*arguments))
            except KiksError as error:
                answer = Answer(error=str(error))
            connection.send(answer)
    sandboxes.close()


if __name__ == "__main__":
    main()
    sys.exit(0)
