"""The output of programs: read line by line, kept, and printed with labels."""

from __future__ import annotations

import contextlib
import os
import select
import selectors
import threading
from collections.abc import Callable, Sequence
from typing import NamedTuple

from kiks.sim.ring_buffer import RingBuffer

OUTPUT_LIMIT = 1000
"""Number of lines of a program's output that are kept."""

LINE_LIMIT = 2000
"""Longest line of output that is kept [bytes]; a longer one is cut."""

PRINTED_LIMIT = 1 << 16
"""Longest line of output that is printed in one piece [bytes]."""

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

    def writer(self, number: int, name: str) -> LabelledWriter:
        """Return the writer for a program's output."""
        return LabelledWriter(self, number, f"{number} {name}".ljust(self._width) if self._has_several else "")

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


class LabelledWriter:
    """Prints the output of one program.

    Attributes:
        pause_s: Pause after which `show_unfinished` is called [s of real time]; None for never.
    """

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
        """Print lines.

        Raises:
            OSError: If the reader has gone.
        """
        head = self._heads[is_error]
        self._labels.write(b"".join(head + line + b"\n" for line in lines), is_error=is_error)

    def show_unfinished(self, text: bytes, is_error: bool) -> bool:
        """Print an unfinished line after a pause, such as a prompt; return whether it was printed."""
        if self._labels.are_terminals[is_error]:
            self._labels.write(self._heads[is_error] + text, is_error=is_error, is_unfinished=True)
        return self._labels.are_terminals[is_error]


class OutputReader:
    """Reads the output of a process; it never waits for those who look at what is kept.

    Args:
        kept: Gets the newest lines; None to keep none.
        writer: Prints the lines; None to print none.
        on_line: Called with each line.
    """

    def __init__(
        self, kept: RingBuffer[OutputLine] | None, writer: LabelledWriter | None, on_line: Callable[[str], None]
    ) -> None:
        self._kept, self._writer, self._on_line = kept, writer, on_line
        self._longest, self._pause_s = (LINE_LIMIT, None) if writer is None else (PRINTED_LIMIT, writer.pause_s)

    def read(self, pipes: dict[int, bool], on_bytes: Callable[[int], None]) -> None:
        """Read until the end.

        Args:
            pipes: Descriptors, which are closed then, and whether each is the standard error of the process.
            on_bytes: Called with the number of bytes that have come.
        """
        with selectors.DefaultSelector() as selector:
            unfinished = {}
            for pipe, is_error in pipes.items():
                selector.register(pipe, selectors.EVENT_READ, is_error)
                unfinished[is_error] = b""
            while selector.get_map():
                ready = selector.select(self._pause_s if any(unfinished.values()) else None)
                if not ready and self._writer is not None:
                    for is_error, rest in unfinished.items():
                        if rest and self._writer.show_unfinished(rest, is_error):
                            self._keep([rest], is_error)
                            unfinished[is_error] = b""
                for key, _ in ready:
                    is_error = key.data
                    piece = os.read(key.fd, _READ_SIZE)
                    on_bytes(len(piece))
                    *lines, rest = (unfinished[is_error] + piece).split(b"\n")
                    # A line without an end must not fill the memory.
                    if not piece or len(rest) > self._longest:
                        lines += [rest] if rest else []
                        rest = b""
                    unfinished[is_error] = rest
                    # If its reader has gone, the program gets an error, as its pipe is closed.
                    if not self._take(lines, is_error) or not piece:
                        selector.unregister(key.fd)
                        os.close(key.fd)

    def _take(self, lines: list[bytes], is_error: bool) -> bool:
        """Take lines; return False if those who read what is printed have gone."""
        for line in lines:
            self._on_line(_output_line(line, is_error).text)
        self._keep(lines, is_error)
        try:
            if self._writer is not None:
                self._writer.take(lines, is_error)
        except OSError:
            return False
        return True

    def _keep(self, lines: list[bytes], is_error: bool) -> None:
        if self._kept is not None:
            # A program may print faster than lines can be decoded that are never shown.
            skipped = max(len(lines) - OUTPUT_LIMIT, 0)
            self._kept.add([_output_line(each, is_error) for each in lines[skipped:]], skipped=skipped)


def _output_line(line: bytes, is_error: bool) -> OutputLine:
    return OutputLine(line[:LINE_LIMIT].decode(errors="replace").rstrip("\r"), is_error)
