"""The output of programs: read line by line, kept, and printed with labels."""

from __future__ import annotations

import contextlib
import os
import select
import selectors
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

from kiks.sim.ring_buffer import RingBuffer

OUTPUT_LIMIT = 1000
"""Number of lines of a program's output that are kept."""

LINE_LIMIT = 2000
"""Longest line of output that is kept [bytes]; a longer one is cut."""

PROMPT_S = 0.2
"""Pause after which a terminal shows an unfinished line [s of real time]: it may be a prompt."""

_READ_SIZE = 1 << 16
_STREAMS = {False: 1, True: 2}
"""Descriptors of the standard output and the standard error of this process, by whether it is the latter."""

_COLOURS = (36, 33, 35, 32, 34, 31)


class OutputLine(NamedTuple):
    """A line of output, and whether it came from standard error."""

    text: str
    is_error: bool


class OutputWriter(ABC):
    """Takes the output of a program, line by line.

    Attributes:
        longest: Longest line [bytes]; a longer one is split.
        pause_s: Pause after which `show_unfinished` is called [s of real time]; None for never.
    """

    longest = 1 << 16
    pause_s: float | None = None

    @abstractmethod
    def take(self, lines: list[bytes], is_error: bool) -> None:
        """Take lines.

        Raises:
            OSError: If the reader has gone.
        """

    def show_unfinished(self, text: bytes, is_error: bool) -> bool:
        """Take an unfinished line after a pause, such as a prompt; return whether it was taken."""
        return False


class OutputKeeper(OutputWriter):
    """Keeps the newest lines; it never waits for readers. If there is another writer, that takes them, too."""

    def __init__(self, output: RingBuffer[OutputLine], other: OutputWriter | None) -> None:
        self._output, self._other = output, other
        self.longest, self.pause_s = (LINE_LIMIT, None) if other is None else (other.longest, other.pause_s)

    def take(self, lines: list[bytes], is_error: bool) -> None:
        """Keep lines."""
        # A program may print faster than lines can be decoded that nobody will see.
        skipped = max(len(lines) - OUTPUT_LIMIT, 0)
        self._output.add([_output_line(each, is_error) for each in lines[skipped:]], skipped=skipped)
        if self._other is not None:
            self._other.take(lines, is_error)

    def show_unfinished(self, text: bytes, is_error: bool) -> bool:
        """Take an unfinished line if the other writer shows it."""
        if self._other is None or not self._other.show_unfinished(text, is_error):
            return False
        self._output.add([_output_line(text, is_error)])
        return True


class Labels:
    """Prints the output of several programs, line by line, each line with the label of its program.

    Labels are coloured on a terminal, unless NO_COLOR is set. A terminal also shows an unfinished line, such as a
    prompt, after a pause; elsewhere only complete lines are printed.

    Args:
        names: Names of the programs in their order; all labels have the same width. A single one needs none.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._lock = threading.Lock()
        self._has_unfinished, self._has_several = False, len(names) > 1
        self._width = max(len(f"{number} {name}") for number, name in enumerate(names, 1))
        self.are_terminals = {is_error: os.isatty(stream) for is_error, stream in _STREAMS.items()}

    def writer(self, number: int, name: str) -> OutputWriter:
        """Return the writer for a program's output."""
        return _LabelledWriter(self, number, f"{number} {name}".ljust(self._width) if self._has_several else "")

    def say(self, text: str) -> None:
        """Print a line of KiKS between those of the programs."""
        with contextlib.suppress(OSError):
            self.write(f"kiks: {text}\n".encode(errors="replace"), is_error=True)

    def write(self, data: bytes, *, is_error: bool, is_unfinished: bool = False) -> None:
        """Write lines, or the beginning of one.

        Raises:
            OSError: If the reader has gone.
        """
        with self._lock:
            data = b"\n" * self._has_unfinished + data
            self._has_unfinished = is_unfinished
            stream = _STREAMS[is_error]
            while data:
                try:
                    data = data[os.write(stream, data) :]
                except BlockingIOError:
                    select.select([], [stream], [])


class _LabelledWriter(OutputWriter):
    """Writes the output of one program."""

    def __init__(self, labels: Labels, number: int, label: str) -> None:
        self._labels = labels
        self.pause_s = PROMPT_S if any(labels.are_terminals.values()) else None
        plain, colour = f"{label} |".encode(errors="replace") if label else b"", _COLOURS[(number - 1) % len(_COLOURS)]
        has_colours = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
        coloured = b"\033[%dm%b\033[0m" % (colour, plain)
        self._heads = {
            is_error: (coloured if has_colours and is_terminal else plain) + b" " if plain else b""
            for is_error, is_terminal in labels.are_terminals.items()
        }

    def take(self, lines: list[bytes], is_error: bool) -> None:
        head = self._heads[is_error]
        self._labels.write(b"".join(head + line + b"\n" for line in lines), is_error=is_error)

    def show_unfinished(self, text: bytes, is_error: bool) -> bool:
        if self._labels.are_terminals[is_error]:
            self._labels.write(self._heads[is_error] + text, is_error=is_error, is_unfinished=True)
        return self._labels.are_terminals[is_error]


def read_output(
    pipes: dict[int, bool], writer: OutputWriter, on_line: Callable[[str], None], note: Callable[[int], None]
) -> None:
    """Read the output of a process until its end.

    Args:
        pipes: Descriptors, which are closed then, and whether each is its standard error.
        writer: Takes the lines.
        on_line: Called with each line.
        note: Called with the number of bytes that have come.
    """
    with selectors.DefaultSelector() as selector:
        unfinished = {}
        for pipe, is_error in pipes.items():
            selector.register(pipe, selectors.EVENT_READ, is_error)
            unfinished[is_error] = b""
        while selector.get_map():
            ready = selector.select(writer.pause_s if any(unfinished.values()) else None)
            if not ready:
                for is_error, rest in unfinished.items():
                    if rest and writer.show_unfinished(rest, is_error):
                        unfinished[is_error] = b""
            for key, _ in ready:
                is_error = key.data
                piece = os.read(key.fd, _READ_SIZE)
                note(len(piece))
                *lines, rest = (unfinished[is_error] + piece).split(b"\n")
                # A line without an end must not fill the memory.
                if not piece or len(rest) > writer.longest:
                    lines += [rest] if rest else []
                    rest = b""
                unfinished[is_error] = rest
                for line in lines:
                    on_line(_output_line(line, is_error).text)
                try:
                    writer.take(lines, is_error)
                except OSError:
                    # The reader has gone. Closing the pipe reports that to the program.
                    piece = b""
                if not piece:
                    selector.unregister(key.fd)
                    os.close(key.fd)


def _output_line(line: bytes, is_error: bool) -> OutputLine:
    return OutputLine(line[:LINE_LIMIT].decode(errors="replace").rstrip("\r"), is_error)
