"""One trial: a world is made, programs drive in it, the goal judges, and a recording is left."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NoReturn

from kiks.errors import KiksError
from kiks.ports.programs import Handle
from kiks.ports.sandbox import IDLE
from kiks.recording.recorder import RunRecorder, program_texts
from kiks.run import Run
from kiks.sim.judge import Judgement
from kiks.sim.supervision import JUDGE
from kiks.trials.sandboxes import Sandboxes
from kiks.trials.trial import End, Outcome, ProgramEnd, Trial, limit_of

LINES = 10
"""Most lines of what a program has printed last that an outcome keeps."""

LINE_CHARACTERS = 300
"""Most characters of such a line."""


def run_trial(trial: Trial, folder: Path, sandboxes: Sandboxes) -> Outcome:
    """Run a trial in this process, each program in one of its own; must be called in the main thread.

    Args:
        trial: The trial.
        folder: The output folder, where its recording goes.
        sandboxes: Where its programs run.
    """
    project = trial.project
    limit_of(project, "a project in which programs are tried", "it")
    for command in filter(None, trial.programs):
        command.check_file()
    run = Run.of(project, trial.folder, trial.programs)
    recording = folder / trial.recording
    recording.parent.mkdir(parents=True, exist_ok=True)
    doubt = ""

    def end(code: int, message: str) -> NoReturn:
        nonlocal doubt
        doubt = message if code else ""
        programs.end(code, message)

    with run:
        run.supervise()
        about = {"command": trial.command}
        with RunRecorder(run.sim, recording, programs=program_texts(run.files), about=about):
            programs = run.take_programs(
                when_silent="wait", keeps_output=True, are_apart=True, sandbox=sandboxes.of(trial)
            )
            with run.limited(end):
                programs.run()
            how = End.OUT_OF_TIME if run.ended_by else End.RUNNING
            ends = tuple(_end_of(handle, how) for handle in programs.handles)
            state = run.sim.state_hash()
            try:
                judgement = run.judgement()
            except KiksError as error:
                # What one program does must not end the grading of all.
                judgement = Judgement(False, False, 0, run.sim.time_s)
                doubt = doubt or f"{JUDGE} has failed: {error}"
    made = Outcome(
        trial.key,
        trial.name,
        is_solved=judgement.is_solved,
        is_failed=judgement.is_failed,
        points=judgement.points,
        time_s=run.sim.time_s,
        score={str(what): value for what, value in run.sim.score.items()},
        ends=ends,
        state=state,
        recording=trial.recording,
        doubt=doubt or ("" if any(handle.reason for handle in programs.handles) else programs.doubt),
    )
    if any(end.how == End.STOPPED for end in ends):
        # When that was depends on the computer, so nothing of it counts.
        return replace(made, is_solved=False, is_failed=True, points=0, time_s=0.0, score={}, state="")
    return made


def _end_of(handle: Handle, how: End) -> ProgramEnd:
    """Return how a program has ended.

    Args:
        handle: The program.
        how: What has ended the run, for a program that still ran.
    """
    lines = [] if handle.output is None else handle.output.since(0)[1]
    detail = ""
    if handle.reason:
        # At which simulated time that was is the same on every computer only if it let no time pass.
        how, detail = End.ENDLESS if handle.reason.endswith(IDLE) else End.STOPPED, handle.reason
    elif not handle.is_stopped:
        how = End.CRASHED if handle.code else End.ENDED
        if handle.code:
            errors = [line.text for line in lines if line.is_error and line.text.strip()]
            detail = _cut(errors[-1].removeprefix("kiks: ")) if errors else handle.how
    printed = () if how == End.STOPPED else tuple(_cut(line.text) for line in lines[-LINES:])
    return ProgramEnd(handle.robot, handle.command.name, how, detail, printed)


def _cut(text: str) -> str:
    return text if len(text) <= LINE_CHARACTERS else f"{text[:LINE_CHARACTERS]}…"
