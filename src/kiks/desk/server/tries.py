"""A person's program tried in all cases of an exercise, in processes of their own, while the desk goes on."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

from kiks.errors import KiksError, ParameterError, WorkError
from kiks.model.exercise import STUDENT, Case, cases_of
from kiks.model.program_files import ProgramFiles
from kiks.model.project import Project
from kiks.ports.program_process import Command, commands_of, python_line
from kiks.ports.resources import processor_count
from kiks.sim.from_project import in_case
from kiks.trials.crew import ASK_S
from kiks.trials.grading import Grade
from kiks.trials.hand_in import PAGE, packed
from kiks.trials.runner import run_trials
from kiks.trials.submissions import Submission
from kiks.trials.trial import Outcome, Trial
from kiks.version import __version__

_TURNS = threading.BoundedSemaphore(max(processor_count() - 1, 1))
"""One turn for each core but one, which is the server's: thirty students of a room may press 'Try all' at once."""


class Tries:
    """The tries of one program; new ones take their place.

    Args:
        is_for_others: Whether the program is that of another person, so that many may want tries at once.
        is_trusted: Whether the program may do what this user may; else it runs in a sandbox.

    Attributes:
        workers: How many processes try.
        project: The exercise; None before the first try.
        cases: The cases, in order.
        outcomes: What has come out so far, by numbers of the cases, from 0.
        error: Why they cannot begin; empty if they can.
        taken_count: How many of the outcomes are those of earlier tries, as nothing has changed on which they depend.
        is_waiting: Whether others have their turns first.
    """

    def __init__(self, *, is_for_others: bool = False, is_trusted: bool = True) -> None:
        self._is_trusted = is_trusted
        self.workers = 1 if is_for_others else max(processor_count() - 1, 1)
        self.project: Project | None = None
        self.cases: list[Case] = []
        self.outcomes: dict[int, Outcome] = {}
        self.error = ""
        self.taken_count = 0
        self.is_waiting = False
        self._command: Command | None = None
        self._files: dict[str, bytes] = {}
        self._packed = b""
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._thread: threading.Thread | None = None
        self._is_wanted = False

    @property
    def is_running(self) -> bool:
        """Whether some are under way."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def is_whole(self) -> bool:
        """Whether all cases have come out."""
        return len(self.outcomes) == len(self.cases) > 0

    @property
    def grade(self) -> Grade:
        """What has come out so far, as a grade: `kiks grade` would give the same in these cases."""
        name = "" if self._command is None else self._command.name
        outcomes = tuple(outcome for _, outcome in sorted(self.outcomes.items()))
        return Grade(Submission(name, name, self._command), outcomes)

    def is_of(self, project: Project, command: Command) -> bool:
        """Return whether these are all tries of a program, as it is now, in an exercise."""
        same = self.is_whole and (self.project, self._command) == (project, command)
        return same and self._files == command.files().pack()

    def begin(self, project: Project, home: Path, command: Command, *, has_hidden: bool) -> None:
        """Begin to try a program.

        Args:
            project: The exercise.
            home: The folder of the exercise.
            command: The program.
            has_hidden: Whether to try it in hidden cases, too.
        """
        if self.is_running:
            raise ParameterError("These tries must end first. Wait, or stop them.")
        if len(project.robots) < STUDENT:
            raise ParameterError("A world must have a robot for a program to be tried in it. Place one.")
        command.check_file()
        self.project, self._command, self._files = project, command, command.files().pack()
        self.cases = [case for case in cases_of(project.cases) if has_hidden or not case.is_hidden]
        self.outcomes, self.error, self._is_wanted, self._packed, self.taken_count = {}, "", True, b"", 0
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="kiks-tries-", ignore_cleanup_errors=True)
        programs = commands_of(project, home)
        self._thread = threading.Thread(target=self._run, args=(project, home, command, programs), daemon=True)
        self._thread.start()

    def _run(self, project: Project, home: Path, command: Command, programs: list[Command | None]) -> None:
        try:
            # What is handed in is what is tried, with nothing beside it.
            folder = self._path() / "program"
            shutil.rmtree(folder, ignore_errors=True)
            copy = ProgramFiles.unpack(self._files, folder / command.program.stem)
            programs[STUDENT - 1] = Command(copy, command.arguments)
            trials = [
                Trial(str(number), in_case(project, case, home), home, tuple(programs), self._is_trusted)
                for number, case in enumerate(self.cases)
            ]
            with self._turn():
                run_trials(
                    trials,
                    self._path(),
                    workers=self.workers,
                    on_outcome=self._take,
                    on_taken=self._note_taken,
                    goes_on=lambda: self._is_wanted,
                )
        except (KiksError, OSError) as error:
            self.error = str(error)

    @contextmanager
    def _turn(self) -> Iterator[None]:
        """Wait for a turn, unless these tries are stopped meanwhile."""
        while not (has_turn := _TURNS.acquire(timeout=ASK_S)) and self._is_wanted:
            self.is_waiting = True
        self.is_waiting = False
        try:
            yield
        finally:
            if has_turn:
                _TURNS.release()

    def _take(self, outcome: Outcome, _count: int) -> None:
        self.outcomes[int(outcome.name)] = outcome

    def _note_taken(self, count: int) -> None:
        self.taken_count = count

    def _path(self) -> Path:
        assert self._folder is not None
        return Path(self._folder.name)

    def stop(self) -> None:
        """Let those under way end; what has come out stays."""
        self._is_wanted = False

    def wait(self) -> None:
        """Wait until none is under way."""
        if self._thread is not None:
            self._thread.join()

    def recording(self, number: int) -> Path:
        """Return the recording of a case that has come out."""
        if not (name := self.outcomes[number].recording):
            raise ParameterError("A try must have a recording to be shown, but this one was lost. Try all again.")
        return self._path() / name

    def packed(self) -> bytes:
        """Return the file that is handed in when all cases have come out; its run is the one with the fewest points."""
        if self.error:
            raise ParameterError(self.error)
        if not self.is_whole:
            raise ParameterError("All cases must have come out before a program is handed in. Hand it in again.")
        if self._packed:
            return self._packed
        grade, exercise = self.grade, None if self.project is None else self.project.exercise
        assert grade.worst is not None
        worst = int(grade.worst.name)
        file, page = self.recording(worst), self._path() / PAGE
        title = "" if exercise is None else exercise.title
        self._write_page(file, page, f"{title}: {self.cases[worst].name}")
        score = {
            "kiks": __version__,
            "exercise": title,
            "points": grade.points,
            "solved": grade.solved,
            "cases": len(self.cases),
            "each": [{**asdict(outcome), "name": self.cases[int(outcome.name)].name} for outcome in grade.outcomes],
        }
        self._packed = packed(self._files, score, recording=file.read_bytes(), page=page.read_bytes())
        return self._packed

    def _write_page(self, recording: Path, page: Path, title: str) -> None:
        """Write the page of a recording in a process of its own: figures would take the time of the desk."""
        line = python_line("-m", "kiks", "export", str(recording), str(page), "--force", f"--title={title}")
        with self._turn():
            made = subprocess.run(line, stdin=subprocess.DEVNULL, capture_output=True, check=False)
        if made.returncode:
            said = made.stderr.decode(errors="replace").strip().splitlines()
            raise WorkError(f"Cannot write the page of the run: {said[-1] if said else 'its process has ended'}.")

    def close(self) -> None:
        """End all, and forget what has come out."""
        self.stop()
        self.wait()
        if self._folder is not None:
            self._folder.cleanup()
