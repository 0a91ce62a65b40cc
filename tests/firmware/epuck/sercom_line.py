"""An e-puck's firmware alone on a line: characters in, replies out, and senses that read what a test says."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import State
from kiks.firmware.epuck.firmware import EPuckFirmware
from kiks.model.robot import RobotSpec
from kiks.model.window import Window

VERSIONS = ("BT11", "BT20", "AS12", "AS20", "WF15")

READINGS = {
    "proximity": (10, 200, 30, 40, 50, 60, 70, 4000),
    "ambient": (3001, 3002, 3003, 3004, 3005, 3006, 3007, 3008),
    "positions": (0, 0),
    "accelerometer": (5, -6, 768),
    "ground": (937, 943, 940, 900, 901),
    "microphones": (10, 6, 17),
}

BASELINE_COUNTS = 3
"""Of the proximity sensors, with nothing near."""

FOLDER = Path(__file__).parent / "sessions"


def a_picture(window: Window) -> NDArray[np.uint8]:
    """Return a picture that tells its columns in red and its rows in green; all is half blue."""
    rows, columns = np.mgrid[: window.height, : window.width]
    channels = (window.x + window.zoom * columns, window.y + window.zoom * rows, np.full_like(rows, 128))
    return np.stack([channel % 256 for channel in channels], axis=2).astype(np.uint8)


class SercomLine:
    """A line to an e-puck.

    Args:
        version: The personality of its program.
    """

    def __init__(self, version: str = "AS12") -> None:
        spec = RobotSpec.load("khepera").with_changes(
            firmware__protocol_version=version, proximity__baseline_counts=(BASELINE_COUNTS,) * 8
        )
        self.readings = dict(READINGS)
        self.state = State.empty(world_count=1, robot_count=1)
        self.robot = EPuckFirmware(spec, self.state, 0, self.sense)
        self.robot.picture = a_picture
        self.now_ns = 0

    def sense(self, name: str) -> list[int]:
        return list(self.readings[name])

    def send(self, data: bytes) -> bytes:
        """Send characters; return what is answered, and what comes while the robot is busy."""
        output = bytearray()
        for _, command in self.robot.receiver.feed(data):
            output += self.robot.execute(command, self.now_ns)
            output += self.wait(self.robot.busy_ns(command))
        return bytes(output)

    def wait(self, time_ns: int) -> bytes:
        """Let a time pass; return what the robot sends by itself."""
        output = bytearray()
        self.now_ns += time_ns
        while (wakes_ns := self.robot.wakes_ns) is not None and wakes_ns <= self.now_ns:
            output += self.robot.wake(wakes_ns)
        return bytes(output)


@dataclass(frozen=True)
class SercomSession:
    r"""A transcript, a text file in `sessions/`. Each line begins with a mark and a blank:

    !  names of the personalities for which it holds
    =  what a sense reads from here on: its name and numbers
    >  characters that are sent, with the escapes of Python (a zero is \x00)
    <  all that is answered to what stands above; several lines are one answer
    @  let this time pass [ms]
    #  a comment
    """

    name: str
    versions: tuple[str, ...]
    steps: tuple[tuple[int, str, str], ...]

    @staticmethod
    def load(path: Path) -> "SercomSession":
        versions: list[str] = []
        steps = []
        for number, line in enumerate(path.read_text(encoding="ascii").splitlines(), 1):
            mark, _, text = line.partition(" ")
            if mark == "!":
                versions += text.split()
            elif mark in ("=", ">", "<", "@"):
                steps.append((number, mark, text))
            elif mark not in ("", "#"):
                raise ValueError(f"{path.name}, line {number}: a line must begin with one of ! = > < @ #.")
        return SercomSession(path.stem, tuple(versions), tuple(steps))

    def play(self, version: str, pieces: str) -> None:
        """Play it to a new robot; what is sent comes in 'lines' of the transcript, single 'bytes', or 'one write'."""
        line = SercomLine(version)
        waiting = answered = expected = b""

        def check(number: int) -> None:
            nonlocal answered, expected, waiting
            answered += line.send(waiting)
            assert answered == expected, f"{self.name} ({version}), line {number}: {answered!r} is not {expected!r}"
            answered = expected = waiting = b""

        last = "<"
        for number, mark, text in self.steps:
            if mark in "=@" or (last == "<" != mark and pieces != "one write"):
                check(number)
            if mark == "=":
                name, *numbers = text.split()
                line.readings[name] = tuple(map(int, numbers))
            elif mark == "@":
                answered += line.wait(int(float(text) * 1e6))
            elif mark == "<":
                expected += unescaped(text)
            elif pieces == "one write":
                waiting += unescaped(text)
            else:
                data = unescaped(text)
                cuts = range(len(data) + 1) if pieces == "bytes" else (0, len(data))
                for begin, end in pairwise(cuts):
                    answered += line.send(data[begin:end])
            last = mark
        check(number)


def unescaped(text: str) -> bytes:
    """Return the characters that stand in a line of a transcript."""
    return text.encode("ascii").decode("unicode_escape").encode("latin-1")


def sessions() -> list[SercomSession]:
    """Return all transcripts, in the order of their names."""
    return [SercomSession.load(path) for path in sorted(FOLDER.glob("*.txt"))]
