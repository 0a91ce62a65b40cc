"""RFC 2217: a serial port over TCP whose client can set the speed, for pyserial's `rfc2217://`.

pyserial implements the protocol for any object that has the attributes of a serial port.
"""

from __future__ import annotations

import logging
import socket
import struct
from types import SimpleNamespace
from typing import Any

from kiks.ports.tcp import TcpChannel, TcpEndpoint

REQUEST_LIMIT = 256
"""Longest request of the telnet protocol [bytes]; real requests have six."""

_log = logging.getLogger("kiks.serve")


class Rfc2217Endpoint(TcpEndpoint):
    """A TCP port of this computer that speaks RFC 2217; arguments and errors are those of `TcpEndpoint`.

    Its clients take it for a serial port, so characters come one by one.
    """

    def __init__(self, port: int, *, host: str = "127.0.0.1") -> None:
        super().__init__(port, host=host, by_character=True)

    def accept(self) -> Rfc2217Channel | None:
        """Accept the client and begin to negotiate."""
        connection = self._connect()
        return None if connection is None else Rfc2217Channel(connection, self)


class _Settings(SimpleNamespace):
    """The serial port that the protocol sets: it accepts all settings, and only the speed has an effect."""

    def __init__(self, channel: Rfc2217Channel) -> None:
        super().__init__(baudrate=9600, bytesize=8, parity="N", stopbits=2)
        vars(self).update(dict.fromkeys(("dtr", "rts", "cts", "dsr", "cd"), True))
        vars(self).update(dict.fromkeys(("xonxoff", "rtscts", "break_condition", "ri"), False))
        self._channel = channel

    def __setattr__(self, name: str, value: Any) -> None:
        super().__setattr__(name, value)
        if name == "baudrate":
            self._channel.baud = value

    def reset_input_buffer(self) -> None:
        self._channel.forget()

    def reset_output_buffer(self) -> None:
        pass  # written characters are already on the line


class Rfc2217Channel(TcpChannel):
    """A client that speaks RFC 2217."""

    def __init__(self, connection: socket.socket, endpoint: TcpEndpoint) -> None:
        from serial import rfc2217

        super().__init__(connection, endpoint)
        # The protocol's own messages are not escaped, because they are no data.
        answers: Any = SimpleNamespace(write=lambda data: TcpChannel.write(self, bytes(data)))
        settings: Any = _Settings(self)
        self._manager: Any = rfc2217.PortManager(settings, answers)

    def read(self) -> bytes | None:
        """Return the client's bytes for the robot; None when it has gone or does not speak telnet."""
        data = super().read()
        if not data:
            return data
        try:
            data = b"".join(self._manager.filter(data))
            # pyserial keeps what has no end.
            is_sound = len(self._manager.suboption or b"") <= REQUEST_LIMIT
        except (struct.error, KeyError, TypeError, ValueError):
            is_sound = False
        if not is_sound:
            _log.warning(
                "the client of %s must speak RFC 2217, but it sent something else. Use the plain TCP port.", self.name
            )
            return None
        return data

    def write(self, data: bytes) -> None:
        """Send bytes, escaped for telnet."""
        super().write(b"".join(self._manager.escape(data)))

    def forget(self) -> None:
        """Drop the bytes that wait for the client, at its request."""
        self._unsent.clear()
