"""Programs of Octave as processes: their output, and that they leave nothing behind.

A program says values for Python with say('name', value) and takes the message of an error with caught(@() ...); both
are in `support`. What a call must return stands beside it (`run`): `kGetSpeed(ref)  %= [[5], [5]] +- 1`. Each program
has a folder of its own, for its files and for what tells where its session is found.
"""

import contextlib
import json
import os
import re
import select
import shutil
import signal
import subprocess
import threading
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest
from tests.forked import kiks_command
from tests.guard import GUARD_S

ROOT = Path(__file__).parents[2]
TOOLBOX = ROOT / "matlab"
DEMOS = TOOLBOX / "demos"
SUPPORT = Path(__file__).parent / "support"

OCTAVE = shutil.which("octave-cli")

A_PROCESS = {"KIKS_COMMAND": ""}
"""Variables with which the toolbox starts the installed command, a process of its own, as it does for people."""

needs_octave = pytest.mark.skipif(OCTAVE is None, reason="octave-cli is not here: apt-get install octave")


@cache
def has_tcp() -> bool:
    """Return whether Octave can open TCP connections."""
    command = [OCTAVE, "-qf", "--eval", "exit(isempty(pkg('list', 'instrument-control')))"]
    return subprocess.run(command, capture_output=True, timeout=GUARD_S, check=False).returncode == 0


def need_tcp() -> None:
    if not has_tcp():
        pytest.skip("Octave's instrument-control is not here: apt-get install octave-instrument-control")


def transport_variables(transport: str) -> dict[str, str]:
    if transport == "pipes":
        return {}
    need_tcp()
    return {"KIKS_TRANSPORT": "tcp"}


_BEGIN = f"""\
1;
more off
addpath('{TOOLBOX}')
addpath('{SUPPORT}')
global KIKS_THINKING KIKS_SEED
KIKS_THINKING = 'none';
KIKS_SEED = 1;
rand('twister', 1);
"""


class Octave:
    """A program that runs in Octave.

    It finds the toolbox; thinking costs nothing, and seeds are set, so that each run is the same. Its session is a fork
    (tests/forked.py) unless the environment is `A_PROCESS`.

    Args:
        program: Its text.
        folder: Where it runs.
        environment: Variables of the environment besides those that there are.
        shares: Another program, whose sessions it shall find.

    Attributes:
        lines: What it has printed, without what it has said.
        said: What it has said, by name.
    """

    def __init__(
        self, program: str, folder: Path, environment: Mapping[str, str] | None = None, *, shares: Self | None = None
    ) -> None:
        self.lines: list[str] = []
        self.said: dict[str, Any] = {}
        self._news = threading.Condition()
        self._is_over = False
        self.doors = folder / "doors" if shares is None else shares.doors
        self.doors.mkdir(exist_ok=True)
        file = folder / f"program_{len(list(folder.glob('program_*')))}.m"
        file.write_text(_BEGIN + program, encoding="utf-8")
        own = {"KIKS_COMMAND": " ".join(kiks_command()), "KIKS_WINDOW": "0", "XDG_RUNTIME_DIR": str(self.doors)}
        options: dict[str, Any] = {"cwd": folder, "env": {**os.environ, **own, **(environment or {})}}
        options |= {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        # In a process group of its own, so that all of it can be killed at once.
        options |= {"text": True, "errors": "replace", "start_new_session": True}
        self._process = subprocess.Popen([OCTAVE, "--no-gui", "-qf", file.name], **options)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def children(self) -> list[int]:
        """Return the numbers of the running processes that Octave has started."""
        number = self._process.pid
        return [int(word) for word in Path(f"/proc/{number}/task/{number}/children").read_text().split()]

    def wait_for(self, name: str) -> Any:
        """Wait until the program has said something, and return it."""
        with self._news:
            is_there = self._news.wait_for(lambda: name in self.said or self._is_over, GUARD_S)
        assert is_there, f"it has not said {name}:\n{self.text}"
        assert name in self.said, f"it never said {name}:\n{self.text}"
        return self.said[name]

    def wait_for_line(self, begin: str) -> None:
        """Wait until the program has printed a line that begins so."""
        with self._news:
            self._news.wait_for(lambda: self._is_over or any(line.startswith(begin) for line in self.lines), GUARD_S)
        assert any(line.startswith(begin) for line in self.lines), f"it has not printed {begin!r}:\n{self.text}"

    def tell(self) -> None:
        """Let a program go on that waits in fread(stdin, 1); fgetl would wait for what comes after the line, too."""
        self._process.stdin.write(".")
        self._process.stdin.flush()

    def kill(self) -> None:
        """Kill Octave, and nothing else."""
        self._process.kill()

    def finish(self, status: int = 0) -> Self:
        """Wait until Octave and all its children have ended."""
        try:
            assert self._process.wait(GUARD_S) == status, self.text
            # Every process that it has started has its output open.
            self._reader.join(GUARD_S)
            assert not self._reader.is_alive(), f"something is left of it:\n{self.text}"
        except subprocess.TimeoutExpired:
            raise AssertionError(f"it did not end:\n{self.text}") from None
        return self

    def end(self) -> None:
        """Kill Octave and all its children."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait(GUARD_S)
        self._reader.join(GUARD_S)
        self._process.stdin.close()

    def line(self, begin: str) -> str:
        """Return the rest of the one line that begins so."""
        found = [line for line in self.lines if line.startswith(begin)]
        assert len(found) == 1, self.text
        return found[0].removeprefix(begin)

    @property
    def text(self) -> str:
        """The output, for a person."""
        with self._news:
            return "\n".join(self.lines)

    def _read(self) -> None:
        with self._process.stdout as output:
            for line in output:
                with self._news:
                    if words := re.fullmatch(r"@(\w+) (\[[\d,]+\]) (.*)\n", line):
                        self.said[words[1]] = _value(json.loads(words[2]), json.loads(words[3]))
                    elif "ignoring const execution_exception" not in line:  # which Octave 7.3 says at each end
                        self.lines.append(line.rstrip("\n"))
                    self._news.notify_all()
        with self._news:
            self._is_over = True
            self._news.notify_all()


def run(program: str, folder: Path, environment: Mapping[str, str] | None = None) -> Octave:
    """Run a program to its end; it must have no error and leave no process.

    A line `EXPRESSION  %= VALUE` or `EXPRESSION  %= VALUE +- TOLERANCE` must have that value, and the text of a line
    `EXPRESSION  %~ PATTERN` must match as a whole.
    """
    expected: list[re.Match[str]] = []

    def say(line: re.Match[str]) -> str:
        expected.append(line)
        return f"say('line_{len(expected)}', {line[1]})"

    program = re.sub(r"^(.+?)  %([=~]) (.+?)(?: \+- (\S+))?$", say, program, flags=re.MULTILINE)
    with Octave(program, folder, environment) as octave:
        octave.finish()
    for number, line in enumerate(expected, 1):
        said = octave.said[f"line_{number}"]
        if line[2] == "~":
            assert re.fullmatch(line[3], said, re.DOTALL), (line[0], said)
            continue
        value = eval(line[3], {})
        if isinstance(value, list):
            assert said.shape == np.shape(value), (line[0], said)
            value = np.array(value)
        near = value if isinstance(value, str) else pytest.approx(value, abs=float(line[4] or 0))
        assert said == near, (line[0], said)
    return octave


def has_ended(process: int) -> bool:
    """Wait until a process is gone; its end can be waited for without looking again and again."""
    poll = select.poll()
    poll.register(process, select.POLLIN)
    try:
        return bool(poll.poll(GUARD_S * 1000))
    finally:
        os.close(process)


def _value(size: list[int], value: Any) -> Any:
    """Return a text, a number or a matrix."""
    if isinstance(value, str):
        return value
    if size == [1, 1]:
        return float("nan") if value is None else float(value)
    return np.array(value, np.float64).reshape(size)
