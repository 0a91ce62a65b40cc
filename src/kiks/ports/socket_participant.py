"""A program at the other end of a socket, as the scheduler sees it.

It is not trusted, so nothing that it sends is taken on its word. Whatever comes, it raises no exception in the world,
never makes it wait, and takes memory up to fixed limits. A program that breaks a rule is ended, its robots stop, and
`reason` says which rule. Its robots stop, too, when it is lost or dismissed.
"""

from __future__ import annotations

import selectors
import socket

from kiks.ports.messages import (
    ANSWER_BYTES_MAX,
    RECEIVE_SIZE,
    REQUEST_BYTES_MAX,
    WINDOW,
    Answer,
    Inbox,
    MessageError,
    checked_request,
    packed,
)
from kiks.ports.participant import ProgramParticipant
from kiks.ports.port_names import PortNames
from kiks.ports.program_scheduler import ProgramScheduler

QUEUE_MAX = 8 * WINDOW
"""Most requests of a program that wait. It sends `WINDOW` and one that asks; a few more if Ctrl-C interrupts it."""

LAST_PIECES_MAX = 64
"""Most pieces of `RECEIVE_SIZE` that are read when a program has gone: more than a socket holds."""


class SocketParticipant(ProgramParticipant):
    """A program at the other end of a socket, which may lead to another computer; a `SocketLink` is its own end.

    Args:
        name: Its name in messages.
        connection: This end of the socket to it.
        robot: Number of its own robot, and its place in the order of programs that act at the same instant.
        scheduler: See `ProgramParticipant`.
        names: See `ProgramParticipant`.
        selector: Tells when the connection is ready.

    Attributes:
        has_hung_up: Whether it has closed its end of the socket.
    """

    _sent_limit = 0
    _farewell = ""

    def __init__(
        self,
        name: str,
        connection: socket.socket,
        robot: int,
        scheduler: ProgramScheduler,
        names: PortNames,
        selector: selectors.BaseSelector,
    ) -> None:
        super().__init__(name, robot, robot, scheduler, names)
        self.has_hung_up = False
        self._socket = connection
        self._socket.setblocking(False)
        self._inbox = Inbox(REQUEST_BYTES_MAX)
        self._unsent = b""
        self._selector = selector
        selector.register(connection, selectors.EVENT_READ, self.exchange)

    @property
    def farewell(self) -> str:
        """Why the connection was ended, as a sentence for its user; empty if the program has left by itself."""
        return f"The program {self.reason}." if self.reason else self._farewell

    @property
    def state(self) -> str:
        """What it does, as the rest of a sentence about it."""
        if self.has_left:
            return "was lost or disconnected" if self.is_stopped or self.reason else "has ended"
        if self.is_here:
            return "drives" if self._scheduler.has_begun else "is ready"
        return "has come"

    def dismiss(self, why: str) -> None:
        """Disconnect the program at once: its robot stops and is free. Needs the lock of the world.

        Args:
            why: For its user.
        """
        if not self.has_left:
            self._farewell = why
        self.is_stopped = True
        self.disconnect()
        self.close()

    def drop(self) -> None:
        """Disconnect the program, because it was silent for too long."""
        self.end_because("was silent while others waited")

    def close(self) -> None:
        """Close the connection."""
        self._unregister()
        self._socket.close()

    def exchange(self, events: int) -> None:
        """Send and take what the connection is ready for."""
        if events & selectors.EVENT_WRITE:
            self._send(self._unsent)
        if events & selectors.EVENT_READ and self._receive() is False:
            self.hang_up()

    def hang_up(self) -> None:
        """Take the last requests of the program, which sends no more."""
        if self.has_hung_up:
            return
        # Requests that it has sent before its end still count, or the run would depend on when the end is noticed.
        for _ in range(LAST_PIECES_MAX):
            if not self._receive():
                break
        self._unregister()
        self.leave()
        if self.has_left:
            self.close()

    def _unregister(self) -> None:
        if not self.has_hung_up:
            self.has_hung_up = True
            self._selector.unregister(self._socket)

    def reply(self, answer: Answer) -> None:
        """Send an answer; bytes that the program does not take yet wait."""
        # A program that never reads must not fill the memory of the world.
        if len(self._unsent) > ANSWER_BYTES_MAX:
            self.end_because("asked the world again and again without reading its answers")
        else:
            self._send(self._unsent + packed(tuple(answer)))

    def take(self, data: bytes) -> None:
        """Take bytes that the program has sent, in any pieces."""
        try:
            for fields in self._inbox.take(data):
                self.add_request(checked_request(fields))
                # Nor may one that never waits.
                if len(self._requests) > QUEUE_MAX:
                    raise MessageError(f"sent more than {QUEUE_MAX} requests without waiting for an answer")
        except MessageError as error:
            self.end_because(str(error))

    def _send(self, data: bytes) -> None:
        had_unsent = bool(self._unsent)
        try:
            self._unsent = data[self._socket.send(data) :]
        except BlockingIOError:
            self._unsent = data
        # It has gone, which the next read tells.
        except OSError:
            self._unsent = b""
        has_unsent = bool(self._unsent)
        if has_unsent is not had_unsent and not self.has_hung_up:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if has_unsent else 0)
            self._selector.modify(self._socket, events, self.exchange)

    def _receive(self) -> bool | None:
        """Take requests that have arrived; return None if there are none, and False if the program has hung up."""
        try:
            received = self._socket.recv(RECEIVE_SIZE)
        except BlockingIOError:
            return None
        except OSError:
            received = b""
        self.take(received)
        return bool(received)
