"""A warm worker of a crew: `python -m kiks.trials.worker` takes orders and answers each, in a line."""

from __future__ import annotations

import gc
import json
import logging
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from kiks.ending import end_with_parent
from kiks.errors import KiksError
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.trials.one_run import run_trial
from kiks.trials.sandboxes import Sandboxes
from kiks.trials.trial import Trial

RUN, SHOW = "run", "show"
"""Kinds of orders: to run a trial, and to prepare the player of its recording."""


def packed(trial: Trial, folder: Path) -> str:
    """Return a trial as text for a worker, with the output folder."""
    programs = [each and [str(each.program), each.arguments, each.module] for each in trial.programs]
    text = trial.project.to_bytes().decode()
    fields = [str(folder), trial.name, text, str(trial.folder), programs, trial.is_trusted, trial.command, trial.user]
    return json.dumps([*fields, trial.key])


def unpacked(text: str) -> tuple[Trial, Path]:
    """Return the trial and the output folder of a text of `packed`."""
    folder, name, project, home, programs, is_trusted, command, user, key = json.loads(text)
    commands = tuple(each and ProgramCommand(Path(each[0]), each[1], each[2]) for each in programs)
    trial = Trial(name, Project.from_bytes(project.encode()), Path(home), commands, is_trusted, command, user)
    vars(trial)["key"] = key  # its digest would take longer than to read it
    return trial, Path(folder)


def _show(recording: str) -> str:
    """Return what `web/grades.js` puts together to a page that plays a recording, as JSON."""
    from kiks.export.page import page_template, player_values
    from kiks.export.run_frames import RunFrames
    from kiks.recording.recording import Recording

    frames = RunFrames.of(Recording(recording).log)
    section = page_template("run_player.html").render(player_values(frames))
    return json.dumps({"section": section, "frames": frames.pack()})


def main() -> None:
    """Take orders from the standard input until it ends."""
    end_with_parent()
    # Ctrl-C is for the process that hands out the orders, which ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.getLogger("kiks").setLevel(logging.CRITICAL)
    # What a supervisor prints must not come between the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    orders = os.fdopen(os.dup(0), "rb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    sandboxes = Sandboxes()
    kinds: dict[str, Callable[[str], str]] = {
        RUN: lambda told: run_trial(*unpacked(told), sandboxes).to_line(),
        SHOW: _show,
    }
    gc.freeze()
    for line in orders:
        kind, told = json.loads(line)
        try:
            answer = {"result": kinds[kind](told)}
        except KiksError as error:
            answer = {"error": str(error)}
        answers.write(json.dumps(answer).encode() + b"\n")
        answers.flush()
    sandboxes.close()


if __name__ == "__main__":
    main()
    sys.exit(0)
