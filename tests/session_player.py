r"""Transcripts of serial sessions: how they are read, and how they are played over any port.

A transcript is a text file in `tests/sessions/`. Each line begins with a mark and a blank:

    !  a setting of the robot, at the top: `robot NAME`, `quiet yes`, `baud NUMBER`, `turrets NAME ...`
    >  characters that the program sends; \r, \n, \t, \\ and \xNN stand for what they stand for in Python
    <  a line that the robot answers, without its CR LF, which must be there
    ~  the same, as a regular expression that the whole line matches
    @  let this time pass [ms]
    =  the session's simulated time [ms] when the last reply was complete, checked where the caller has a clock
    #  a comment

Nothing may be answered beyond what is written. No time-out is needed to see that: the player asks one more question at
the end, and its answer must be the next one.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Literal, Protocol

from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec
from kiks.sim.simulation import Simulation

FOLDER = Path(__file__).parent / "sessions"

LAST_QUESTION, LAST_ANSWER = b"I,5\n", b"i,0\r\n"

FLOOR = Arena.box(1000, 1000)

MARKS = "! > < ~ @ = #"

SETTINGS = ("robot", "quiet", "baud", "turrets")

Pieces = Literal["lines", "bytes", "one write"]


class Port(Protocol):
    """What the player needs of a port: pyserial's ports and ours have it."""

    def write(self, data: bytes, /) -> int | None:
        """Send characters."""

    def readline(self) -> bytes:
        """Return a line with its end, or less if a time-out is over."""


@dataclass(frozen=True)
class Step:
    """A line of a transcript: its number, its mark and what follows."""

    number: int
    mark: str
    text: str

    @property
    def sent(self) -> bytes:
        """The characters that a `>` line stands for."""
        return self.text.encode("ascii").decode("unicode_escape").encode("latin-1")


@dataclass(frozen=True)
class Session:
    """A transcript."""

    name: str
    steps: tuple[Step, ...]
    settings: dict[str, str] = field(default_factory=dict)

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""
        return int(self.settings.get("baud", "9600"))


TURRETS = ("gripper", "k213", "radio", "io", "battle")
"""Everything that `Simulation.fit` knows by name."""


def load(path: Path) -> Session:
    """Return the transcript that a file holds.

    Raises:
        ValueError: If a line has no mark that is known.
    """
    steps, settings = [], {}
    for number, line in enumerate(path.read_text(encoding="ascii").splitlines(), 1):
        mark, _, text = line.partition(" ")
        if mark == "!":
            name, _, value = text.partition(" ")
            if name not in SETTINGS:
                raise ValueError(f"{path.name}, line {number}: a setting must be one of {SETTINGS}, not {name!r}.")
            settings[name] = value
        elif mark in ("", "#"):
            continue
        elif mark in (">", "<", "~", "@", "="):
            steps.append(Step(number, mark, text))
        else:
            raise ValueError(f"{path.name}, line {number}: a line must begin with one of {MARKS}, but it was {line!r}.")
    return Session(path.stem, tuple(steps), settings)


def sessions() -> list[Session]:
    """Return all transcripts, in the order of their names."""
    return [load(path) for path in sorted(FOLDER.glob("*.txt"))]


def simulation(session: Session) -> Simulation:
    """Return a simulation of the robot that a transcript was written for: alone, far from any wall."""
    spec = RobotSpec.load(session.settings.get("robot", "khepera"))
    if "quiet" in session.settings:
        spec = spec.without_noise().with_changes(proximity__baseline_counts=(0.0,) * 8)
    sim = Simulation(FLOOR, robot=spec.with_changes(firmware__baud=session.baud))
    for name in session.settings.get("turrets", "").split():
        sim.fit(1, name)
    return sim


def play(
    port: Port,
    session: Session,
    *,
    wait: Callable[[float], object],
    pieces: Pieces = "lines",
    clock: Callable[[], float] | None = None,
) -> None:
    """Play a transcript over a port.

    Args:
        port: A port with a time-out, so that a missing reply is noticed.
        session: What to send, and what must come back.
        wait: Lets a time pass [s], of the kind that the robot lives in.
        pieces: What is sent at once: a line of the transcript, a byte, or everything up to the next wait.
        clock: Returns the simulated time [s]; only for the pieces 'lines' and 'bytes'.

    Raises:
        AssertionError: If a reply is wrong, missing, late or one too many.
    """
    begin_s = clock() if clock is not None else 0.0
    for step in _in_one_write(session.steps) if pieces == "one write" else session.steps:
        where = f"session '{session.name}', line {step.number}"
        if step.mark == ">":
            for part in _single_bytes(step.sent) if pieces == "bytes" else (step.sent,):
                port.write(part)
        elif step.mark == "@":
            wait(float(step.text) * 1e-3)
        elif step.mark == "=":
            if clock is not None:
                passed_ms = (clock() - begin_s) * 1e3
                assert abs(passed_ms - float(step.text)) < 1e-3, f"{where}: the reply came at {passed_ms:.6f} ms"
        else:
            reply = port.readline()
            expected = step.text.encode("ascii") if step.mark == "~" else re.escape(step.text.encode("ascii"))
            assert re.fullmatch(expected + rb"\r\n", reply), f"{where}: expected {step.text!r}, but got {reply!r}"
    port.write(LAST_QUESTION)
    reply = port.readline()
    assert reply == LAST_ANSWER, f"session '{session.name}': a reply too many, {reply!r}"


def _single_bytes(data: bytes) -> Iterator[bytes]:
    return (data[begin:end] for begin, end in pairwise(range(len(data) + 1)))


def _in_one_write(steps: tuple[Step, ...]) -> Iterator[Step]:
    """Bring what is sent between two waits to the front and together."""
    block: list[Step] = []
    for step in (*steps, Step(0, "@", "0")):
        if step.mark != "@":
            block.append(step)
            continue
        sent = [entry for entry in block if entry.mark == ">"]
        if sent:
            yield Step(sent[0].number, ">", "".join(entry.text for entry in sent))
        yield from (entry for entry in block if entry.mark != ">")
        yield step
        block = []
