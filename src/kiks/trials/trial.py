"""A trial and its outcome: one run of programs in one world, as records that files and other processes can hold."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import cache, cached_property
from pathlib import Path
from statistics import fmean

from pydantic import TypeAdapter

from kiks.errors import ParameterError
from kiks.model.atomic_files import inside
from kiks.model.program_files import ProgramFiles
from kiks.model.project import Project
from kiks.model.project_files import files_named
from kiks.model.thinking_policy import split_thinking
from kiks.ports.program_command import ProgramCommand, project_supervisor
from kiks.sim.judge import Judgement
from kiks.version import __version__


class End(StrEnum):
    """How a program of a trial has ended."""

    ENDED = "ended"
    """It has ended by itself."""

    RUNNING = "running"
    """It still ran when the goal ended the run."""

    OUT_OF_TIME = "out of time"
    """It still ran at the time limit of the project."""

    CRASHED = "crashed"
    """It has ended with an error."""

    ENDLESS = "endless"
    """It computed, or waited in real time, and let no simulated time pass: it was stopped."""

    STOPPED = "stopped"
    """The sandbox has stopped it, or the process of its world has died: then nothing of the run counts."""


def limit_of(project: Project, kind: str, name: str) -> float:
    """Return the time limit of a project whose runs are judged [s of simulated time].

    Args:
        project: The project.
        kind: What messages call such a project, such as 'EXERCISE'.
        name: What they call this one.

    Raises:
        ParameterError: If it has none, or a run would come out differently each time.
    """
    if project.seconds is None:
        raise ParameterError(f"{kind} must have a time limit, but {name} has none. Write seconds = 60.0.")
    for thinking in (project.thinking, *(policy for cases in project.cases for policy in cases.thinking)):
        if split_thinking(thinking)[0] == "live":
            raise ParameterError(
                f"{kind} must have a repeatable thinking time, but that of {name} is {thinking!r}. Write "
                'thinking = "none" or "fixed:20".'
            )
    return project.seconds


@dataclass(frozen=True)
class Trial:
    """A run that is to be judged: programs in a world.

    Attributes:
        name: Its name, such as 'ann/3'. It is unique, and a path below the output folder, where the recording goes.
        project: The world, with the changes of the case applied.
        folder: Where the project lies: robot files, replays and the supervisor are looked up from there.
        programs: The program of each robot; None for a robot without one.
        is_trusted: Whether the programs may do what this user may; otherwise each runs in a sandbox.
        command: The command that has begun it, for its recording; empty for none.
        user: Name of another user as whom its trusted programs run; empty for this one.

    Example:
        >>> from kiks.ports.program_command import ProgramCommand
        >>> Trial("ann/1", Project(seconds=10.0), Path(), (ProgramCommand(Path("ann.py")),)).recording
        'runs/ann/1.mcap'
    """

    name: str
    project: Project
    folder: Path
    programs: tuple[ProgramCommand | None, ...]
    is_trusted: bool = False
    command: str = ""
    user: str = ""

    @property
    def recording(self) -> str:
        """The file of its recording, from the output folder."""
        return f"runs/{self.name}.mcap"

    @cached_property
    def key(self) -> str:
        """A digest of all that its outcome depends on: its world, all files of its programs, the version of KiKS."""
        digest = hashlib.sha256(f"{__version__}\0{self.is_trusted}\0{self.user}\0".encode())
        for data in self._parts():
            digest.update(b"%d\0" % len(data))
            digest.update(data)
        return digest.hexdigest()[:32]

    def _parts(self) -> Iterator[bytes]:
        project, folder = self.project, self.folder
        yield project.to_bytes()
        for name in files_named(project, folder):
            yield _bytes_of(inside(folder, name, "file"))
        supervisor = project_supervisor(project, folder)
        yield b"" if supervisor is None else ProgramFiles(supervisor).digest.encode()
        for command in self.programs:
            yield b"" if command is None else json.dumps([command.module, *command.arguments]).encode()
            yield b"" if command is None else command.files().digest.encode()


def _bytes_of(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""  # the run will tell


@dataclass(frozen=True)
class ProgramEnd:
    """How a program of a trial has ended.

    Attributes:
        robot: Number of its robot.
        name: The program's name.
        how: What has happened to it.
        detail: The last line of its error, or why it was stopped ('used more than 512 MB of memory'); empty if neither.
        printed: The last lines that it has printed.
    """

    robot: int
    name: str
    how: End
    detail: str = ""
    printed: tuple[str, ...] = ()

    @property
    def has_failed(self) -> bool:
        """Whether that was a failure of the program."""
        return self.how in (End.CRASHED, End.ENDLESS, End.STOPPED)

    @property
    def last_words(self) -> str:
        """What was wrong, else what it printed last, in a line."""
        return self.detail or next(filter(None, map(str.strip, reversed(self.printed))), "")

    def __str__(self) -> str:
        return f"{self.how}: {self.detail}" if self.detail else self.how


@dataclass(frozen=True)
class Outcome:
    """What has come out of a trial; the same on every machine, unless there is a doubt.

    Attributes:
        key: `Trial.key`.
        name: `Trial.name`.
        is_solved: Whether the goal was reached.
        is_failed: Whether it could not be reached any more.
        points: Its points; without a goal those that the supervisor has counted under 'points'.
        time_s: How long the run was [s of simulated time].
        score: What the supervisor has counted, by robot or name.
        ends: How each program has ended.
        state: The hash of the last state.
        recording: The file of its recording, from the output folder; empty if there is none.
        doubt: Why it might not come out so again; empty if it would. Such a trial is made again at the next start.
    """

    key: str
    name: str
    is_solved: bool
    is_failed: bool
    points: int | float
    time_s: float
    score: dict[str, int | float | str]
    ends: tuple[ProgramEnd, ...]
    state: str
    recording: str
    doubt: str = ""

    @property
    def judgement(self) -> Judgement:
        """How the run was judged."""
        return Judgement(self.is_solved, self.is_failed, self.points, self.time_s)

    @property
    def failures(self) -> dict[int, ProgramEnd]:
        """How programs have failed, by the numbers of their robots."""
        return {end.robot: end for end in self.ends if end.has_failed}

    def end_of(self, robot: int = 1) -> ProgramEnd:
        """Return how the program of a robot has ended.

        Raises:
            KeyError: If the robot has none.
        """
        for end in self.ends:
            if end.robot == robot:
                return end
        raise KeyError(robot)

    def to_line(self) -> str:
        """Return it as one line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=True)

    @classmethod
    def from_line(cls, line: str | bytes) -> Outcome:
        """Read what `to_line` returned.

        Raises:
            ValueError: If it is none.
        """
        return _reader().validate_json(line)


class Outcomes(tuple[Outcome, ...]):
    """What has come out of one program in several cases, in their order."""

    @property
    def points(self) -> float:
        """The mean of the points, so that they do not depend on how many cases there are."""
        return round(fmean(outcome.points for outcome in self), 3) if self else 0.0

    @property
    def solved(self) -> int:
        """In how many cases the goal was reached."""
        return sum(outcome.is_solved for outcome in self)

    @property
    def time_s(self) -> float:
        """Mean time of the runs [s of simulated time]."""
        return round(fmean(outcome.time_s for outcome in self), 3) if self else 0.0

    @property
    def worst(self) -> Outcome | None:
        """The case with the fewest points; of several, one in which the program did not end as it should."""
        rank = {End.STOPPED: 0, End.ENDLESS: 1, End.CRASHED: 2}
        return min(
            self,
            key=lambda each: (each.points, each.is_solved, rank.get(each.end_of().how, 3), -each.time_s),
            default=None,
        )

    @property
    def last_words(self) -> str:
        """What was wrong, or was printed last, in the worst case, else in the first case with any."""
        cases = [self.worst, *self] if self.worst else []
        return next(filter(None, (outcome.end_of().last_words for outcome in cases)), "")

    def count(self, how: object) -> int:
        """Return in how many cases the program ended so; at the time limit, only those that were not solved count."""
        ended = [outcome for outcome in self if outcome.end_of().how == how]
        return sum(not (how == End.OUT_OF_TIME and outcome.is_solved) for outcome in ended)


@cache
def _reader() -> TypeAdapter[Outcome]:
    return TypeAdapter(Outcome)
