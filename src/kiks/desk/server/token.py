"""The key of a desk: what a browser must know, and how it comes to know it.

Need: other users of this computer reach the desk's port as well as its owner does, and whoever runs programs there runs
them as the owner. They see the command line of every process, too, and with it the address that a browser is opened at.
Method: a token, made anew for each process. The terminal prints it, in an address; a browser keeps it in a cookie. A
browser that KiKS opens is given a ticket instead: it is good once, and for a connection of the same user alone.
"""

from __future__ import annotations

import hmac
import os
import secrets
import socket
import sys
from pathlib import Path

TOKEN_BYTES = 24

COOKIE = "kiks_token"

_CONNECTIONS = {socket.AF_INET: Path("/proc/net/tcp"), socket.AF_INET6: Path("/proc/net/tcp6")}
"""Where Linux lists the ends of connections, and whose they are (man 5 proc)."""

Address = tuple[str, int]


class Token:
    """What a browser must know to see a desk.

    Args:
        token: What it is; a new one if left out.

    Attributes:
        token: What it is.
    """

    def __init__(self, token: str | None = None) -> None:
        self.token = secrets.token_urlsafe(TOKEN_BYTES) if token is None else token
        self._tickets: set[str] = set()

    def fits(self, given: str) -> bool:
        """Say whether somebody knows the token."""
        return hmac.compare_digest(given.encode(errors="replace"), self.token.encode())

    def new_ticket(self) -> str:
        """Return what opens the desk once, to a browser of this user."""
        ticket = secrets.token_urlsafe(TOKEN_BYTES)
        self._tickets.add(ticket)
        return ticket

    def take(self, ticket: str, client: Address | None, server: Address | None) -> bool:
        """Say whether a ticket is good for a connection; if so, it is used up.

        Args:
            ticket: What was given.
            client: The address of the browser's end.
            server: The address of this end.
        """
        if ticket not in self._tickets or client is None or server is None:
            return False
        if user_of(client, server) not in (os.getuid(), 0):
            return False
        self._tickets.discard(ticket)
        return True

    def cookie_name(self, server: Address | None) -> str:
        """Return what its cookie is called: browsers keep one jar for all ports of a computer."""
        return COOKIE if server is None else f"{COOKIE}_{server[1]}"


def user_of(client: Address, server: Address) -> int | None:
    """Return whose the other end of a connection is, a user's number; None if it is not on this computer."""
    try:
        family = socket.AF_INET6 if ":" in client[0] else socket.AF_INET
        ends = [_end(family, *client), _end(family, *server)]
        for line in _CONNECTIONS[family].read_text(encoding="ascii").splitlines()[1:]:
            words = line.split()
            if words[1:3] == ends:
                return int(words[7])
    except (OSError, ValueError, IndexError):
        pass
    return None


def _end(family: socket.AddressFamily, host: str, port: int) -> str:
    """Return the end of a connection as Linux lists it: an address in words of the processor's order, and a port."""
    raw = socket.inet_pton(family, host)
    words = (int.from_bytes(raw[k : k + 4], sys.byteorder) for k in range(0, len(raw), 4))
    return f"{''.join(f'{word:08X}' for word in words)}:{port:04X}"
