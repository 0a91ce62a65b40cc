"""Framing of the messages between a program of Octave or MATLAB and its session: lines come in, frames go out.

A frame is the length of its text in eight digits, the text, and blanks up to 96 characters. Octave cannot read a line
from a pipe without waiting for the next character (its `fgetl` reads one character ahead), but it can read a known
number of characters: one read is enough for nearly all answers.

Octave ignores Ctrl-C while it reads. So the heartbeat, a thread, sends frames `~` before a slow answer, four a second;
between two of them Octave handles Ctrl-C. The program confirms each frame with an empty line, which shows that it still
waits; without it, a pause is held until the program sends something. After Ctrl-C, the next request begins with
`CANCEL`: it cancels the request under way, and its answer begins with `MARK`, up to which the program skips all input.

This file imports little, so that the heartbeat runs while all other modules are being loaded.
"""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator

from kiks.ports.messages import AwaitedAnswer
from kiks.ports.resources import processor_count

LINE_MAX = 1 << 26
"""Longest request [bytes]: enough for all arenas except very large ones of noise."""

QUEUED_MAX = 1000
"""Maximum number of requests that are read ahead."""

FRAME_MIN = 96
"""Shortest frame [bytes]."""

CANCEL = b"\x18"
"""First byte of a line that cancels the request under way; the answer repeats the byte after it."""

MARK = b"\x01" * (2 * FRAME_MIN - 2)
"""Start of that answer: long enough for a program that is out of step to find its end."""

MARK_END = b"\x02"
"""End of the mark; no other answer contains it."""

LEAVE = b"\x04"
"""Line with which a program leaves: other children of Octave may keep the pipe open after it has ended."""

HEARTBEAT_S = 0.25
"""Period of the frames that announce a slow answer [s of real time]."""

HANDSHAKE_S = 20.0
"""Timeout of the first request [s of real time]: Ctrl-C may have interrupted the program just after the start."""

POLL_MS = 1000
"""Period at which the end of the parent process is polled [ms of real time]."""

SPIN_NS = 1_000_000 if processor_count() > 1 else 0
"""Time for which the next request is polled without sleeping [ns of real time]: a program in a loop sends it within
that time, and a wake-up takes a third of a whole exchange. On a single core the program needs the processor itself."""

_READ_SIZE = 1 << 16


def frame(text: str) -> bytes:
    """Return the frame of a text.

    Example:
        >>> frame("+").rstrip()
        b'       1+'
    """
    data = text.encode(errors="replace").replace(MARK_END, b"?")
    return (b"%8d" % len(data) + data).ljust(FRAME_MIN)


BUSY = frame("~")

SESSION_GOES_ON = frame(">")


class Exchange(AwaitedAnswer):
    """The connection to a program over two descriptors. At first the program waits for the greeting.

    One thread calls `lines` and `reply`; the heartbeat calls `beat`.

    Args:
        source: Descriptor from which its lines come.
        sink: Descriptor to which frames go.
        close: Closes the connection.
        parent: Process number of the program if it has started this process, else 0.
        said: The bytes received so far.

    Attributes:
        has_left: Whether it has closed the connection or sent `LEAVE`.
        on_cancel: Called by the heartbeat while a cancelled request is under way.
    """

    def __init__(
        self, source: int, sink: int, *, close: Callable[[], None] = lambda: None, parent: int = 0, said: bytes = b""
    ) -> None:
        super().__init__()
        self.source = source
        self._close: Callable[[], None] | None = close
        self.has_left = False
        self.on_cancel: Callable[[], None] = lambda: None
        self._sink = sink
        self._parent = parent
        self._lock = threading.Lock()
        self._poll = select.poll()
        self._poll.register(source, select.POLLIN)
        self._queue: deque[bytes] = deque()
        self._rest = bytearray()
        self._is_awaited = True
        self._since_ns = time.monotonic_ns()
        self._is_unconfirmed = False
        self._take(said)

    # ---- for the thread that answers ----

    def greet(self, text: str) -> bool:
        """Send the greeting and wait for the first request; return False if none comes."""
        self.reply(text)
        deadline_ns = time.monotonic_ns() + int(HANDSHAKE_S * 1e9)
        while not any(self._queue):
            self._receive(POLL_MS)
            if self.has_left or time.monotonic_ns() > deadline_ns:
                return any(self._queue)
        return True

    def lines(self) -> Iterator[str]:
        """Yield requests, each after the answer to the one before, until the program leaves."""
        while (line := self._next()) is not None:
            if line.startswith(CANCEL):
                write_all(self._sink, MARK + MARK_END + line[len(CANCEL) :][:1])
            elif line:
                self.is_cancelled = False
                self._since_ns = time.monotonic_ns()
                self._is_awaited = True
                yield line.decode("utf-8", errors="replace")

    def reply(self, text: str) -> None:
        """Send an answer."""
        with self._lock:
            self._is_awaited = self._is_unconfirmed = self.is_held = False
        write_all(self._sink, frame(text))

    def hand_over(self) -> bytes:
        """Stop receiving and sending here, and return the unprocessed input for another receiver."""
        with self._lock:
            self._is_awaited = False
            return b"".join(line + b"\n" for line in self._queue) + self._rest

    @property
    def is_orphaned(self) -> bool:
        """Whether the program that has started this process has ended."""
        return self._parent != 0 and os.getppid() != self._parent

    def close(self) -> None:
        """Close the connection, once, after a frame that says that the session goes on without this program."""
        close, self._close = self._close, None
        if close is not None:
            with contextlib.suppress(OSError):
                if _has_room(self._sink):
                    write_all(self._sink, SESSION_GOES_ON)
            close()

    # ---- for the heartbeat ----

    def beat(self) -> None:
        """Announce a slow answer, and check whether the program still waits for it."""
        if not self._takes_long():
            return
        with self._lock:
            if not self._takes_long():
                return
            if len(self._queue) < QUEUED_MAX:
                self._receive(0)
            self.has_left = self.has_left or self.is_orphaned
            is_cancelled = any(line.startswith(CANCEL) for line in self._queue)
            self.is_cancelled = self.is_cancelled or self.has_left or is_cancelled
            self.is_held = self._is_unconfirmed
            if not self._is_unconfirmed and not self.has_left and _has_room(self._sink):
                with contextlib.suppress(OSError):
                    write_all(self._sink, BUSY)
                self._is_unconfirmed = True
        if self.is_cancelled:
            self.on_cancel()

    # ---- inside ----

    def _takes_long(self) -> bool:
        return self._is_awaited and time.monotonic_ns() - self._since_ns >= HEARTBEAT_S * 1e9

    def _next(self) -> bytes | None:
        """Return the next line; None when the program has left."""
        begin_ns = time.perf_counter_ns()
        while not self._queue:
            if self.has_left:
                return None
            self._receive(0 if time.perf_counter_ns() - begin_ns < SPIN_NS else POLL_MS)
        return self._queue.popleft()

    def _receive(self, timeout_ms: int) -> None:
        """Queue the lines that arrive within a timeout."""
        if self.has_left:
            return
        if not self._poll.poll(timeout_ms):
            # Another child of Octave may hold the pipe open after Octave has ended.
            self.has_left = timeout_ms != 0 and self.is_orphaned
            return
        try:
            piece = os.read(self.source, _READ_SIZE)
        except OSError:
            piece = b""
        self._take(piece)
        if not piece or len(self._rest) > LINE_MAX:
            self.has_left = True

    def _take(self, piece: bytes) -> None:
        self._rest += piece
        if b"\n" not in piece:
            return
        *lines, last = bytes(self._rest).split(b"\n")
        self._rest = bytearray(last)
        for line in lines:
            if line == LEAVE:
                self.has_left = True
            elif not line and self._is_unconfirmed:
                self._is_unconfirmed = False
            elif not self.has_left:
                self._queue.append(line)


class Heartbeat:
    """A thread that calls functions periodically.

    Attributes:
        acts: The functions; each must be short and raise nothing.
    """

    def __init__(self) -> None:
        self.acts: list[Callable[[], None]] = []
        threading.Thread(target=self._run, name="kiks heartbeat", daemon=True).start()

    def _run(self) -> None:
        while True:
            time.sleep(HEARTBEAT_S)
            for act in self.acts[:]:
                act()


def write_all(sink: int, data: bytes) -> None:
    """Write all bytes to a descriptor."""
    while data:
        data = data[os.write(sink, data) :]


def _has_room(sink: int) -> bool:
    poll = select.poll()
    poll.register(sink, select.POLLOUT)
    return any(event & select.POLLOUT for _, event in poll.poll(0))
