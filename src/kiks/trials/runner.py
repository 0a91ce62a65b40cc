"""The runner: hands trials out to warm worker processes, one for each core, and keeps outcomes as they come.

Need: a class is graded on all cores, a killed run goes on where it was, and a trial that takes its worker with it costs
no other. Method: each worker has one trial at a time, so the slowest does not decide. An outcome is a line of a file,
under the digest of all that it depends on. What a person has interrupted finds it at the next start. At the end the
file has the outcomes in the order of the trials, so it is the same however many workers there were.
"""

from __future__ import annotations

import contextlib
import json
import selectors
import subprocess
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from kiks.errors import KiksError, ParameterError, WorkError, shown
from kiks.model.atomic_files import explained, make_folder, replace_file
from kiks.ports.program_process import python_line
from kiks.ports.resources import processor_count
from kiks.trials.trial import STOPPED, Outcome, ProgramEnd, Trial
from kiks.trials.worker import packed

OUTCOMES = "outcomes.jsonl"
"""The file of the outcomes in the output folder."""

ATTEMPTS = 2
"""How often a trial is begun whose worker dies."""

ASK_S = 0.2
"""Period at which a caller is asked whether the trials go on [s]."""

_READ_SIZE = 1 << 16


def run_trials(
    trials: Sequence[Trial],
    folder: Path,
    *,
    workers: int | None = None,
    on_outcome: Callable[[Outcome, int], object] = lambda outcome, count: None,
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
        goes_on: Asked several times a second; when it says no, the trials under way end, and those that are done are
            returned.

    Raises:
        KiksError: If a trial cannot begin, such as when its project has no time limit.
        WorkError: If no worker can be started.

    Example:
        >>> import tempfile
        >>> from kiks.model.project import Project
        >>> from kiks.ports.program_process import Command
        >>> folder = Path(tempfile.mkdtemp())
        >>> program = folder / "wait.py"
        >>> program.write_text("import time; time.sleep(1); print('done')")
        41
        >>> trial = Trial("wait", Project(seconds=5.0), folder, (Command(program),), is_trusted=True)
        >>> run_trials([trial], folder, workers=1)[0].end_of(1).printed
        ('done',)
    """
    make_folder(folder, "the output folder")
    if len({trial.name for trial in trials}) < len(trials):
        raise ParameterError("names of trials must differ, but two are the same. Number them.")
    file = folder / OUTCOMES
    known = {key: found for key, found in _outcomes_in(file).items() if _is_there(found, folder)}
    outcomes: dict[str, Outcome] = {}
    missing = []
    for trial in trials:
        if (found := known.get(trial.key)) is not None and found.name == trial.name:
            outcomes[trial.name] = found
            on_outcome(found, len(outcomes))
        else:
            missing.append(trial)

    def take(outcome: Outcome) -> None:
        with explained(file, "outcomes"), file.open("ab") as lines:
            lines.write(outcome.to_line().encode() + b"\n")
        outcomes[outcome.name] = outcome
        on_outcome(outcome, len(outcomes))

    if missing:
        # A line that a kill has cut short ends here.
        with explained(file, "outcomes"), file.open("ab") as lines:
            lines.write(b"\n")
        _Crew(missing, folder.absolute(), min(workers or processor_count(), len(missing)), take).run(goes_on)
    made = [outcomes[trial.name] for trial in trials if trial.name in outcomes]
    replace_file(file, "".join(f"{outcome.to_line()}\n" for outcome in made), "outcomes")
    return made


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


def _is_there(outcome: Outcome, folder: Path) -> bool:
    """Return whether an outcome stands for its trial: nothing speaks against it, and its recording is there."""
    return not outcome.doubt and (folder / outcome.recording).is_file()


class _Worker:
    """A worker process, with the trial that it has.

    Attributes:
        trial: The trial; None while it waits.
    """

    def __init__(self) -> None:
        line = python_line("-m", "kiks.trials.worker")
        try:
            self.process = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        except OSError as error:
            raise WorkError(f"Cannot start a worker: {error.strerror or error}. End other programs.") from None
        self.trial: Trial | None = None
        self._rest = b""
        assert self.process.stdout is not None
        self.answers = self.process.stdout

    def begin(self, trial: Trial, folder: Path) -> None:
        """Hand a trial over."""
        self.trial = trial
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):  # it has died, which the other pipe tells
            self.process.stdin.write(packed(trial, folder))
            self.process.stdin.flush()

    def take(self) -> dict[str, str] | None:
        """Return its answer if that is complete, else None.

        Raises:
            EOFError: If it has died.
        """
        piece = self.answers.read1(_READ_SIZE)  # type: ignore[attr-defined]
        if not piece:
            raise EOFError
        line, end, rest = (self._rest + piece).partition(b"\n")
        self._rest = rest if end else line
        if not end:
            return None
        answer: dict[str, str] = json.loads(line)
        return answer

    def close(self) -> str:
        """End it; return how it has ended."""
        self.process.kill()
        code = self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            with contextlib.suppress(OSError):
                pipe.close()
        return f"by signal {-code}" if code < 0 else f"with exit code {code}"


class _Crew:
    """Workers and the trials that are left."""

    def __init__(self, trials: Sequence[Trial], folder: Path, count: int, take: Callable[[Outcome], None]) -> None:
        self._left, self._folder, self._count, self._take = deque(trials), folder, count, take
        self._attempts: dict[str, int] = {}
        self._workers: set[_Worker] = set()
        self._selector = selectors.DefaultSelector()

    def run(self, goes_on: Callable[[], bool]) -> None:
        """Run all trials, or as many as are done when they shall not go on."""
        try:
            for _ in range(self._count):
                self._hire()
            while any(worker.trial is not None for worker in self._workers) and goes_on():
                for key, _ in self._selector.select(ASK_S):
                    self._hear(key.data)
        finally:
            for worker in self._workers:
                worker.close()
            self._selector.close()

    def _hire(self) -> None:
        worker = _Worker()
        self._workers.add(worker)
        self._selector.register(worker.answers, selectors.EVENT_READ, worker)
        self._hand_out(worker)

    def _hand_out(self, worker: _Worker) -> None:
        worker.trial = None
        if self._left:
            worker.begin(self._left.popleft(), self._folder)

    def _hear(self, worker: _Worker) -> None:
        try:
            answer = worker.take()
        except EOFError:
            self._replace(worker)
            return
        if answer is None:
            return
        if "error" in answer:
            assert worker.trial is not None
            raise KiksError(f"{shown(worker.trial.name)} cannot begin: {answer['error']}")
        self._take(Outcome.from_line(answer["outcome"]))
        self._hand_out(worker)

    def _replace(self, worker: _Worker) -> None:
        """Put another worker in the place of one that has died, perhaps of its trial."""
        trial = worker.trial
        self._selector.unregister(worker.answers)
        self._workers.discard(worker)
        how = worker.close()
        if trial is not None:
            attempts = self._attempts[trial.name] = self._attempts.get(trial.name, 0) + 1
            if attempts < ATTEMPTS:
                self._left.appendleft(trial)
            else:
                self._take(_lost(trial, f"the process of its world has ended {how}, {attempts} times"))
        if self._left:
            self._hire()


def _lost(trial: Trial, why: str) -> Outcome:
    """Return the outcome of a trial that took its worker with it."""
    ends = tuple(
        ProgramEnd(robot, command.name, STOPPED, why) for robot, command in enumerate(trial.programs, 1) if command
    )
    return Outcome(trial.key, trial.name, False, False, 0, 0.0, {}, ends, "", "", why)
