"""What all real ports have in common: an endpoint is a way in to one robot, a channel is the client that came in by it.

Both know bytes and file descriptors, and nothing of the simulation. Nothing here blocks.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod

from kiks.clock.serial_timing import OUTPUT_LIMIT

READ_SIZE = 4096
"""Most characters taken from a client at once [bytes]."""

_log = logging.getLogger("kiks.serve")


class Channel(ABC):
    """A client's end of a robot's line.

    Attributes:
        name: Where the client came in.
        baud: The speed that the client has set its port to [bit/s], None if it cannot say.
    """

    baud: int | None = None

    def __init__(self, name: str) -> None:
        self.name = name
        self._unsent = bytearray()
        self._has_warned = False

    @abstractmethod
    def fileno(self) -> int:
        """Return the descriptor to wait on."""

    @abstractmethod
    def read(self) -> bytes | None:
        """Return what the client has sent, perhaps nothing; None when it has gone."""

    @abstractmethod
    def _put(self, data: bytes | bytearray) -> int:
        """Hand characters to the operating system; return how many it took, all of them if nobody is there to read."""

    @abstractmethod
    def close(self) -> None:
        """Part from the client and forget what it did not read."""

    @property
    def has_ahead(self) -> bool:
        """Say whether characters of the client were read ahead and not yet taken."""
        return False

    def find_end(self) -> bool:
        """Read ahead and keep what comes; say whether the client has gone."""
        return False

    @property
    def has_unsent(self) -> bool:
        """Say whether characters wait because the client does not read; `flush` when the descriptor is writable."""
        return bool(self._unsent)

    def write(self, data: bytes) -> None:
        """Send characters to the client; what it does not take waits, up to a limit."""
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
        """Tell a person what the client does wrong: once, for one thing mostly comes of the other."""
        if not self._has_warned:
            self._has_warned = True
            _log.warning("%s", text)

    def flush(self) -> None:
        """Send what waits, as far as the client takes it."""
        if self._unsent:
            del self._unsent[: self._put(self._unsent)]


class Endpoint(ABC):
    """One way in to one robot.

    Attributes:
        name: What a user opens: a path, or host:port.
    """

    name: str

    @abstractmethod
    def fileno(self) -> int:
        """Return the descriptor that is readable when a client wants to come in."""

    @abstractmethod
    def accept(self) -> Channel | None:
        """Let the client in; None if it has gone again. Its channel may have the same descriptor as the endpoint."""

    @abstractmethod
    def turn_away(self) -> None:
        """Refuse the client, because the robot has another one."""

    @abstractmethod
    def close(self) -> None:
        """Close the way in and leave nothing behind."""
