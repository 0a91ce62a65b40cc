"""Opens ports by name, simulated or real, and reads lines from them quickly."""

from __future__ import annotations

import math
import os
import select
import time
from collections.abc import Callable
from typing import Any, Protocol

from kiks.errors import LinkError, shown
from kiks.model.checks import check_count
from kiks.sim.port import BAUD_MAX, BAUD_MIN

BAUD = 9600
"""Speed of a line unless another is named [bit/s]."""

TIMEOUT_S = 2.0
"""Default timeout of a reply [s]: the longest, 264 characters at 9600 baud, takes 0.3 s (khepera-protocol.md 2.2)."""

SPIN_S = 0.0002
"""Time for which a read polls before it sleeps [s]: a simulator replies sooner than a sleeping process wakes up."""

SELECT_END = 1024
"""First descriptor too large for select(), which is a little faster than poll() on a pseudo-terminal."""


class Port(Protocol):
    """The methods of a port that clients use; pyserial's ports and simulated ports have them."""

    def write(self, data: bytes, /) -> int | None:
        """Send characters."""

    def read_until(self, expected: bytes = b"\n") -> bytes:
        """Return a line, or the part of it that arrived before the timeout."""

    def read(self, size: int = 1) -> bytes:
        """Return some characters, or those that arrived before the timeout."""

    def close(self) -> None:
        """Hang up."""


def open_port(name: str, baud: int = BAUD, timeout_s: float | None = TIMEOUT_S, *, stop_bits: int = 2) -> Port:
    """Open a simulated or a real port by name.

    Args:
        name: 'kiks://1', '/dev/ttyUSB0', 'COM3', 'socket://host:port', 'rfc2217://host:port'.
        baud: Line speed [bit/s].
        timeout_s: Timeout of a read [s]; None for no limit.
        stop_bits: How many the robot's characters have.

    Raises:
        LinkError: If the port does not exist, or is busy.
    """
    baud = check_count("baud", baud, BAUD_MIN, BAUD_MAX, "Usual: 9600 bit/s.")
    if name.startswith("kiks:"):
        from kiks.ports.url import find_port

        sim_port = find_port(name)
        sim_port.timeout = timeout_s
        sim_port.claim(f"the program that opened {shown(name)}")
        sim_port.baudrate = baud
        return sim_port
    import serial

    try:
        port: Any = serial.serial_for_url(name, baudrate=baud, timeout=timeout_s, stopbits=stop_bits)
    except (serial.SerialException, ValueError, OSError) as error:
        why = str(error).replace(name, shown(name)[1:-1])
        raise LinkError(
            f"port {shown(name)} must be one that can be opened, but: {why}. A simulated robot is 'kiks://1'."
        ) from None
    # A simulated port, as under `kiks run`, reads lines quickly by itself.
    return port if hasattr(port, "sim_port") else FastPort(port)


def set_baud(port: Any, baud: int) -> None:
    """Set an open port to a speed [bit/s]; a simulated robot's end follows.

    Raises:
        LinkError: If it cannot have that speed.
    """
    baud = check_count("baud", baud, BAUD_MIN, BAUD_MAX, "Usual: 9600 bit/s.")
    try:
        if port.baudrate != baud:  # an object without one would take any
            port.baudrate = baud
    except (AttributeError, ValueError, OSError) as error:
        raise LinkError(
            f"baud must be a speed that the open port can be set to, but it was {baud}: {error}. "
            "Leave it out, and set the speed where you open the port."
        ) from None


class FastPort:
    """A pyserial port that reads a line in a few system calls; pyserial's own `read_until` makes two for each byte."""

    def __init__(self, port: Any) -> None:
        self.port = port
        self._read_ahead = b""
        try:
            self._descriptor = int(port.fileno()) if os.name == "posix" else None
        except (AttributeError, OSError):
            self._descriptor = None  # not a port of the operating system: RFC 2217

    @property
    def timeout(self) -> float | None:
        """Longest time that a read waits [s]; None waits without end."""
        timeout_s: float | None = self.port.timeout
        return timeout_s

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self.port.timeout = timeout_s

    def write(self, data: bytes, /) -> int | None:
        """Send characters."""
        count: int | None = self.port.write(data)
        return count

    def read_until(self, expected: bytes = b"\n") -> bytes:
        """Return a line, or the part of it that arrived before the timeout.

        Raises:
            LinkError: If the port has been closed or removed.
        """
        return self._read_on(lambda data: data.find(expected) + len(expected) if expected in data else 0)

    def read(self, size: int = 1) -> bytes:
        """Return some characters, or those that arrived before the timeout.

        Raises:
            LinkError: If the port has been closed or removed.
        """
        return self._read_on(lambda data: size if len(data) >= size else 0)

    def _read_on(self, end_of: Callable[[bytes], int]) -> bytes:
        """Return what has been received up to where it ends; `end_of` returns 0 as long as more is missing."""
        data = self._read_ahead
        while not (end := end_of(data)):
            more = self._receive()
            if not more:
                end = len(data)
                break
            data += more
        self._read_ahead = data[end:]
        return data[:end]

    def _receive(self) -> bytes:
        """Wait for a character; return all that have arrived, none after the timeout."""
        try:
            if self._descriptor is None:
                return bytes(self.port.read(max(1, self.port.in_waiting)))
            if not self._wait(self._descriptor):
                return b""
            received = os.read(self._descriptor, 4096)
        except (OSError, ValueError) as error:
            raise LinkError(
                f"port {shown(self.port.port)} must stay open while it is used, but it is gone: {error}."
            ) from None
        if not received:
            raise LinkError(
                f"port {shown(self.port.port)} must stay open while it is used, but the other end has closed it."
            )
        return received

    def _wait(self, descriptor: int) -> bool:
        """Wait for a character; return whether one came before the timeout."""
        until_s = time.perf_counter() + SPIN_S
        while time.perf_counter() < until_s:
            if _is_readable(descriptor, 0.0):
                return True
        return _is_readable(descriptor, self.timeout)

    def close(self) -> None:
        """Close the port."""
        self.port.close()


def _is_readable(descriptor: int, timeout_s: float | None) -> bool:
    """Wait until a descriptor is readable; return whether it became so before the timeout."""
    if descriptor < SELECT_END:
        return bool(select.select([descriptor], [], [], timeout_s)[0])
    ready = select.poll()
    ready.register(descriptor, select.POLLIN)
    return bool(ready.poll(None if timeout_s is None else math.ceil(timeout_s * 1e3)))
