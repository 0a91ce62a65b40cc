"""Octave at a terminal: tests type lines, press Ctrl-C and wait for output."""

import contextlib
import os
import pty
import re
import select
import signal
import time
from pathlib import Path

from tests.matlab.octave import GUARD_S, OCTAVE, SUPPORT, TOOLBOX

CTRL_C = b"\x03"

AGAIN_S = 5.0
"""After so long a question is typed again [s]: at its prompt Ctrl-C makes Octave forget what was typed after it."""

BEGIN = (
    f"PS1(''); more off; addpath('{TOOLBOX}'); addpath('{SUPPORT}'); "
    "global KIKS_THINKING, KIKS_THINKING = 'none'; disp(['be' 'gun'])"
)


class Terminal:
    """Octave, or another command, that reads from a terminal.

    Args:
        folder: Where it runs, and where its sessions are found.
        environment: Variables of the environment besides those that there are.
        edits_lines: Whether Octave edits the lines that are typed, as it does for people.
        command: What runs in place of Octave.

    Attributes:
        number: Of Octave's process.
        end: Descriptor of this end of the terminal.
    """

    def __init__(
        self,
        folder: Path,
        environment: dict[str, str] | None = None,
        *,
        edits_lines: bool = False,
        command: list[str] | None = None,
    ) -> None:
        self.doors = folder / "doors"
        self.doors.mkdir(mode=0o700, exist_ok=True)
        own = {"KIKS_WINDOW": "0", "XDG_RUNTIME_DIR": str(self.doors), **(environment or {})}
        self.number, self.end = pty.fork()
        if self.number == 0:
            os.chdir(folder)
            plain = [] if edits_lines else ["--no-line-editing"]
            words = command or [OCTAVE, "--no-gui", "-qf", *plain, "--no-history"]
            os.execve(words[0], words, os.environ | own)
        self._text = ""
        self._questions = 0
        if command is None:
            self.type(BEGIN)
            self.wait_for("begun")

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.number, signal.SIGKILL)
        os.close(self.end)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(self.number, 0)

    def type(self, line: str) -> None:
        os.write(self.end, f"{line}\n".encode())

    def press_ctrl_c(self) -> None:
        """Press Ctrl-C: the foreground processes of the terminal get SIGINT."""
        os.write(self.end, CTRL_C)

    def wait_for(self, pattern: str, seconds: float = GUARD_S) -> str:
        """Wait for a printed text and return it; earlier output is dropped."""
        end_s = time.monotonic() + seconds
        while (found := re.search(pattern, self._text)) is None:
            left_s = end_s - time.monotonic()
            assert left_s > 0, f"it has not printed {pattern!r}:\n{self._text}"
            self._hear(left_s)
        self._text = self._text[found.end() :]
        return found[0]

    def ask(self, expression: str) -> str:
        """Return what Octave prints for an expression that is a number, now or, if Ctrl-C has lost it, asked again."""
        self._questions += 1
        for _ in range(int(GUARD_S / AGAIN_S)):
            self.type(f"fprintf('<%s %d %.15g>\\n', 'answer', {self._questions}, double({expression}))")
            with contextlib.suppress(AssertionError):
                return self.wait_for(f"<answer {self._questions} [^>]*>", AGAIN_S).split()[2][:-1]
        raise AssertionError(f"it has not answered {expression}:\n{self._text}")

    def has_printed(self, text: str) -> bool:
        """Return whether there is output for which the test has not waited."""
        self._hear(0.01)
        return text in self._text

    def kill(self) -> None:
        """Kill Octave, and nothing else."""
        os.kill(self.number, signal.SIGKILL)

    def sessions(self) -> list[int]:
        """Return the numbers of the processes that Octave has started and that run."""
        children = Path(f"/proc/{self.number}/task/{self.number}/children").read_text(encoding="ascii").split()
        return [int(child) for child in children if state(int(child)) != "Z"]

    def _hear(self, seconds: float) -> None:
        if select.select([self.end], [], [], seconds)[0]:
            try:
                self._text += os.read(self.end, 1 << 16).decode(errors="replace")
            except OSError as error:
                raise AssertionError(f"Octave has ended:\n{self._text}") from error


def state(number: int) -> str:
    """Return the letter for what a process does: S sleeps, Z has ended, and so has one that is not there."""
    words = _words(number)
    return words[0] if words else "Z"


def processor_ticks(number: int) -> float:
    """Return how much processor time a process has had [ticks of 10 ms]; infinite if it has ended."""
    words = _words(number)
    return int(words[11]) + int(words[12]) if words and words[0] != "Z" else float("inf")


def _words(number: int) -> list[str]:
    try:
        return Path(f"/proc/{number}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return []
