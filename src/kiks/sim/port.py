"""A serial port in simulated time: what a program sees of it, wherever the simulation runs.

It has the methods of a pyserial port, so a program cannot tell the difference. Between it and the robot lies its line:
in memory (`local_line.py`) or into a world that programs share (`ports/link.py`). The port knows what thinking,
polling and waiting cost a program; the line lets that time pass and carries the characters.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from io import DEFAULT_BUFFER_SIZE
from operator import index
from typing import Any, Protocol, Self

from kiks.clock.program_clock import ProgramClock
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import LinkError, ParameterError, shown
from kiks.model.checks import SECONDS_MAX, check_count, check_number
from kiks.sim.read_completion import NEVER_NS, REPLY_END, Read, is_ended
from kiks.units import character_ns, ns_from_s, s_from_ns, wait_ns

BAUD_MIN = 75
BAUD_MAX = 4_000_000

ZEROS_MAX = 1_000_000
"""Most zeros that a number in place of bytes may stand for."""


class Line(Protocol):
    """The way from a port to its robot. The program's time is `now_ns`; methods may advance it, never turn it back."""

    @property
    def lock(self) -> AbstractContextManager[Any]:
        """Held while the line is used, if several threads may use it."""

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""

    @property
    def now_ns(self) -> int:
        """The program's time [ns]."""

    @property
    def known_ns(self) -> int:
        """The same as far as it is known without joining the world, which may have begun before the program [ns]."""

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]."""

    def think(self, time_ns: int) -> None:
        """Let the time pass that the program has thought [ns]."""

    def send(self, data: bytes, spare: int) -> bool:
        """Put characters on the line and return True, if it has room for them and some more; else return False."""

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator, whichever comes first, until the timeout.

        Args:
            size: How many at most; None: up to the terminator.
            terminator: What ends the read, as of a `Read`.
            timeout_ns: Longest wait [ns]; None: for ever.
            poll_ns: What the read costs at least if it times out [ns].

        Raises:
            LinkError: If the wait could have no end.
        """

    @property
    def taken_ns(self) -> int:
        """When the last character arrived that was read [ns]."""

    def arrived_count(self) -> int:
        """Return how many characters have arrived and were not read."""

    def sent_ns(self) -> int:
        """Return when everything will have been sent [ns]."""

    def room_ns(self, count: int) -> int:
        """Return when the line has room for some characters [ns]; a time that is over: it has."""

    def wait_for_room(self, until_ns: int) -> None:
        """Let time pass up to a time [ns], or until `wake`."""

    def wake(self) -> None:
        """Let threads that read or wait for room see whether they still must; they return what has arrived."""

    def wait_for(self, reads: Sequence[Read], until_ns: int) -> list[bool]:
        """Let time pass until one of several reads is complete, or up to a time [ns]; read no character.

        Do nothing with `NEVER_NS` and no command on any of the lines.

        Args:
            reads: The reads to wait for, on lines of the same world.
            until_ns: When the wait ends at the latest [ns]; `NEVER_NS` if it has no end.

        Returns:
            Whether each of them is complete.
        """

    def drop_arrived(self) -> None:
        """Drop the characters that have arrived and were not read."""

    def set_baud(self, baud: int) -> None:
        """Set both ends to a speed [bit/s]."""

    def claim(self, holder: str) -> None:
        """Reserve the line for one program.

        Raises:
            LinkError: If another program holds it.
        """

    def hang_up(self) -> None:
        """Release the line and drop what was not read."""

    def stand(self, stands: bool) -> None:
        """Tell the world that a debugger has stopped the program, or lets it go on."""

    def look(self) -> tuple[Any, ...]:
        """Return what `kiks.sim.robot_state.state_of` returns of the line's robot."""


class Closed:
    """Stands in for what was closed: any use but another `close` raises an error that says so."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # Python asks each object for such names
            raise AttributeError(name)
        raise LinkError("a port must be open to be used, but this one is closed. Open it again, or close it later.")

    def close(self) -> None:
        """Do nothing."""

    def wake(self) -> None:
        """Do nothing."""


CLOSED: Any = Closed()


class WriteTimeoutError(LinkError):
    """The line has not taken all characters within the timeout."""


WHOLE, EACH, LAST = object(), object(), object()
"""What the timeout of a read is for, as in pyserial: all characters; each character; all, but the last one that comes
in time may be followed by one more, with a timeout of its own."""


class VirtualPort:
    """The computer's end of a simulated robot's line.

    Args:
        line: The way to the robot.
        program: Charges thinking and polling to the program whose port this is.
    """

    def __init__(self, line: Line, program: ProgramClock) -> None:
        self.timeout = None
        self.write_timeout = None
        self.line: Line = line
        self._program = program
        # The thread that has read last here: another one may write what follows from that.
        self._reader = program.thread
        self._reader.has_read = True
        self._is_read_cancelled = False
        self._is_write_cancelled = False

    # ---- what pyserial's ports have ----

    @property
    def timeout(self) -> float | None:
        """Longest simulated time that a read waits [s]; None waits without end."""
        return self._timeout_s

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self._timeout_ns = _timeout_ns("timeout", timeout_s)
        self._timeout_s = timeout_s

    @property
    def write_timeout(self) -> float | None:
        """Longest simulated time that a write waits for room on the line [s]; None waits without end."""
        return self._write_timeout_s

    @write_timeout.setter
    def write_timeout(self, timeout_s: float | None) -> None:
        self._write_timeout_ns = _timeout_ns("write_timeout", timeout_s)
        self._write_timeout_s = timeout_s

    @property
    def baudrate(self) -> int:
        """Speed of the line [bit/s]; setting it sets the robot's end too, as its mode selector would."""
        return self.line.baud

    @baudrate.setter
    def baudrate(self, baud: int) -> None:
        baud = check_count("baudrate", baud, BAUD_MIN, BAUD_MAX, "Usual: 9600 bit/s.")
        with self.line.lock:
            self.line.set_baud(baud)

    def write(self, data: bytes) -> int:
        """Send characters; return how many. They go out one after the other while the program goes on.

        The driver's buffer holds 4096 characters; a write waits for room. With a `write_timeout` of 0 it takes as many
        as there is room for.

        Raises:
            TypeError: If they are a text, or no numbers at all, as in pyserial.
            WriteTimeoutError: If there is no room for all of them within the `write_timeout`; some have been sent.
        """
        if data.__class__ is not bytes:
            data = _characters(data)
        line, program = self.line, self._program
        with line.lock:
            if program.thinks:
                self._think(is_command=self._reader.has_read or program.thread.has_read)
                self._reader.has_read = program.thread.has_read = False
            count = len(data)
            # Like pyserial, which goes on when the driver would take one more.
            if count and (self._is_write_cancelled or not line.send(data, 1)):
                count = self._write_in_pieces(data)
            program.leave(has_acted=True)
        return count

    def read(self, size: int = 1) -> bytes:
        """Return `size` characters, fewer after the timeout.

        Raises:
            LinkError: If there is no timeout and no reply can come any more.
        """
        return self._read(_count(size), None, WHOLE)

    def receive(self, size: int) -> bytes:
        """Return the replies that have arrived whole, in `size` characters at most; wait for one, up to the timeout.

        Raises:
            LinkError: If there is no timeout and no reply can come any more.
        """
        return self._read(_count(size), REPLY_END, WHOLE)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Return everything up to and including a terminator, less after the timeout, which is for the whole.

        Raises:
            LinkError: If there is no timeout and no reply can come any more.
        """
        if expected.__class__ is not bytes:
            expected = _characters(expected)
        if self._timeout_ns == 0:
            return self._read(1, None, WHOLE)  # pyserial looks at its timeout after each character
        return self._read(None if size is None else max(index(size), 1), expected or None, LAST)

    def readline(self, size: int | None = -1) -> bytes:
        """Return a line with its end, or the part of it up to a character that is late: each one has the timeout anew.

        Raises:
            LinkError: If there is no timeout and no reply can come any more.
        """
        try:
            count = -1 if size is None else index(size)
        except TypeError:
            raise TypeError(f"argument should be integer or None, not {type(size).__name__!r}") from None
        return self._read(None if count < 0 else count, b"\n", EACH)

    def readlines(self, hint: int | None = -1) -> list[bytes]:
        """Return lines, until one is empty or, with a hint from 1, they have so many characters."""
        lines, count = [], 0
        for line in self:
            lines.append(line)
            count += len(line)
            if hint is not None and 0 < index(hint) <= count:
                break
        return lines

    def __iter__(self) -> Iterator[bytes]:
        return self

    def __next__(self) -> bytes:
        line = self.readline()
        if not line:
            raise StopIteration
        return line

    def iread_until(self, expected: bytes = b"\n", size: int | None = None) -> Iterator[bytes]:
        """Yield what `read_until` returns, until nothing comes within a timeout."""
        while part := self.read_until(expected, size):
            yield part

    def read_all(self) -> bytes:
        """Return the characters that have arrived."""
        return self.read(self.in_waiting)

    def readall(self) -> bytes:
        """Return all that comes, until nothing does within a timeout."""
        return b"".join(iter(lambda: self.read(DEFAULT_BUFFER_SIZE), b""))

    def readinto(self, buffer: Any, /) -> int:
        """Read as many characters as a buffer holds, fewer after the timeout; return how many."""
        data = self.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def writelines(self, lines: Iterable[bytes]) -> None:
        """Send what each item holds."""
        for line in lines:
            self.write(line)

    @property
    def in_waiting(self) -> int:
        """Number of characters that have arrived and were not read. Repeated polls let time pass."""
        with self.line.lock:
            self._ask()
            return self.line.arrived_count()

    @property
    def out_waiting(self) -> int:
        """Number of characters that have not been sent yet. Repeated polls let time pass."""
        with self.line.lock:
            self._ask()
            left_ns = self.line.sent_ns() - self.line.now_ns
            return -(-left_ns // character_ns(self.line.baud)) if left_ns > 0 else 0

    def flush(self) -> None:
        """Wait until everything has been sent."""
        with self.line.lock:
            self.line.pass_to(self.line.sent_ns())

    def reset_input_buffer(self) -> None:
        """Drop the characters that have arrived and were not read."""
        with self.line.lock:
            self.line.drop_arrived()

    def cancel_read(self) -> None:
        """End the read of another thread, or the next one, at once, with what it has got."""
        self._is_read_cancelled = True
        self.line.wake()

    def cancel_write(self) -> None:
        """End the write of another thread, or the next one, instead of waiting for room."""
        self._is_write_cancelled = True
        self.line.wake()

    def reset_output_buffer(self) -> None:
        """Drop nothing: what was written is on its way to the robot.

        Raises:
            LinkError: If the port is closed.
        """
        _ = self.line.lock

    def claim(self, holder: str) -> None:
        """Reserve the line for this port, as opening it by name does; `close` releases it.

        Args:
            holder: Name of the program, for the error message of the next one that tries.

        Raises:
            LinkError: If another program holds it.
        """
        self.line.claim(holder)

    def close(self) -> None:
        """Close the port and drop what was not read. The robot drives on; this port is of no use any more."""
        line, self.line = self.line, CLOSED
        if line is not CLOSED:
            with line.lock:
                line.hang_up()

    @property
    def is_open(self) -> bool:
        """Whether it can be used."""
        return self.line is not CLOSED

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # ---- the program's time ----

    def ask_ns(self) -> int:
        """Return the simulated time [ns]. Repeated polls let time pass, so a loop may wait for a time."""
        with self.line.lock:
            self._ask()
            return self.line.now_ns

    @property
    def time_s(self) -> float:
        """The simulated time [s], polled in the same way."""
        return s_from_ns(self.ask_ns())

    def sleep(self, seconds: float) -> None:
        """Let simulated time pass [s] without waiting for it."""
        passing_ns = wait_ns(check_number("seconds", seconds, 0, SECONDS_MAX, "Time never runs backwards."))
        with self.line.lock:
            if self._program.thinks:
                self._think(is_command=False)
            self.line.pass_to(self.line.now_ns + passing_ns)
            self._program.leave(has_acted=True)

    # ---- inside ----

    def _think(self, *, is_command: bool) -> None:
        """Charge the time that the program has computed."""
        time_ns = self._program.enter(is_command=is_command)
        if time_ns:
            self.line.think(time_ns)

    def _ask(self) -> None:
        """Charge a poll."""
        if self._program.thinks:
            self._think(is_command=False)
        cost_ns = self._program.ask()
        if cost_ns:
            self.line.pass_to(self.line.now_ns + cost_ns)
        self._program.leave(has_acted=False)

    def _read(self, size: int | None, terminator: bytes | None, span: object) -> bytes:
        line, program, timeout_ns = self.line, self._program, self._timeout_ns
        with line.lock:
            if program.thinks:
                self._think(is_command=False)
                self._reader = program.thread
                self._reader.has_read = True
            # A read that does not wait is a poll.
            poll_ns = program.ask() if timeout_ns == 0 and size != 0 else 0
            begin_ns = line.now_ns
            if self._is_read_cancelled:
                data = self._read_on(b"", size, terminator, begin_ns, span)
            else:
                data = line.read(size, terminator, timeout_ns, poll_ns)
                if len(data) != size and not is_ended(data, terminator):
                    data = self._read_on(data, size, terminator, begin_ns, span)
            if program.thinks:
                # Again: while this thread waited, the command of another one may have followed from an earlier reply.
                self._reader = program.thread
                self._reader.has_read = True
            program.leave(has_acted=bool(data))
        return data

    def _read_on(self, data: bytes, size: int | None, terminator: bytes | None, begin_ns: int, span: object) -> bytes:
        """Go on with a read that is not complete: its timeout may not be over, and another thread may have ended it.

        Args:
            data: What it has got.
            size: As for `Line.read`.
            terminator: As for `Line.read`.
            begin_ns: When it began [ns].
            span: What the timeout is for.
        """
        timeout_ns = self._timeout_ns
        while len(data) != size and not is_ended(data, terminator):
            if self._is_read_cancelled:
                self._is_read_cancelled = False
                break
            line = self.line  # `CLOSED` if another thread has closed the port
            left_size, left_ns = None if size is None else size - len(data), None
            if timeout_ns is not None:
                left_ns = begin_ns + timeout_ns - line.now_ns
                last_ns = max(begin_ns, line.taken_ns) if data and timeout_ns else begin_ns
                if span is EACH or (span is LAST and left_ns <= 0 and last_ns < begin_ns + timeout_ns):
                    left_ns += last_ns - begin_ns
                    if span is LAST:
                        size, left_size, terminator = len(data) + 1, 1, None
                if left_ns <= 0:
                    break
            data += line.read(left_size, terminator, left_ns, 0)
        return data

    def _write_in_pieces(self, data: bytes) -> int:
        """Send characters as the line takes them; return how many.

        Raises:
            WriteTimeoutError: If it does not take them all in time.
        """
        limit_ns, sent = self._write_timeout_ns, 0
        deadline_ns = NEVER_NS if limit_ns is None else self.line.now_ns + limit_ns
        while True:
            line = self.line  # `CLOSED` if another thread has closed the port
            now_ns, piece = line.now_ns, data[sent : sent + BACKLOG_LIMIT]
            late_ns = max(line.room_ns(len(piece)) - now_ns, 0)
            room = max(len(piece) - -(-late_ns // character_ns(line.baud)), 0)
            if room:
                line.send(piece[:room], 0)
            if self._is_write_cancelled and limit_ns != 0:
                self._is_write_cancelled = False
                return sent
            sent += room
            if (sent == len(data) and line.room_ns(1) <= now_ns) or (limit_ns == 0 and (sent or not data)):
                return sent
            if now_ns >= deadline_ns and limit_ns:
                raise WriteTimeoutError(
                    f"the line must take all characters within the write_timeout of {self._write_timeout_s:g} s, but "
                    f"it took {sent} of {len(data)}. Wait with flush(), or allow more time."
                )
            # A write without a wait pauses until there is room for one character, as pyserial's does.
            wanted = 1 if limit_ns == 0 else min(len(data) - sent + 1, BACKLOG_LIMIT // 2)
            room_ns = line.room_ns(wanted)
            line.wait_for_room(room_ns if limit_ns == 0 else min(room_ns, deadline_ns))


def _characters(data: Any) -> bytes:
    """Return the bytes of what a program writes; pyserial takes bytes, or numbers from 0 to 255.

    Raises:
        TypeError: If it is a text, or no numbers at all.
    """
    if isinstance(data, str):
        raise TypeError(f"unicode strings are not supported, please encode to bytes: {shown(data)}")
    if isinstance(data, int):
        check_count("a count of zeros", data, most=ZEROS_MAX)  # In pyserial a number n stands for n zeros.
    try:
        return bytes(data)
    except (TypeError, ValueError, OverflowError) as error:
        text = f"data must be bytes, or numbers from 0 to 255, but it was {shown(data)}."
        raise (TypeError if isinstance(error, TypeError) else ParameterError)(text) from None


def _timeout_ns(name: str, timeout_s: Any) -> int | None:
    """Return a timeout [ns]; None if it never ends a wait, because it is longer than any run."""
    checked_s = None if timeout_s is None else check_number(name, timeout_s, 0)
    return None if checked_s is None or checked_s > SECONDS_MAX else ns_from_s(checked_s)


def _count(size: Any) -> int:
    """Return the number of characters to read; as in pyserial, anything but a whole number is a TypeError."""
    # In this order Python says the same as of pyserial's comparison.
    return index(size) if 0 < size else 0  # noqa: SIM300
