"""What robots at the end of a serial line have in common: a port, its time, lines and their replies."""

from __future__ import annotations

import time
from typing import ClassVar, TypeVar

from kiks.client.port import BAUD, TIMEOUT_S, Port, open_port, set_baud
from kiks.errors import LinkError, ParameterError, shown
from kiks.model.checks import SECONDS_MAX, check_count, check_kind, check_number
from kiks.sim.port import CLOSED, VirtualPort

AnyRobot = TypeVar("AnyRobot", bound="SerialRobot")


class SerialRobot:
    """A robot whose commands are lines; `kiks.Khepera` and the like know which.

    Args:
        port: A port of a simulation (`sim.port(1)`), a name ('kiks://1', '/dev/ttyUSB0', 'socket://127.0.0.1:10020'),
            or an open pyserial port with a timeout.
        baud: Speed of the line [bit/s]. Left out, an open port keeps its own, and one that is opened by name has the
            robot's usual one.

    Attributes:
        port: The open port.
    """

    usual_baud: ClassVar[int] = BAUD
    """Speed of a line that is opened by name [bit/s]."""

    stop_bits: ClassVar[int] = 2

    def __init__(self, port: str | Port, *, baud: int | None = None) -> None:
        if isinstance(port, str):
            self.port: Port = open_port(port, self.usual_baud if baud is None else baud, stop_bits=self.stop_bits)
        elif all(hasattr(port, name) for name in ("write", "read_until", "close")):
            self.port = port
            if baud is not None:
                set_baud(port, baud)
        else:
            raise ParameterError(
                f"port must be a simulation's port, a name or an open pyserial port, but it was {shown(port)}. "
                f"Write kiks.{type(self).__name__}(sim.port(1))."
            )
        if isinstance(self.port, VirtualPort) and self.port.timeout is None:
            self.port.timeout = TIMEOUT_S

    def __repr__(self) -> str:
        return f"<{type(self).__name__} on {self.port!r}>"

    def close(self) -> None:
        """Close the port. The robot keeps its last speed: nothing on board stops it. Other methods then raise.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.close()
        """
        self.port.close()
        if not isinstance(self.port, VirtualPort):
            self.port = CLOSED

    def __enter__(self: AnyRobot) -> AnyRobot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # ---- time ----

    @property
    def time_s(self) -> float:
        """Time of the robot's world [s]: simulated time, or the computer's clock for a real robot."""
        return self.port.time_s if isinstance(self.port, VirtualPort) else time.monotonic()

    def pause(self, seconds: float) -> None:
        """Let time pass [s]: simulated time for a simulated robot, real time for a real one.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_speed(5, 5)
            >>> robot.pause(2.5)
            >>> round(sim.time_s, 1)
            2.5
        """
        if isinstance(self.port, VirtualPort):
            self.port.sleep(seconds)
        else:
            time.sleep(check_number("seconds", seconds, 0, SECONDS_MAX, "Time never runs backwards."))

    def send(self, text: str) -> str:
        """Send any line and return the first line of the reply, both without line ends.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.send("D,5,5")
            'd'
        """
        if not isinstance(text, str) or "\n" in text or "\r" in text or not text.isascii():
            raise ParameterError(
                f"text must be one line of ASCII, but it was {shown(text)}. The line end is added here."
            )
        self.port.write(text.encode() + b"\n")
        reply = self.port.read_until(b"\n")
        if reply[-1:] != b"\n":
            raise self._timed_out(text.encode(), reply)
        return reply.rstrip(b"\r\n").decode("ascii", errors="replace")

    # ---- replies, for a program that sends a command to several robots before it reads the first reply ----

    def read_confirmation(self, request: bytes) -> None:
        r"""Read the reply to a command that the robot confirms with its letter alone, a turret's order with `t,1,e`.

        Raises:
            LinkError: If the reply is unexpected, or does not come.

        Example:
            >>> import kiks
            >>> robot = kiks.Khepera(kiks.Simulation().port(1))
            >>> _ = robot.port.write(b"D,5,5\n")
            >>> robot.read_confirmation(b"D,5,5")
        """
        if request.__class__ is not bytes:
            check_kind("request", request, bytes)
        reply = self.port.read_until(b"\n")
        words = 3 if request[:1] == b"T" else 1
        head = b",".join(request.rstrip().lower().split(b",")[:words])
        # Some robots end their reply to D with a comma: quirks.d_reply_trailing_comma.
        if reply != head + b"\r\n" and reply != head + b",\r\n":
            raise self._unexpected(request, reply)

    def read_numbers(self, request: bytes, count: int) -> list[int]:
        r"""Read a reply of `count` whole numbers, after the command's letter; after a turret's order, `t,2,t`.

        Raises:
            LinkError: If the reply is unexpected, or does not come.

        Example:
            >>> import kiks
            >>> robot = kiks.Khepera(kiks.Simulation().port(1))
            >>> _ = robot.port.write(b"E\n")
            >>> robot.read_numbers(b"E", 2)
            [0, 0]
        """
        if request.__class__ is not bytes or count.__class__ is not int or count < 0:
            check_kind("request", request, bytes)
            count = check_count("count", count)
        reply = self.port.read_until(b"\n")
        words = reply.split(b",")
        head = request.rstrip().lower().split(b",") if request[:1] == b"T" else [request[:1].lower()]
        if len(words) == len(head) + count and words[: len(head)] == head and reply[-2:] == b"\r\n":
            try:
                return list(map(int, words[len(head) :]))
            except ValueError:
                pass
        raise self._unexpected(request, reply)

    # ---- inside ----

    def _command(self, request: bytes) -> None:
        """Send a command that the robot confirms with its letter alone."""
        self.port.write(request)
        self.read_confirmation(request)

    def _query(self, request: bytes, count: int) -> list[int]:
        """Send a command whose reply is whole numbers."""
        self.port.write(request)
        return self.read_numbers(request, count)

    def _unexpected(self, request: bytes, reply: bytes) -> LinkError:
        if reply[-1:] != b"\n":
            return self._timed_out(request, reply)
        return LinkError(
            f"the reply to {shown(request)} must be that of this kind of robot, but it was {shown(reply)}. "
            "Was an earlier reply left unread, or is another program on the line?"
        )

    @staticmethod
    def _timed_out(request: bytes, reply: bytes) -> LinkError:
        return LinkError(
            f"a reply to {shown(request)} must come before the timeout, but only {shown(reply)} came. "
            "Check the cable, the robot's switch and the baud rate."
        )


def whole(least: int, most: int, **numbers: float) -> tuple[int, ...]:
    """Return numbers for a command, rounded. A robot cuts what is out of range, or does not say what is."""
    return tuple(round(check_number(name, number, least, most)) for name, number in numbers.items())
