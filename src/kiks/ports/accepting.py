"""Letting connections in, even when the computer has no descriptors left for them."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import socket

_SHORTAGES = {errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM}


class Accepting:
    """Accepts the connections of a socket that listens. It never blocks and never raises.

    A connection for which there is no descriptor would stay at the door, and the socket readable, for ever. So one
    descriptor is kept in reserve: it is given up for a moment, to take that connection and hang up on it.

    Args:
        listener: The socket.
        name: What a message calls it.
        log: Where a shortage is told, once until there are descriptors again.
    """

    def __init__(self, listener: socket.socket, name: str, log: logging.Logger) -> None:
        listener.setblocking(False)
        self._listener = listener
        self._name = name
        self._log = log
        self._spare = os.open(os.devnull, os.O_RDONLY)
        self._is_short = False

    def fileno(self) -> int:
        """Return the listening socket, to wait on."""
        return self._listener.fileno()

    def accept(self) -> socket.socket | None:
        """Return the next connection; None if it has gone again, or cannot be had."""
        try:
            connection, _ = self._listener.accept()
        except OSError as error:
            if error.errno in _SHORTAGES:
                self._hang_up(error)
            return None
        self._is_short = self._spare < 0 and not self._reserve()
        return connection

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()
        if self._spare >= 0:
            os.close(self._spare)
            self._spare = -1

    def _hang_up(self, error: OSError) -> None:
        """Take the next connection with the descriptor in reserve, and part from it."""
        if not self._is_short:
            self._is_short = True
            self._log.warning(
                "%s must have a descriptor for each connection, but the computer has none left (%s): those who come "
                "are hung up on. Close some, or raise the limit (ulimit -n).",
                self._name,
                error.strerror,
            )
        if self._spare >= 0:
            os.close(self._spare)
            self._spare = -1
        with contextlib.suppress(OSError):
            self._listener.accept()[0].close()
        self._reserve()

    def _reserve(self) -> bool:
        try:
            self._spare = os.open(os.devnull, os.O_RDONLY)
        except OSError:
            return False
        return True
