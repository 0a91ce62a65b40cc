"""What a program of Octave or MATLAB and its session say to each other: lines come in, frames go out.

A frame is the length of what it says in eight digits, that, and blanks up to 96 characters. Octave cannot read a line
from a pipe without waiting for what comes after it (its `fgetl` looks one character ahead), but it can read so many
characters: one read is enough for nearly all answers.

While it reads, Ctrl-C has to wait. So an answer that takes long is preceded by frames `~`, four a second, from a thread
of their own, the pulse: between two of them Octave looks after Ctrl-C. The program confirms each with an empty line.
That shows that it still waits: without it, what can be held is held until the program says something again. What Ctrl-C
left unread is skipped by the program's next request: it begins with `CANCEL`, which calls off what is under way and is
answered by `MARK`.

This file imports little, so that there is a pulse while all the rest is being loaded.
"""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator

LINE_MAX = 1 << 26
"""Longest request [bytes]: an arena of 64 million cells in which no two neighbours are alike is longer."""

HEARD_MAX = 1000
"""So many requests are taken before the first of them has been answered."""

FRAME_MIN = 96
"""Shortest frame [bytes]."""

CANCEL = b"\x18"
"""How a line begins that calls off the request under way; what comes after it is repeated by the answer."""

MARK = b"\x01" * (2 * FRAME_MIN - 2)
"""How that answer begins: a program that is out of step finds its end, whatever it has read before."""

MARK_END = b"\x02"
"""What comes then, and nowhere else."""

LEAVE = b"\x04"
"""A line that says good-bye: the end of a pipe may be kept from showing by other children of Octave."""

PULSE_S = 0.25
"""Time between two frames that say that an answer is still awaited [s of real time]."""

HANDSHAKE_S = 20.0
"""How long the first word of a program is waited for [s of real time]: Ctrl-C may have come between start and talk."""

LOOK_MS = 1000
"""How often it is looked whether the program that started this one is there [ms of real time]."""

SPIN_NS = 1_000_000 if len(os.sched_getaffinity(0)) > 1 else 0
"""How long the next request is waited for without going to sleep [ns of real time]: a program in a loop sends it within
that, and being woken takes a third of what a whole exchange does. With a single core the program needs it itself."""

_READ_SIZE = 1 << 16


def frame(text: str) -> bytes:
    """Return an answer as it is sent.

    Example:
        >>> frame("+").rstrip()
        b'       1+'
    """
    data = text.encode(errors="replace").replace(MARK_END, b"?")
    return (b"%8d" % len(data) + data).ljust(FRAME_MIN)


STILL = frame("~")

GOES_ON = frame(">")


class Exchange:
    """A program at the other end of two descriptors. It begins with an answer that is awaited: the greeting.

    `lines` and `reply` belong to one thread, `beat` to the pulse.

    Args:
        source: Where its lines come from.
        sink: Where frames go.
        close: Called when it is over.
        parent: Number of the process that the program is, if it has started this one; 0 if another tells of its end.
        said: What it has said already.

    Attributes:
        is_cancelled: Whether nobody waits for the answer under way any more.
        is_held: Whether the program has not confirmed that it waits.
        has_left: Whether it has hung up or said good-bye.
        on_cancel: Called by the pulse while something is to be ended that is under way.
    """

    def __init__(
        self,
        source: int,
        sink: int,
        *,
        close: Callable[[], None] = lambda: None,
        parent: int = 0,
        said: bytes = b"",
    ) -> None:
        self.source = source
        self._close: Callable[[], None] | None = close
        self.is_cancelled = False
        self.is_held = False
        self.has_left = False
        self.on_cancel: Callable[[], None] = lambda: None
        self._sink = sink
        self._parent = parent
        self._lock = threading.Lock()
        self._poll = select.poll()
        self._poll.register(source, select.POLLIN)
        self._heard: deque[bytes] = deque()
        self._rest = bytearray()
        self._is_awaited = True
        self._since_ns = time.monotonic_ns()
        self._is_unconfirmed = False
        self._take(said)

    # ---- for the thread that answers ----

    def greet(self, text: str) -> bool:
        """Say who is here, and say whether the program asks for something then."""
        self.reply(text)
        deadline_ns = time.monotonic_ns() + int(HANDSHAKE_S * 1e9)
        while not any(self._heard):
            self._listen(LOOK_MS)
            if self.has_left or time.monotonic_ns() > deadline_ns:
                return any(self._heard)
        return True

    def lines(self) -> Iterator[str]:
        """Yield the requests, each when the one before has been answered, until the program has gone."""
        while (line := self._next()) is not None:
            if line.startswith(CANCEL):
                write_all(self._sink, MARK + MARK_END + line[len(CANCEL) :][:1])
            elif line:
                self.is_cancelled = False
                self._since_ns = time.monotonic_ns()
                self._is_awaited = True
                yield line.decode("utf-8", errors="replace")

    def reply(self, text: str) -> None:
        """Answer."""
        with self._lock:
            self._is_awaited = self._is_unconfirmed = self.is_held = False
        write_all(self._sink, frame(text))

    def hand_over(self) -> bytes:
        """Say and hear nothing more here: another does; return what the program has said."""
        with self._lock:
            self._is_awaited = False
            return b"".join(line + b"\n" for line in self._heard) + self._rest

    @property
    def is_orphaned(self) -> bool:
        """Say whether the program has gone that has started this process."""
        return self._parent != 0 and os.getppid() != self._parent

    def part(self) -> None:
        """Close both ways, once, with a frame that says that the session goes on without this program."""
        close, self._close = self._close, None
        if close is not None:
            with contextlib.suppress(OSError):
                if _has_room(self._sink):
                    write_all(self._sink, GOES_ON)
            close()

    # ---- for the pulse ----

    def beat(self) -> None:
        """Say that the answer is still awaited if it takes long, and hear whether the program waits."""
        if not self._takes_long():
            return
        with self._lock:
            if not self._takes_long():
                return
            if len(self._heard) < HEARD_MAX:
                self._listen(0)
            self.has_left = self.has_left or self.is_orphaned
            is_cancelled = any(line.startswith(CANCEL) for line in self._heard)
            self.is_cancelled = self.is_cancelled or self.has_left or is_cancelled
            self.is_held = self._is_unconfirmed
            if not self._is_unconfirmed and not self.has_left and _has_room(self._sink):
                with contextlib.suppress(OSError):
                    write_all(self._sink, STILL)
                self._is_unconfirmed = True
        if self.is_cancelled:
            self.on_cancel()

    # ---- inside ----

    def _takes_long(self) -> bool:
        return self._is_awaited and time.monotonic_ns() - self._since_ns >= PULSE_S * 1e9

    def _next(self) -> bytes | None:
        """Return the next line; None when there will be none."""
        begin_ns = time.perf_counter_ns()
        while not self._heard:
            if self.has_left:
                return None
            self._listen(0 if time.perf_counter_ns() - begin_ns < SPIN_NS else LOOK_MS)
        return self._heard.popleft()

    def _listen(self, wait_ms: int) -> None:
        """Take what the program says, waiting for it at most so long."""
        if self.has_left:
            return
        if not self._poll.poll(wait_ms):
            # Another child of Octave may hold the pipe open when Octave has gone.
            self.has_left = wait_ms != 0 and self.is_orphaned
            return
        try:
            piece = os.read(self.source, _READ_SIZE)
        except OSError:
            piece = b""
        self._take(piece)
        # Nobody can mean a longer line.
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
                self._heard.append(line)


class Heartbeat:
    """A thread that does some things again and again.

    Attributes:
        acts: What it does, each short and without an exception.
    """

    def __init__(self) -> None:
        self.acts: list[Callable[[], None]] = []
        self._is_over = threading.Event()
        threading.Thread(target=self._run, name="kiks pulse", daemon=True).start()

    def close(self) -> None:
        """End it."""
        self._is_over.set()

    def _run(self) -> None:
        while not self._is_over.wait(PULSE_S):
            for act in self.acts[:]:
                act()


def write_all(sink: int, data: bytes) -> None:
    """Write all of something on a descriptor."""
    while data:
        data = data[os.write(sink, data) :]


def _has_room(sink: int) -> bool:
    poll = select.poll()
    poll.register(sink, select.POLLOUT)
    return any(event & select.POLLOUT for _, event in poll.poll(0))
