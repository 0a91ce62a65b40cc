"""The runner: hands trials out to warm worker processes, one for each core, and keeps outcomes as they come.

Need: a class is graded on all cores, and a killed run goes on where it was. Method: an outcome is a line of a file,
under the digest of all that it depends on, and found there at the next start. At the end the file has the outcomes in
the order of the trials, so it is the same however many workers there were.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from kiks.errors import KiksError, ParameterError, shown
from kiks.model.atomic_files import explained, make_folder, replace_file
from kiks.trials.crew import results
from kiks.trials.one_run import run_trial
from kiks.trials.sandboxes import sandboxes_of_process
from kiks.trials.trial import End, Outcome, ProgramEnd, Trial

OUTCOMES = "outcomes.jsonl"
"""The file of the outcomes in the output folder."""


def run_trials(
    trials: Sequence[Trial],
    folder: Path,
    *,
    workers: int | None = None,
    on_outcome: Callable[[Outcome, int], object] = lambda outcome, count: None,
    on_taken: Callable[[int], object] = lambda count: None,
    goes_on: Callable[[], bool] = lambda: True,
) -> list[Outcome]:
    """Run trials; return their outcomes in the order of the trials, the same however many workers there are.

    Outcomes that are in the folder already are not made again. After Ctrl-C or a kill, the same call goes on. The
    engine must have been compiled before, or each worker compiles it.

    Args:
        trials: The trials; their names differ.
        folder: Where outcomes and recordings go.
        workers: How many processes; one for each core if left out.
        on_outcome: Called with each outcome as it comes, also with those that are there at the start, and with how many
            there are by then.
        on_taken: Called with how many outcomes are taken from the folder, before the others are made.
        goes_on: Asked several times a second; when it says no, the trials under way end, and those that are done are
            returned.

    Raises:
        KiksError: If a trial cannot begin, such as when its project has no time limit.
        WorkError: If no worker can be started.

    Example:
        >>> import tempfile
        >>> from kiks.model.project import Project
        >>> from kiks.ports.program_command import ProgramCommand
        >>> folder = Path(tempfile.mkdtemp())
        >>> program = folder / "wait.py"
        >>> program.write_text("import time; time.sleep(1); print('done')")
        41
        >>> trial = Trial("wait", Project(seconds=5.0), folder, (ProgramCommand(program),), is_trusted=True)
        >>> run_trials([trial], folder, workers=1)[0].end_of(1).printed
        ('done',)
    """
    make_folder(folder, "the output folder")
    if len({trial.name for trial in trials}) < len(trials):
        raise ParameterError("names of trials must differ, but two are the same. Number them.")
    file = folder / OUTCOMES
    known = _outcomes_in(file)
    outcomes: dict[str, Outcome] = {}
    missing = []
    for trial in trials:
        # One with a doubt, or whose recording is gone, is made again.
        found = known.get(trial.key)
        if found and found.name == trial.name and not found.doubt and (folder / trial.recording).is_file():
            outcomes[trial.name] = found
            on_outcome(found, len(outcomes))
        else:
            missing.append(trial)

    on_taken(len(outcomes))

    def take(outcome: Outcome) -> None:
        with explained(file, "outcomes"), file.open("ab") as lines:
            lines.write(outcome.to_line().encode() + b"\n")
        outcomes[outcome.name] = outcome
        on_outcome(outcome, len(outcomes))

    if missing:
        # A line that a kill has cut short ends here.
        with explained(file, "outcomes"), file.open("ab") as lines:
            lines.write(b"\n")
        trials_by_name = {trial.name: trial for trial in missing}
        jobs = {trial.name: partial(_run, trial, folder.absolute()) for trial in missing}
        for name, result in results(jobs, workers, goes_on):
            if result.error:
                raise KiksError(f"{shown(name)} cannot begin: {result.error}")
            take(_lost(trials_by_name[name], result.lost) if result.lost else result.result)
    made = [outcomes[trial.name] for trial in trials if trial.name in outcomes]
    replace_file(file, "".join(f"{outcome.to_line()}\n" for outcome in made), "outcomes")
    return made


def _run(trial: Trial, folder: Path) -> Outcome:
    """Run a trial in a worker."""
    return run_trial(trial, folder, sandboxes_of_process())


def _outcomes_in(file: Path) -> dict[str, Outcome]:
    """Return the outcomes of a file by their keys; nothing of a line that is none."""
    found: dict[str, Outcome] = {}
    try:
        lines = file.read_bytes().splitlines()
    except OSError:
        return found
    for line in lines:
        try:
            outcome = Outcome.from_line(line)
        except ValueError:
            continue
        found[outcome.key] = outcome
    return found


def _lost(trial: Trial, why: str) -> Outcome:
    """Return the outcome of a trial that took its worker with it."""
    ends = tuple(
        ProgramEnd(robot, command.name, End.STOPPED, why) for robot, command in enumerate(trial.programs, 1) if command
    )
    return Outcome(trial.key, trial.name, False, False, 0, 0.0, {}, ends, "", "", why)
