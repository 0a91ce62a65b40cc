"""A warm worker of the runner: `python -m kiks.trials.worker` takes trials and answers each, in a line."""

from __future__ import annotations

import gc
import json
import logging
import os
import signal
import sys
from pathlib import Path
from typing import Any

from kiks.ending import end_with_parent
from kiks.errors import KiksError
from kiks.model.project import Project
from kiks.ports.program_process import Command
from kiks.trials.one_run import run_trial
from kiks.trials.trial import Trial


def packed(trial: Trial, folder: Path) -> bytes:
    """Return a trial as a line for a worker, with the output folder."""
    programs = [each and [str(each.program), each.arguments, each.module] for each in trial.programs]
    text = trial.project.to_bytes().decode()
    fields = [str(folder), trial.name, text, str(trial.folder), programs, trial.is_trusted, trial.command]
    return json.dumps(fields).encode() + b"\n"


def unpacked(line: bytes) -> tuple[Trial, Path]:
    """Return the trial and the output folder of a line of `packed`."""
    folder, name, text, home, programs, is_trusted, command = json.loads(line)
    commands = tuple(each and Command(Path(each[0]), each[1], each[2]) for each in programs)
    return Trial(name, Project.from_bytes(text.encode()), Path(home), commands, is_trusted, command), Path(folder)


def main() -> None:
    """Take trials from the standard input until it ends."""
    end_with_parent()
    # Ctrl-C is for the process that hands out the trials, which ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.getLogger("kiks").setLevel(logging.CRITICAL)
    # What a supervisor prints must not come between the answers.
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    orders = os.fdopen(os.dup(0), "rb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    gc.freeze()
    for line in orders:
        answer: dict[str, Any]
        try:
            answer = {"outcome": run_trial(*unpacked(line)).to_line()}
        except KiksError as error:
            answer = {"error": str(error)}
        answers.write(json.dumps(answer).encode() + b"\n")


if __name__ == "__main__":
    main()
    sys.exit(0)
