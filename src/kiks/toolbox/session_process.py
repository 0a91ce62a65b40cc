"""The process of a session: who comes in by pipes or TCP, and when all is over.

Octave starts it and speaks with it by its standard input and output; another Octave, and MATLAB, which has no pipes,
come by TCP, on this computer only, and with a token that stands in a file of the user's alone. It ends when the last of
them has gone, however that was: a crashed Octave leaves nothing behind.
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
from kiks.ports.file_descriptors import opening
from kiks.ports.pending_connections import PendingConnections
from kiks.toolbox.framing import LOOK_MS, Exchange, Heartbeat, write_all
from kiks.toolbox.requests import answer
from kiks.toolbox.session import Session
from kiks.toolbox.session_client import SessionClient
from kiks.toolbox.session_files import SessionAddress, SessionFile

FIRST_S = 30.0
"""How long a process that listens waits for the first who comes [s of real time]."""

TOKEN_BYTES = 24

_READ_SIZE = 1 << 16

_log = logging.getLogger("kiks.session")


class SessionProcess:
    """The process of a session.

    Args:
        session: The session.
        pulse: What lets those who wait long for an answer know that it is still to come.

    Raises:
        LinkError: If this user's folder for sessions cannot be written.
    """

    def __init__(self, session: Session, pulse: Heartbeat) -> None:
        self._session = session
        self._pulse = pulse
        with opening("the port of a session"), contextlib.ExitStack() as undo:
            listener = undo.enter_context(socket.create_server(("127.0.0.1", 0)))
            self.address = SessionAddress(os.getpid(), listener.getsockname()[1], secrets.token_urlsafe(TOKEN_BYTES))
            self._file = SessionFile(self.address)
            self._lobby = PendingConnections(listener, self.address.token, self._let_in)
            undo.pop_all()
        self._there: list[Exchange] = []
        self._count = 0
        self._lock = threading.Lock()
        self._is_over = threading.Event()
        threading.Thread(target=self._lobby.run, name="kiks lobby", daemon=True).start()

    def speak_with(self, exchange: Exchange) -> None:
        """Let a program take part."""
        with self._lock:
            self._count += 1
            self._there.append(exchange)
            visitor = SessionClient(self._session, self._count, exchange)
        exchange.on_cancel = visitor.cancel
        if exchange.beat not in self._pulse.acts:
            self._pulse.acts.append(exchange.beat)
        threading.Thread(target=self._attend, args=(visitor, exchange), name=visitor.name, daemon=True).start()

    def run(self) -> None:
        """Move the world until the last has gone; then `close` is due."""
        waited = threading.Timer(FIRST_S, self._go_if_alone)
        waited.daemon = True
        waited.start()
        self._pulse.acts.append(self._look_around)
        while not self._is_over.is_set():
            self._session.round()

    def close(self) -> None:
        """Let nobody in any more, and end the world."""
        with self._lock:
            self._file.close()
        self._lobby.close()
        self._session.close()

    # ---- who is there ----

    def _let_in(self, connection: socket.socket, said: bytes) -> None:
        with contextlib.suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        number = connection.fileno()
        self.speak_with(Exchange(number, number, close=connection.close, said=said))

    def _attend(self, visitor: SessionClient, exchange: Exchange) -> None:
        """Answer a program line by line until it hangs up."""
        try:
            with contextlib.suppress(OSError):
                if exchange.greet(self.address.line()):
                    self._announce()
                    for line in exchange.lines():
                        exchange.reply(answer(visitor, line))
        finally:
            self._pulse.acts.remove(exchange.beat)
            with self._lock:
                self._there.remove(exchange)
            self._part_if_others_stay(exchange)
            visitor.leave()
            self._part_if_others_stay(exchange)
            self._go_if_alone()

    def _announce(self) -> None:
        """Let others find the session, now that somebody takes part."""
        with self._lock:
            try:
                self._file.open()
            except LinkError as error:
                _log.warning("others cannot join this session: %s", error)

    def _part_if_others_stay(self, exchange: Exchange) -> None:
        """Let a program know that it has left; else the end of this process does."""
        if self._there:
            exchange.part()

    def _go_if_alone(self) -> None:
        if not self._there:
            self._is_over.set()

    def _look_around(self) -> None:
        """Let a paused world go on when all have gone: it keeps them from leaving."""
        with self._lock:
            there = self._there[:]
        if all(exchange.has_left for exchange in there):
            self._session.let_go()


def join(address: SessionAddress, exchange: Exchange, source: int, sink: int) -> None:
    """Carry what a program says on two descriptors to a session and back, until one of the two hangs up.

    Raises:
        LinkError: If the session has ended.
    """
    with address.connect() as connection, contextlib.suppress(OSError):
        connection.sendall(exchange.hand_over())
        while not exchange.is_orphaned:
            ready, _, _ = select.select([source, connection.fileno()], [], [], LOOK_MS / 1000)
            for each in ready:
                piece = os.read(source, _READ_SIZE) if each == source else connection.recv(_READ_SIZE)
                if not piece:
                    return
                if each == source:
                    connection.sendall(piece)
                else:
                    write_all(sink, piece)
