"""The token that authenticates browsers.

Other users of this computer can reach the desk's port, and a program started there runs as the owner. They also see the
command line of every process, including the URL that a browser is started with. So each process makes a random token,
which the terminal prints in a URL, and which a browser keeps in a cookie. A browser that KiKS starts gets a ticket
instead, which is valid once, and only for a connection of the same user.

Browsers share cookies among all ports of a computer, and any user may listen at a port, such as that of a desk that has
ended. But they send a cookie only to its path. So all addresses behind the token begin with a random path, the place of
the process, and nothing but its own pages asks for it.
"""

from __future__ import annotations

import hmac
import os
import secrets

from kiks.ports.connection_user import Address, connection_user

TOKEN_BYTES = 24

COOKIE = "kiks_token"

LIBRARY_PATHS = ("/_nicegui/", "/_nicegui_ws/")
"""Where NiceGUI's files and sockets are; `PageGuard` keeps the pages apart that are behind them."""


class Token:
    """A token, what it opens, and its tickets.

    Attributes:
        token: The text of the token; a random one if left out.
        place: Begin of the path of all pages that need it; a random one if left out.
        desk: The only desk that it opens; None: it opens all that the server has.
    """

    def __init__(self, token: str | None = None, place: str | None = None, *, desk: int | None = None) -> None:
        self.token = secrets.token_urlsafe(TOKEN_BYTES) if token is None else token
        self.place = f"/{secrets.token_urlsafe(TOKEN_BYTES)}" if place is None else place
        self.desk = desk
        self._tickets: set[str] = set()

    def opens(self, path: str) -> bool:
        """Return whether it opens a path below its place.

        Example:
            >>> key = Token(desk=2)
            >>> [key.opens(path) for path in ("/desk/2/feed", "/desk/20/feed", "/desk/3", "/room")]
            [True, False, False, False]
        """
        if self.desk is None:
            return True
        own = f"/desk/{self.desk}"
        return path in ("/", own, "/favicon.ico") or path.startswith((f"{own}/", *LIBRARY_PATHS))

    def fits(self, given: str) -> bool:
        """Compare a text with the token in constant time."""
        return hmac.compare_digest(given.encode(errors="replace"), self.token.encode())

    def new_ticket(self) -> str:
        """Return a new ticket, which opens the desk once, in a browser of this user."""
        ticket = secrets.token_urlsafe(TOKEN_BYTES)
        self._tickets.add(ticket)
        return ticket

    def take(self, ticket: str, client: Address | None, server: Address | None) -> bool:
        """Return whether a ticket is valid for a connection, and use it up if so.

        Args:
            ticket: The ticket.
            client: Address of the browser's end.
            server: Address of this end.
        """
        if ticket not in self._tickets or client is None or server is None:
            return False
        user = connection_user(client, server)
        if user is None or user not in (os.getuid(), 0):
            return False
        self._tickets.discard(ticket)
        return True
