"""Thinking time: the time that the user's program needs between a reply and its next command.

Commands that a program sends without reading in between, also to several robots, follow from one thought. Threads think
for themselves, as programs do.

`none` and `fixed` are repeatable; `live` measures the program on this computer and is not; `replay` repeats, to the
nanosecond, what an earlier `live` run measured.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from time import perf_counter_ns

from kiks.errors import ParameterError
from kiks.model.atomic_files import replace_file
from kiks.model.limits import REPLAY_FILE_BYTES_MAX
from kiks.model.thinking_policy import split_thinking

DIGITS_MAX = 13
"""Most digits of a time [ns]: no program thinks for three hours, and a simulation of years would seem to hang."""


class Thinking:
    """A policy: `enter` is called when the program calls a port, `leave` when the port returns. This one is free."""

    def enter(self, *, is_command: bool) -> int:
        """Return the time to charge at a call [ns]; `is_command`: whether it sends, as the first call since a reply."""
        return 0

    def leave(self) -> None:
        """Note that the program goes on."""

    def set_thought(self, time_ns: int) -> None:
        """Note for how long the program has thought by now [ns]: the time since `leave` was not all its own."""

    def thought_ns(self) -> int:
        """Return the measured time since `leave` [ns]; 0 if there is none."""
        return 0


class ThinkingFixed(Thinking):
    """The same time before every command; 0 is `none`."""

    def __init__(self, time_ns: int) -> None:
        self.time_ns = time_ns

    def enter(self, *, is_command: bool) -> int:
        """Return the fixed time before a command, 0 otherwise."""
        return self.time_ns if is_command else 0


class ThinkingLive(Thinking):
    """The measured time times a factor for another computer (2: half as fast as this one)."""

    def __init__(self, factor: float) -> None:
        self.factor = factor
        self.measured_ns: list[int] = []
        self._left_ns: int | None = None
        self._repeated: Iterator[int] = iter(())

    def repeat(self, measured_ns: Iterable[int]) -> None:
        """Charge these times first, in their order, as a run is made again that has measured them [ns]."""
        self._repeated = iter(measured_ns)

    def enter(self, *, is_command: bool) -> int:
        """Return the time since the port returned."""
        passed_ns = next(self._repeated, -1)
        if passed_ns < 0:
            passed_ns = round(self.thought_ns() * self.factor)
        self.measured_ns.append(passed_ns)
        return passed_ns

    def leave(self) -> None:
        """Start to measure."""
        self._left_ns = perf_counter_ns()

    def set_thought(self, time_ns: int) -> None:
        """Go on from a measured time [ns]."""
        self._left_ns = perf_counter_ns() - time_ns

    def thought_ns(self) -> int:
        """Return the time since the port returned [ns]."""
        return 0 if self._left_ns is None else perf_counter_ns() - self._left_ns


class ThinkingReplay(Thinking):
    """The times of an earlier run, in their order; 0 after the last."""

    def __init__(self, measured_ns: list[int]) -> None:
        self._times = iter(measured_ns)

    def enter(self, *, is_command: bool) -> int:
        """Return the next recorded time."""
        return next(self._times, 0)


def parse_thinking(text: str) -> Thinking:
    """Return the policy that a text names.

    Args:
        text: 'none', 'fixed:2.5' (ms before each command), 'live', 'live:0.5' (measured, times a factor) or
            'replay:FILE' (one time [ns] a line, written by `save_thinking`).

    Example:
        >>> parse_thinking("fixed:2.5").enter(is_command=True)
        2500000
    """
    name, value = split_thinking(text)
    if isinstance(value, str):
        return ThinkingReplay(_read_times(Path(value)))
    return ThinkingLive(value) if name == "live" else ThinkingFixed(round(value * 1e6))


def charged_ns(text: str) -> int:
    """Return what a policy charges for each command, whatever the program does [ns]; 0 if it follows from the program.

    Example:
        >>> charged_ns("fixed:2.5"), charged_ns("live")
        (2500000, 0)
    """
    name, value = split_thinking(text)
    return round(float(value) * 1e6) if name == "fixed" else 0


def own_file(file: str, number: int, program_count: int) -> str:
    """Return the file with the thinking times of one of some programs."""
    return f"{file}.{number}" if program_count > 1 else file


def own_policy(thinking: str, number: int, program_count: int) -> str:
    """Return the policy of one of some programs; each repeats the times of its own."""
    return own_file(thinking, number, program_count) if thinking.startswith("replay:") else thinking


def save_thinking(measured_ns: list[int], path: str | Path) -> None:
    """Write the times that a live run measured [ns], one a line, for 'replay:FILE'."""
    replace_file(path, "".join(f"{time_ns}\n" for time_ns in measured_ns), "thinking times")


def _read_times(path: Path) -> list[int]:
    # Imported here, with its parser of data files: the processes of programs read none, and start fast.
    from kiks.model.data_file import read_file

    what = f"replay file {str(path)!r}"
    lines = read_file(path, what, bytes_max=REPLAY_FILE_BYTES_MAX).splitlines()
    for number, line in enumerate(lines, 1):
        if not line.isdigit() or len(line) > DIGITS_MAX:
            # The message leaves the line out, because the user may have named a private file by mistake.
            raise ParameterError(
                f"{what}, line {number}, must be a whole number of ns of at most {DIGITS_MAX} digits, but it is "
                "something else. Record a run again with thinking 'live'."
            )
    return [int(line) for line in lines]
