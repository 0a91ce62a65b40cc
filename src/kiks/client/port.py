"""A port by its name, simulated or real, that reads lines quickly."""

from __future__ import annotations

import math
import os
import select
import time
from typing import Any, Protocol

from kiks.errors import LinkError, shown

TIMEOUT_S = 2.0
"""How long a reply may take [s]: the longest, 264 characters at 9600 baud, takes 0.3 s (khepera-protocol.md 2.2)."""

AWAKE_S = 0.0002
"""How long a program stays awake for a reply [s]: a simulator's is there sooner than a sleeper is woken."""

SELECT_END = 1024
"""Descriptors from here on are too large for select(), which is a little quicker at a pseudo-terminal than poll()."""


class Port(Protocol):
    """What is needed of a port; pyserial's and ours have it."""

    def write(self, data: bytes, /) -> int | None:
        """Send characters."""

    def read_until(self, expected: bytes = b"\n") -> bytes:
        """Return a line, or less after the time-out."""

    def close(self) -> None:
        """Hang up."""


def open_port(name: str, baud: int = 9600, timeout_s: float | None = TIMEOUT_S) -> Port:
    """Open a simulated or a real port by name.

    Args:
        name: 'kiks://1', '/dev/ttyUSB0', 'COM3', 'socket://host:port', 'rfc2217://host:port'.
        baud: Line speed [bit/s].
        timeout_s: How long a read waits [s], None for ever.

    Raises:
        LinkError: If there is no such port or it is busy.
    """
    if name.startswith("kiks:"):
        from kiks.ports.url import find_port

        sim_port = find_port(name)
        sim_port.claim(f"the program that opened {shown(name)}")
        sim_port.baudrate = baud
        sim_port.timeout = timeout_s
        return sim_port
    import serial

    from kiks.ports.pyserial import protocol_kiks

    try:
        port: Any = serial.serial_for_url(name, baudrate=baud, timeout=timeout_s, stopbits=2)
    except (serial.SerialException, ValueError, OSError) as error:
        why = str(error).replace(name, shown(name)[1:-1])
        raise LinkError(
            f"port {shown(name)} must be one that can be opened, but: {why}. A simulated robot is 'kiks://1'."
        ) from None
    # A simulated port, as under `kiks run`, has quick lines of its own.
    return port if isinstance(port, protocol_kiks.Serial) else QuickLines(port)


class QuickLines:
    """A pyserial port that reads a line in a few system calls; pyserial's own `read_until` makes two for each byte."""

    def __init__(self, port: Any) -> None:
        self.port = port
        self._read_ahead = b""
        try:
            self._descriptor = int(port.fileno()) if os.name == "posix" else None
        except (AttributeError, OSError):
            self._descriptor = None  # not a port of the operating system: RFC 2217

    def write(self, data: bytes, /) -> int | None:
        """Send characters."""
        count: int | None = self.port.write(data)
        return count

    def read_until(self, expected: bytes = b"\n") -> bytes:
        """Return a line, or as much of it as came before the timeout.

        Raises:
            LinkError: If the port is gone.
        """
        data = self._read_ahead
        while (end := data.find(expected)) < 0:
            more = self._some()
            if not more:
                self._read_ahead = b""
                return data
            data += more
        end += len(expected)
        self._read_ahead = data[end:]
        return data[:end]

    def _some(self) -> bytes:
        """Wait for the first character and return what is there, nothing after the time-out."""
        try:
            if self._descriptor is None:
                return bytes(self.port.read(max(1, self.port.in_waiting)))
            if not self._wait(self._descriptor):
                return b""
            some = os.read(self._descriptor, 4096)
        except (OSError, ValueError) as error:
            raise LinkError(
                f"port {shown(self.port.port)} must stay open while it is used, but it is gone: {error}."
            ) from None
        if not some:
            raise LinkError(
                f"port {shown(self.port.port)} must stay open while it is used, but the other end has closed it."
            )
        return some

    def _wait(self, descriptor: int) -> bool:
        """Wait for a character; return whether one came before the time-out."""
        until_s = time.perf_counter() + AWAKE_S
        while time.perf_counter() < until_s:
            if _is_readable(descriptor, 0.0):
                return True
        return _is_readable(descriptor, self.port.timeout)

    def close(self) -> None:
        """Close the port."""
        self.port.close()


def _is_readable(descriptor: int, timeout_s: float | None) -> bool:
    """Wait until a descriptor can be read; return whether it can before the time-out."""
    if descriptor < SELECT_END:
        return bool(select.select([descriptor], [], [], timeout_s)[0])
    ready = select.poll()
    ready.register(descriptor, select.POLLIN)
    return bool(ready.poll(None if timeout_s is None else math.ceil(timeout_s * 1e3)))
