"""One trial: a world is made, programs drive in it, the goal judges, and a recording is left."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

from kiks.errors import KiksError
from kiks.ports.program_command import project_supervisor
from kiks.ports.programs import Handle, Programs
from kiks.ports.sandbox import IDLE
from kiks.recording.recorder import RunRecorder, program_texts
from kiks.sim.from_project import simulation_of, thinking_of
from kiks.sim.judge import POINTS, Judgement
from kiks.sim.simulation import Simulation
from kiks.sim.supervision import JUDGE, Supervision
from kiks.trials.sandboxes import Sandboxes
from kiks.trials.trial import End, Outcome, ProgramEnd, Trial, limit_of
from kiks.units import ns_from_s

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
    seconds = limit_of(project, "a project in which programs are tried", "it")
    commands = trial.programs
    for command in filter(None, commands):
        command.check_file()
    thinking = thinking_of(project, trial.folder)
    sim = simulation_of(
        project, trial.folder, thinking=thinking, program_count=sum(each is not None for each in commands)
    )
    recording = folder / trial.recording
    recording.parent.mkdir(parents=True, exist_ok=True)
    supervisor = project_supervisor(project, trial.folder)
    files = [command.file for command in commands if command is not None]
    with ExitStack() as at_the_end:
        run = _Run(sim)
        supervision = Supervision(sim, supervisor, project.goal)
        at_the_end.callback(supervision.close)
        texts = program_texts(files + ([] if supervisor is None else [supervisor]))
        at_the_end.enter_context(RunRecorder(sim, recording, programs=texts, about={"command": trial.command}))
        programs = run.programs = Programs(
            sim,
            commands,
            thinking=thinking,
            when_silent="wait",
            keeps_output=True,
            say=lambda text: None,
            are_apart=True,
            sandbox=sandboxes.of(trial),
        )
        supervision.end = run.end_by_judge
        sim.loop.end_at(ns_from_s(seconds), run.end_by_time)
        programs.run()
        ends = tuple(_end_of(handle, run.how) for handle in programs.handles)
        state = sim.state_hash()
        judgement = run.judgement(supervision)
    made = Outcome(
        trial.key,
        trial.name,
        is_solved=judgement.is_solved,
        is_failed=judgement.is_failed,
        points=judgement.points,
        time_s=sim.time_s,
        score={str(what): value for what, value in sim.score.items()},
        ends=ends,
        state=state,
        recording=trial.recording,
        doubt=run.doubt or ("" if any(handle.reason for handle in programs.handles) else programs.doubt),
    )
    if any(end.how == End.STOPPED for end in ends):
        # When that was depends on the computer, so nothing of it counts.
        return replace(made, is_solved=False, is_failed=True, points=0, time_s=0.0, score={}, state="")
    return made


class _Run:
    """What has ended the run of a simulation."""

    programs: Programs

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self.how = End.RUNNING
        self.doubt = ""

    def end_by_time(self) -> NoReturn:
        self.how = End.OUT_OF_TIME
        self.programs.end(0, "")

    def judgement(self, supervision: Supervision) -> Judgement:
        """Return how the run has done; without a goal, the points are those that the supervisor has counted."""
        try:
            if supervision.judge is not None:
                return supervision.judge.end()
        except KiksError as error:
            # What one program does must not end the grading of all.
            self.doubt = self.doubt or f"{JUDGE} has failed: {error}"
        points = self._sim.score.get(POINTS, 0) if supervision.judge is None else 0
        return Judgement(False, False, points if isinstance(points, float | int) else 0, self._sim.time_s)

    def end_by_judge(self, code: int, message: str) -> NoReturn:
        self.doubt = message if code else ""
        self.programs.end(code, message)


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
