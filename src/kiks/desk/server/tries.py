"""A person's program tried in all cases of an exercise, in processes of their own, while the desk goes on."""

from __future__ import annotations

import asyncio
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kiks.desk.server.turns import TRIES, Share
from kiks.errors import KiksError, ParameterError, WorkError, counted
from kiks.model.exercise import STUDENT, Case, cases_of
from kiks.model.program_files import ProgramFiles
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand, project_commands
from kiks.ports.program_process import python_line
from kiks.ports.resources import processor_count
from kiks.sim.from_project import in_case
from kiks.trials.hand_in import PAGE, packed
from kiks.trials.runner import run_trials
from kiks.trials.trial import Outcome, Outcomes, Trial
from kiks.version import __version__

TURN_S = 120.0
"""Longest turn of one student in a room, in all cases together [s of real time]."""

NICE = 10
"""How much they leave the processors to others, from 0 to 19."""

END_S = 2.0
"""Longest wait for the end of what has been stopped [s]."""


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
        error: Why they have come to no end; empty if they have, or go on.
        taken_count: How many of the outcomes are those of earlier tries, as nothing has changed on which they depend.
        is_packing: Whether what is handed in is made now.
        is_handed_in: Whether the program of these tries has been handed in.
    """

    def __init__(self, *, is_for_others: bool = False, is_trusted: bool = True) -> None:
        self._is_trusted, self._is_for_others = is_trusted, is_for_others
        self.workers = 1 if is_for_others else max(processor_count() - 1, 1)
        self.project: Project | None = None
        self.cases: list[Case] = []
        self.outcomes: dict[int, Outcome] = {}
        self.error = ""
        self.taken_count = 0
        self.is_packing = self.is_handed_in = False
        self._share = Share()
        self._command: ProgramCommand | None = None
        self._files: dict[str, bytes] = {}
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._end: Future[None] | None = None
        self._exporting: subprocess.Popen[bytes] | None = None
        self._is_wanted = False

    @property
    def is_running(self) -> bool:
        """Whether some are under way."""
        return self._end is not None and not self._end.done()

    @property
    def is_waiting(self) -> bool:
        """Whether others have their turns first."""
        return self._share.is_waiting

    @property
    def is_whole(self) -> bool:
        """Whether all cases have come out."""
        return len(self.outcomes) == len(self.cases) > 0

    @property
    def come_out(self) -> Outcomes:
        """What has come out so far, in the order of the cases: `kiks grade` would count the same."""
        return Outcomes(outcome for _, outcome in sorted(self.outcomes.items()))

    def is_of(self, project: Project, command: ProgramCommand) -> bool:
        """Return whether these are all tries of a program, as it is now, in an exercise."""
        same = self.is_whole and (self.project, self._command) == (project, command)
        return same and self._files == command.files().pack()

    def begin(
        self,
        project: Project,
        home: Path,
        command: ProgramCommand,
        *,
        has_hidden: bool,
        hand_in: Callable[[bytes], object] | None = None,
    ) -> None:
        """Begin to try a program.

        Args:
            project: The exercise.
            home: The folder of the exercise.
            command: The program.
            has_hidden: Whether to try it in hidden cases, too.
            hand_in: Takes the file that is handed in, when all cases have come out; called in another thread.
        """
        if self.is_running:
            raise ParameterError("These tries must end first. Wait, or stop them.")
        if len(project.robots) < STUDENT:
            raise ParameterError("A world must have a robot for a program to be tried in it. Place one.")
        if not (hand_in is not None and self.is_of(project, command)):
            self.outcomes, self.taken_count = {}, 0
        command.check_file()
        self.project, self._command, self._files = project, command, command.files().pack()
        self.cases = [case for case in cases_of(project.cases) if has_hidden or not case.is_hidden]
        self.error, self._is_wanted, self.is_handed_in = "", True, hand_in is not None
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="kiks-tries-", ignore_cleanup_errors=True)
        programs = project_commands(project, home)

        def run() -> None:
            if self._is_for_others and sys.platform == "linux":
                # Of this thread alone, and so of the processes that it starts: pages come first.
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)
            try:
                if not self.is_whole:
                    self._try(project, home, command, programs)
                if hand_in is not None and self.is_whole:
                    self.is_packing = True
                    hand_in(self._packed(project))
            except (KiksError, OSError) as error:
                self.error = str(error) if self._is_wanted else ""
            finally:
                self.is_packing = False

        self._end = TRIES.start(run, self._share, lambda: self._is_wanted)

    def _try(
        self, project: Project, home: Path, command: ProgramCommand, programs: list[ProgramCommand | None]
    ) -> None:
        # What is handed in is what is tried, with nothing beside it.
        folder = self._path() / "program"
        shutil.rmtree(folder, ignore_errors=True)
        copy = ProgramFiles.unpack(self._files, folder / command.program.stem)
        programs[STUDENT - 1] = ProgramCommand(copy, command.arguments)
        trials = [
            Trial(str(number), in_case(project, case, home), home, tuple(programs), self._is_trusted)
            for number, case in enumerate(self.cases)
        ]
        end_s = time.monotonic() + TURN_S if self._is_for_others else float("inf")
        run_trials(
            trials,
            self._path(),
            workers=self.workers,
            on_outcome=self._take,
            on_taken=self._note_taken,
            goes_on=lambda: self._is_wanted and time.monotonic() < end_s,
        )
        if self._is_wanted and not self.is_whole:
            raise WorkError(
                f"All cases must come out within {TURN_S:g} s of real time, as others wait, but after that "
                f"{counted(len(self.cases) - len(self.outcomes), 'case')} had not. Let the program end earlier."
            )

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
        if (exporting := self._exporting) is not None:
            exporting.kill()

    def wait(self, timeout_s: float | None = None) -> None:
        """Wait until none is under way."""
        if self._end is not None:
            wait([self._end], timeout_s)

    async def ended(self) -> None:
        """Wait until none is under way, without a thread."""
        if self._end is not None:
            await asyncio.wrap_future(self._end)

    def recording(self, number: int) -> Path:
        """Return the recording of a case that has come out."""
        if not (name := self.outcomes[number].recording):
            raise ParameterError("A try must have a recording to be shown, but this one was lost. Try all again.")
        return self._path() / name

    def _packed(self, project: Project) -> bytes:
        """Return the file that is handed in when all cases have come out; its run is the one with the fewest points."""
        outcomes = self.come_out
        assert outcomes.worst is not None
        worst = int(outcomes.worst.name)
        file, page = self.recording(worst), self._path() / PAGE
        self._write_page(file, page, f"{_title(project)}: {self.cases[worst].name}")
        score = {
            "points": outcomes.points,
            "solved": outcomes.solved,
            "cases": len(self.cases),
            "each": [{**asdict(outcome), "name": self.cases[int(outcome.name)].name} for outcome in outcomes],
        }
        return packed(self._files, _score(project) | score, recording=file.read_bytes(), page=page.read_bytes())

    def _write_page(self, recording: Path, page: Path, title: str) -> None:
        """Write the page of a recording in a process of its own: figures would take the time of the desk."""
        line = python_line("-m", "kiks", "export", str(recording), str(page), "--force", f"--title={title}")
        with subprocess.Popen(
            line, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        ) as made:
            self._exporting = made
            if not self._is_wanted:
                made.kill()  # it was stopped just before
            _, said = made.communicate()
        self._exporting = None
        if made.returncode:
            lines = said.decode(errors="replace").strip().splitlines()
            raise WorkError(f"Cannot write the page of the run: {lines[-1] if lines else 'its process has ended'}.")

    def close(self) -> None:
        """End all, and forget what has come out."""
        self.stop()
        self.wait(END_S)
        if self._folder is not None:
            self._folder.cleanup()


def packed_untried(project: Project, command: ProgramCommand) -> bytes:
    """Return the file that is handed in before its program was tried."""
    return packed(command.files().pack(), _score(project))


def _title(project: Project) -> str:
    return "" if project.exercise is None else project.exercise.title


def _score(project: Project) -> dict[str, Any]:
    return {"kiks": __version__, "exercise": _title(project)}
