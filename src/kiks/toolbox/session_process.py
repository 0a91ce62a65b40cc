"""The process of a session: it accepts clients by pipes or TCP, and ends with the last of them.

Octave starts the process and talks to it over its standard input and output. Another Octave, and MATLAB, which has no
pipes, connect by TCP, on this computer only, with a token from a file that only the user can read. The process ends
when the last client has gone, even if Octave crashes.
"""

from __future__ import annotations

import contextlib
import logging
import os
import secrets
import select
import socket
import threading

from kiks.errors import LinkError
from kiks.ports.pending_connections import PendingConnections
from kiks.ports.resources import opening
from kiks.toolbox.framing import POLL_MS, Exchange, Heartbeat, write_all
from kiks.toolbox.requests import answer
from kiks.toolbox.session import Session
from kiks.toolbox.session_client import SessionClient
from kiks.toolbox.session_files import SessionAddress, SessionFile

FIRST_S = 30.0
"""Timeout of the first connection to a listening process [s of real time]."""

TOKEN_BYTES = 24

_READ_SIZE = 1 << 16

_log = logging.getLogger("kiks.session")


class SessionProcess:
    """The process of a session.

    Args:
        session: The session.
        heartbeat: Announces slow answers to the clients.

    Attributes:
        address: Where other programs can join the session.
        was_joined: Whether one has.

    Raises:
        LinkError: If this user's folder for sessions cannot be written.
    """

    def __init__(self, session: Session, heartbeat: Heartbeat) -> None:
        self._session = session
        self._heartbeat = heartbeat
        with opening("the port of a session"), contextlib.ExitStack() as undo:
            listener = undo.enter_context(socket.create_server(("127.0.0.1", 0)))
            self.address = SessionAddress(os.getpid(), listener.getsockname()[1], secrets.token_urlsafe(TOKEN_BYTES))
            self._file = SessionFile(self.address)
            self._pending = PendingConnections(listener, self.address.token, self._let_in)
            undo.pop_all()
        self.was_joined = False
        self._exchanges: list[Exchange] = []
        self._count = 0
        self._lock = threading.Lock()
        self._is_over = threading.Event()
        threading.Thread(target=self._pending.run, name="kiks pending connections", daemon=True).start()

    def add(self, exchange: Exchange) -> None:
        """Add a client and answer its requests in a thread."""
        with self._lock:
            self._count += 1
            self._exchanges.append(exchange)
            client = SessionClient(self._session, self._count, exchange)
        exchange.on_cancel = client.cancel
        if exchange.beat not in self._heartbeat.acts:
            self._heartbeat.acts.append(exchange.beat)
        threading.Thread(target=self._serve, args=(client, exchange), name=client.name, daemon=True).start()

    def run(self) -> None:
        """Move the world until the last client has gone; the caller then calls `close`."""
        waited = threading.Timer(FIRST_S, self._end_if_empty)
        waited.daemon = True
        waited.start()
        self._heartbeat.acts.append(self._check_clients)
        while not self._is_over.is_set():
            self._session.round()

    def close(self) -> None:
        """Accept no more clients and end the world."""
        with self._lock:
            self._file.close()
        self._pending.close()
        self._session.close()

    # ---- clients ----

    def _let_in(self, connection: socket.socket, said: bytes) -> None:
        self.was_joined = True
        with contextlib.suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        number = connection.fileno()
        self.add(Exchange(number, number, close=connection.close, said=said))

    def _serve(self, client: SessionClient, exchange: Exchange) -> None:
        """Answer the requests of a client until it leaves."""
        try:
            with contextlib.suppress(OSError):
                if exchange.greet(self.address.line()):
                    self._announce()
                    for line in exchange.lines():
                        # A program evaluates a typed command first, and then sends its request again.
                        exchange.reply(client.next_command() if client.typed else answer(client, line))
        finally:
            self._heartbeat.acts.remove(exchange.beat)
            with self._lock:
                self._exchanges.remove(exchange)
            self._close_if_others_stay(exchange)
            client.leave()
            self._close_if_others_stay(exchange)
            self._end_if_empty()

    def _announce(self) -> None:
        """Write the file by which other programs find the session."""
        with self._lock:
            try:
                self._file.open()
            except LinkError as error:
                _log.warning("others cannot join this session: %s", error)

    def _close_if_others_stay(self, exchange: Exchange) -> None:
        """Close a connection if the session goes on; else the end of this process closes it."""
        if self._exchanges:
            exchange.close()

    def _end_if_empty(self) -> None:
        if not self._exchanges:
            self._is_over.set()

    def _check_clients(self) -> None:
        """When all clients have gone, resume a paused world, which would keep them from leaving, or wait for none."""
        with self._lock:
            exchanges = self._exchanges[:]
        if all(exchange.has_left for exchange in exchanges):
            self._session.let_go()
            if exchanges and self._session.desk is None:  # the engine is being compiled, for a minute or so
                self._is_over.set()


def join(address: SessionAddress, exchange: Exchange, source: int, sink: int) -> None:
    """Relay between a program on two descriptors and a session, until one of them closes the connection.

    Raises:
        LinkError: If the session has ended.
    """
    with address.connect() as connection, contextlib.suppress(OSError):
        connection.sendall(exchange.hand_over())
        while not exchange.is_orphaned:
            ready, _, _ = select.select([source, connection.fileno()], [], [], POLL_MS / 1000)
            for each in ready:
                piece = os.read(source, _READ_SIZE) if each == source else connection.recv(_READ_SIZE)
                if not piece:
                    return
                if each == source:
                    connection.sendall(piece)
                else:
                    write_all(sink, piece)
