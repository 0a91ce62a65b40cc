"""A serial port in simulated time: what a program sees of it, wherever the simulation runs.

It has the methods of a pyserial port, so a program cannot tell the difference. Between it and the robot lies its line:
in this process (`memory.py`) or in the one that runs several programs (`remote_link.py`). The port knows what thinking,
polling and waiting cost a program; the line lets that time pass and carries the characters.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from operator import index
from typing import Any, Protocol

from kiks.clock.program_clock import ProgramClock
from kiks.errors import LinkError, ParameterError, shown
from kiks.model.checks import SECONDS_MAX, check_count, check_number
from kiks.sim.read_completion import Read
from kiks.units import ns_from_s, s_from_ns, wait_ns

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

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]."""

    def think(self, time_ns: int) -> None:
        """Let the time pass that the program has thought [ns]."""

    def send(self, data: bytes) -> None:
        """Put characters on the line; wait while it is full."""

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator, whichever comes first, until the timeout.

        Args:
            size: How many at most; None: up to the terminator.
            terminator: What ends the read; None: the size alone.
            timeout_ns: Longest wait [ns]; None: for ever.
            poll_ns: What the read costs at least if it times out [ns].

        Raises:
            LinkError: If the wait could have no end.
        """

    def arrived_count(self) -> int:
        """Return how many characters have arrived and were not read."""

    def sent_ns(self) -> int:
        """Return when everything will have been sent [ns]."""

    def room_ns(self) -> int:
        """Return when the line takes more characters without a wait [ns]."""

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


class Closed:
    """Stands in for what was closed: any use but another `close` raises an error that says so."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # Python asks each object for such names
            raise AttributeError(name)
        raise LinkError("a port must be open to be used, but this one is closed. Open it again, or close it later.")

    def close(self) -> None:
        """Do nothing."""


CLOSED: Any = Closed()


class VirtualPort:
    """The computer's end of a simulated robot's line.

    Args:
        line: The way to the robot.
        program: Charges thinking and polling to the program whose port this is.

    Attributes:
        line: The way to the robot.
    """

    def __init__(self, line: Line, program: ProgramClock) -> None:
        self.timeout = None
        self.line: Line = line
        self._program = program
        self._has_read = True

    # ---- what pyserial's ports have ----

    @property
    def timeout(self) -> float | None:
        """Longest simulated time that a read waits [s]; None waits without end.

        Raises:
            ParameterError: If it is set to anything but None or a number from 0.
        """
        return self._timeout_s

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        checked_s = None if timeout_s is None else check_number("timeout", timeout_s, 0)
        self._timeout_s = timeout_s
        # A timeout longer than any run never ends a read.
        self._timeout_ns = None if checked_s is None or checked_s > SECONDS_MAX else ns_from_s(checked_s)

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

        Raises:
            TypeError: If they are a text, or no numbers at all, as in pyserial.
            ParameterError: If a number is out of range.
        """
        if data.__class__ is not bytes:
            data = _characters(data)
        line, program = self.line, self._program
        with line.lock:
            if program.thinks:
                self._think(is_command=self._has_read)
            self._has_read = False
            line.send(data)
            program.leave(has_acted=True)
        return len(data)

    def read(self, size: int = 1) -> bytes:
        """Return `size` characters, fewer after the timeout.

        Raises:
            LinkError: If there is no timeout and no reply can come any more.
        """
        return self._read(_count(size), None)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Return everything up to and including a terminator, less after the timeout.

        Raises:
            LinkError: If there is no timeout and no reply can come any more.
        """
        if expected.__class__ is not bytes:
            expected = _characters(expected)
        return self._read(None if size is None else _count(size), expected)

    def readline(self, size: int | None = -1) -> bytes:
        """Return a line with its end, or the part of it that came before the timeout.

        Raises:
            LinkError: If there is no timeout and no reply can come any more.
        """
        return self._read(None if size is None or (count := index(size)) < 0 else count, b"\n")

    @property
    def in_waiting(self) -> int:
        """Number of characters that have arrived and were not read. Repeated polls let time pass."""
        with self.line.lock:
            self._ask()
            return self.line.arrived_count()

    def flush(self) -> None:
        """Wait until everything has been sent."""
        with self.line.lock:
            self.line.pass_to(self.line.sent_ns())

    def reset_input_buffer(self) -> None:
        """Drop the characters that have arrived and were not read."""
        with self.line.lock:
            self.line.drop_arrived()

    def reset_output_buffer(self) -> None:
        """Do nothing: what was written is on the line already."""

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
        """Let simulated time pass [s] without waiting for it.

        Raises:
            ParameterError: If it is negative, longer than 1e9 s or no number.
        """
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

    def _read(self, size: int | None, terminator: bytes | None) -> bytes:
        line, program, timeout_ns = self.line, self._program, self._timeout_ns
        with line.lock:
            if program.thinks:
                self._think(is_command=False)
            self._has_read = True
            # A read that does not wait is a poll.
            poll_ns = program.ask() if timeout_ns == 0 and size != 0 else 0
            data = line.read(size, terminator, timeout_ns, poll_ns)
            program.leave(has_acted=bool(data))
        return data


def _characters(data: Any) -> bytes:
    """Return the bytes of what a program writes; pyserial takes bytes, or numbers from 0 to 255.

    Raises:
        TypeError: If it is a text, or no numbers at all.
        ParameterError: If a number is out of range.
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


def _count(size: Any) -> int:
    """Return the number of characters to read; as in pyserial, anything but a whole number is a TypeError."""
    return max(index(size), 0)
