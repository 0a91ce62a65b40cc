"""The base classes of real ports: an endpoint accepts the clients of one robot, a channel is the connection to one.

Both know bytes and file descriptors, and nothing of the simulation. Nothing here blocks.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod

from kiks.clock.serial_timing import OUTPUT_LIMIT

READ_SIZE = 4096
"""Most bytes read from a client at once."""

_log = logging.getLogger("kiks.serve")


class Channel(ABC):
    """The connection to a client.

    Attributes:
        name: Name of its endpoint.
        baud: The speed to which the client has set its port [bit/s]; None if the connection does not carry it.
        by_character: Whether characters come to the client one by one, as on a serial line, instead of whole replies.
    """

    baud: int | None = None
    by_character = True

    def __init__(self, name: str) -> None:
        self.name = name
        self._unsent = bytearray()
        self._has_warned = False

    @abstractmethod
    def fileno(self) -> int:
        """Return the descriptor for the selector."""

    @abstractmethod
    def read(self) -> bytes | None:
        """Return the bytes that the client has sent, perhaps none; None when it has gone."""

    @abstractmethod
    def _put(self, data: bytes | bytearray) -> int:
        """Write bytes; return the number that the operating system took, or all if the client has gone."""

    @abstractmethod
    def close(self) -> None:
        """Disconnect the client and drop unread bytes."""

    @property
    def has_ahead(self) -> bool:
        """Whether bytes of the client were read ahead and not yet taken."""
        return False

    def find_end(self) -> bool:
        """Read ahead and keep the bytes; return whether the client has gone."""
        return False

    @property
    def has_unsent(self) -> bool:
        """Whether bytes wait because the client does not read; call `flush` when the descriptor is writable."""
        return bool(self._unsent)

    def write(self, data: bytes) -> None:
        """Send bytes to the client; bytes that it does not take wait, up to a limit."""
        if not self._unsent:
            data = data[self._put(data) :]
        if len(self._unsent) + len(data) <= OUTPUT_LIMIT:
            self._unsent += data
        else:
            self.warn(
                f"the client of {self.name} must read its replies, but {len(self._unsent)} characters wait for it; "
                "the rest is lost. Read a line after each command."
            )

    def warn(self, text: str) -> None:
        """Log a mistake of the client, once, because one mistake often causes the next."""
        if not self._has_warned:
            self._has_warned = True
            _log.warning("%s", text)

    def flush(self) -> None:
        """Send the waiting bytes that the client takes."""
        if self._unsent:
            del self._unsent[: self._put(self._unsent)]


class Endpoint(ABC):
    """Accepts clients of one robot.

    Attributes:
        name: The name that a user opens: a path, or host:port.
    """

    name: str

    @abstractmethod
    def fileno(self) -> int:
        """Return the descriptor that is readable when a client wants to connect."""

    @abstractmethod
    def accept(self) -> Channel | None:
        """Accept the client; None if it has gone again. Its channel may have the same descriptor as the endpoint."""

    @abstractmethod
    def reject(self) -> None:
        """Reject a client, because the robot has another one."""

    @abstractmethod
    def close(self) -> None:
        """Close the endpoint and remove its files."""
