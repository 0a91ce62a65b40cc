"""TCP: the same bytes on a socket, for `socket://` of pyserial and for programs that know no serial port."""

from __future__ import annotations

import ipaddress
import socket

from kiks.errors import LinkError, ParameterError
from kiks.ports.endpoint import READ_SIZE, Channel, Endpoint


class TcpEndpoint(Endpoint):
    """A port of this computer; one client at a time.

    Args:
        port: Number of the port; 0 takes a free one.
        host: Address of this computer that only programs on it reach.

    Raises:
        ParameterError: If the port is no number of one.
        LinkError: If the port is busy, or other computers could reach the host.
    """

    def __init__(self, port: int, *, host: str = "127.0.0.1") -> None:
        if not isinstance(port, int) or not 0 <= port <= 65535:
            raise ParameterError(
                f"port must be a whole number from 0 to 65535, but it was {port!r}. 0 takes a free one."
            )
        host = "127.0.0.1" if host == "localhost" else host
        if not _is_loopback(host):
            raise LinkError(
                f"host must be an address that only this computer reaches, but it was {host!r}: whoever reaches "
                "the port can drive the robot. Use 127.0.0.1, and an SSH tunnel from elsewhere."
            )
        self._listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind((host, port))
            self._listener.listen()
        except OSError as error:
            self._listener.close()
            raise LinkError(
                f"port {port} of {host} must be free, but it is not ({error.strerror}). 0 takes a free one."
            ) from None
        self._listener.setblocking(False)
        self.port = int(self._listener.getsockname()[1])
        self.name = f"[{host}]:{self.port}" if ":" in host else f"{host}:{self.port}"

    def fileno(self) -> int:
        """Return the listening socket."""
        return self._listener.fileno()

    def accept(self) -> TcpChannel | None:
        """Let the client in."""
        connection = self._connect()
        return None if connection is None else TcpChannel(self.name, connection)

    def _connect(self) -> socket.socket | None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return None
        connection.setblocking(False)
        # A reply of a few bytes must not wait for the acknowledgement of the one before.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return connection

    def turn_away(self) -> None:
        """Close the connection."""
        connection = self._connect()
        if connection is not None:
            connection.close()

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()


class TcpChannel(Channel):
    """A client on a connection."""

    def __init__(self, name: str, connection: socket.socket) -> None:
        super().__init__(name)
        self._connection = connection

    def fileno(self) -> int:
        """Return the connection."""
        return self._connection.fileno()

    def read(self) -> bytes | None:
        """Return what the client has sent; None when the connection is over."""
        try:
            return self._connection.recv(READ_SIZE) or None
        except BlockingIOError:
            return b""
        except OSError:
            return None

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
