"""TCP: the same bytes on a socket, for pyserial's `socket://` and for programs without a serial port."""

from __future__ import annotations

import ipaddress
import logging
import re
import socket

from kiks.errors import LinkError, ParameterError, shown
from kiks.ports.endpoint import READ_SIZE, Channel, Endpoint
from kiks.ports.resources import accept, opening

WAITING_MAX = 128
"""Most clients that wait at a port until the commands of the last client are done; others must try again."""

AHEAD_MAX = 16 << 20
"""Most bytes read ahead of a robot: more than the operating system holds for a client that has gone. They are read only
when another client connects."""

HTTP_REQUEST = re.compile(rb"(GET|HEAD|POST|PUT|OPTIONS|DELETE|PATCH|CONNECT|PRI) ")
"""The first bytes of a browser.

Pages of other sites can make a browser send a request to any port of this computer, with commands for a robot in its
body. No program for a Khepera begins so. These bytes are no whole command yet, and all that follow are dropped."""

_log = logging.getLogger("kiks.serve")


class TcpEndpoint(Endpoint):
    """A TCP port of this computer; one client at a time.

    Args:
        port: Number of the port; 0 takes a free one.
        host: A loopback address of this computer.
        by_character: Whether characters come to clients one by one, as on a serial line. Clients that were written for
            robots behind TCP often take one `recv` for one reply, so each reply comes whole if this is left out.

    Raises:
        LinkError: If the port is busy, or other computers could reach the host.
    """

    def __init__(self, port: int, *, host: str = "127.0.0.1", by_character: bool = False) -> None:
        if not isinstance(port, int) or not 0 <= port <= 65535:
            raise ParameterError(
                f"port must be a whole number from 0 to 65535, but it was {shown(port)}. 0 takes a free one."
            )
        host = "127.0.0.1" if host == "localhost" else host
        if not _is_loopback(host):
            raise LinkError(
                f"host must be an address that only this computer reaches, but it was {shown(host)}: every client that "
                "reaches the port can drive the robot. Use 127.0.0.1, and an SSH tunnel from elsewhere."
            )
        with opening("a TCP port"):
            self._listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind((host, port))
            self._listener.listen(WAITING_MAX)
        except OSError as error:
            self._listener.close()
            raise LinkError(
                f"port {port} of {host} must be free, but it is not ({error.strerror}). 0 takes a free one."
            ) from None
        self._listener.setblocking(False)
        self._has_refused_http = False
        self.by_character = by_character
        self.port = int(self._listener.getsockname()[1])
        self.name = f"[{host}]:{self.port}" if ":" in host else f"{host}:{self.port}"

    def fileno(self) -> int:
        """Return the listening socket."""
        return self._listener.fileno()

    def accept(self) -> TcpChannel | None:
        """Accept the client."""
        connection = self._connect()
        return None if connection is None else TcpChannel(connection, self)

    def _connect(self) -> socket.socket | None:
        try:
            connection = accept(self._listener)
        except OSError:
            return None
        if connection is None:
            return None
        connection.setblocking(False)
        # A reply of a few bytes must not wait for the acknowledgement of the one before.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return connection

    def reject(self) -> None:
        """Close the connection."""
        connection = self._connect()
        if connection is not None:
            connection.close()

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()

    def refuse_http(self) -> None:
        """Log, once, that a browser has connected."""
        if not self._has_refused_http:
            self._has_refused_http = True
            _log.warning(
                "a client of %s must speak as to a serial port, but one spoke HTTP and was disconnected: a page in a "
                "browser may have tried to drive the robot. Do not open this port in a browser.",
                self.name,
            )


class TcpChannel(Channel):
    """A client on a connection.

    Args:
        connection: The connection.
        endpoint: The endpoint, which says how replies come, and logs that a client is a browser.
    """

    def __init__(self, connection: socket.socket, endpoint: TcpEndpoint) -> None:
        super().__init__(endpoint.name)
        self.by_character = endpoint.by_character
        self._connection = connection
        self._endpoint = endpoint
        self._first_bytes = b""
        self._ahead = bytearray()

    def fileno(self) -> int:
        """Return the connection."""
        return self._connection.fileno()

    def read(self) -> bytes | None:
        """Return the bytes of the client; None when the connection is over, or the client is a browser."""
        data: bytes | None = bytes(self._ahead[:READ_SIZE])
        del self._ahead[:READ_SIZE]
        data = data or self._receive()
        if data and len(self._first_bytes) < 8:
            self._first_bytes = (self._first_bytes + data)[:8]
            # Eight bytes hold the longest method and its blank.
            if HTTP_REQUEST.match(self._first_bytes):
                self._endpoint.refuse_http()
                return None
        return data

    def _receive(self) -> bytes | None:
        """Return the bytes that have arrived, perhaps none; None when the connection is over."""
        try:
            return self._connection.recv(READ_SIZE) or None
        except BlockingIOError:
            return b""
        except OSError:
            return None

    @property
    def has_ahead(self) -> bool:
        """Whether bytes were read ahead and not yet taken."""
        return bool(self._ahead)

    def find_end(self) -> bool:
        """Read ahead and keep the bytes, up to `AHEAD_MAX`; return whether the client has gone.

        The end of a connection comes after its last byte, so it shows only to a reader.
        """
        while len(self._ahead) < AHEAD_MAX:
            data = self._receive()
            if not data:
                return data is None
            self._ahead += data
        return False

    def _put(self, data: bytes | bytearray) -> int:
        try:
            return self._connection.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            return len(data)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
