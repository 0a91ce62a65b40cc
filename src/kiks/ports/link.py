"""A program's way to a shared world; `participant.py` is the other end.

It leads over a socket from another process, over a WebSocket from another computer (`joining.py`), or from a thread of
the world's process (`thread_link.py`).

The program has a time of its own: thinking, sleeping and polling need no message. Only requests that need the world
make a round trip.
"""

from __future__ import annotations

import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol

from kiks.clock.own_lock import OwnLock
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import LinkError
from kiks.ports.messages import (
    ANSWER_BYTES_MAX,
    RECEIVE_SIZE,
    REQUEST_BYTES_MAX,
    WINDOW,
    Answer,
    Inbox,
    Request,
    Verb,
    packed,
)
from kiks.sim.read_completion import NEVER_NS, Read
from kiks.units import TICK_NS

REPORT_NS = TICK_NS
"""Simulated time after which a program reports its time to the scheduler [ns]."""

PIECE = REQUEST_BYTES_MAX - 1000
"""Longest piece of a text for the debugger [characters]."""

_SIZE_MAX = 1 << 32
"""More characters than any read completes with; messages hold no larger number for a larger size."""


class Link(ABC):
    """The way to a world, and the program's time.

    Args:
        lock: Held while it is used.
        is_late: Whether the world may have begun already: then the program's time begins when it first needs it.
        end_ns: Where the time of the world ends [ns], and with it the program.

    Attributes:
        slice_ns: Simulated time that passes in one piece while the program pauses [ns]; a pause can be interrupted
            between two pieces.
    """

    slice_ns = NEVER_NS

    def __init__(self, lock: AbstractContextManager[Any], *, is_late: bool = False, end_ns: int = NEVER_NS) -> None:
        self.lock = lock
        self._now_ns = 0
        self._needs_time = is_late
        self._end_ns = end_ns
        self._reported_ns = 0
        self._thought_ns = 0
        self._unanswered_count = 0
        self._ticket = 0

    @abstractmethod
    def _transmit(self, request: Request) -> None:
        """Send a request."""

    @abstractmethod
    def _wait(self, ticket: int) -> Answer:
        """Wait for the answer with a ticket and return it."""

    @property
    def now_ns(self) -> int:
        """The program's time [ns]."""
        # It joins a world that may have begun: only the world knows what time it is.
        if self._needs_time:
            self.ask(Verb.MEET)
        return self._now_ns

    @property
    def known_ns(self) -> int:
        """The same, or 0 as long as the program has not needed its time [ns]."""
        return self._now_ns

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]."""
        now_ns, slice_ns = self.now_ns, self.slice_ns
        while now_ns + slice_ns < time_ns:
            now_ns += slice_ns
            self._advance_to(now_ns)
            self._end_slice()
        self._advance_to(time_ns)

    def _advance_to(self, time_ns: int) -> None:
        self._now_ns = max(self._now_ns, time_ns)
        if self._now_ns > self._end_ns:
            # Never answered: the program does nothing more until the world ends.
            self.ask(Verb.MEET)
        elif self._now_ns - self._reported_ns >= REPORT_NS:
            self.send(Verb.REACHED)

    def think(self, time_ns: int) -> None:
        """Let the program's thinking time pass [ns]."""
        now_ns = self.now_ns
        self._thought_ns += time_ns
        self.pass_to(now_ns + time_ns)

    def send(self, kind: int, robot: int = 0, *arguments: Any) -> None:
        """Send a request without waiting for an answer."""
        self._post(kind, robot, 0, arguments)
        self._unanswered_count += 1
        # A program that only tells would run ahead of the world without a limit.
        if self._unanswered_count >= WINDOW:
            self.ask(Verb.MEET)

    def ask(self, kind: int, robot: int = 0, *arguments: Any) -> Answer:
        """Send a request and wait for the answer.

        Raises:
            LinkError: If the answer is an error.
        """
        # The answer to a request that Ctrl-C has interrupted may still come, with another ticket.
        self._ticket += 1
        self._post(kind, robot, self._ticket, arguments)
        answer = self._wait(self._ticket)
        self._unanswered_count = 0
        self._now_ns = self._reported_ns = answer.now_ns
        self._needs_time = False
        if answer.error:
            raise LinkError(answer.error)
        return answer

    def consult(self, text: str) -> str:
        """Tell the debugger of the program something, and return its answer; no time passes for the world.

        Args:
            text: In ASCII, and as long as one likes.
        """
        for begin in range(0, len(text), PIECE):
            self._ticket += 1
            piece = text[begin : begin + PIECE], begin + PIECE >= len(text)
            self._transmit(Request(Verb.DEBUG, 0, self._now_ns, self._ticket, 0, piece))
            answer = self._wait(self._ticket)
        return str(answer.result)

    def meet(self) -> None:
        """Wait until the world has come to the program's time."""
        self.ask(Verb.MEET)

    def stand(self, stands: bool) -> None:
        """Tell the world that a debugger has stopped the program, or lets it go on, with no effect on the run."""
        self._transmit(Request(Verb.STAND, 0, self._now_ns, arguments=(stands,)))
        if stands and not self._needs_time:
            self.meet()  # the world comes to the program's time, as people look at it now

    def _end_slice(self) -> None:
        """Wait for the world; an interrupted pause ends here."""
        self.meet()

    # ---- what a session of Octave asks for; there is nothing to do where its process has the link alone ----

    def rest(self) -> None:  # noqa: B027
        """Note that the program has no open port."""

    def wake(self) -> None:  # noqa: B027
        """Note that it opens one again."""

    def cancel(self) -> None:  # noqa: B027
        """Note that it waits for no answer any more; from any thread."""

    def halt(self) -> None:  # noqa: B027
        """Leave the world at once."""

    def close(self) -> None:  # noqa: B027
        """Leave the world; earlier requests are still done."""

    def live(self, time_ns: int) -> bool:
        """Let time pass [ns] while the program computes; return whether it did: here its own process sees to that."""
        return False

    def _post(self, kind: int, robot: int, ticket: int, arguments: tuple[Any, ...]) -> None:
        request = Request(kind, robot, self._now_ns, ticket, self._thought_ns, arguments)
        # Each request carries the time, so that others need no message.
        self._reported_ns = self._now_ns
        self._thought_ns = 0
        self._transmit(request)


class Stream(Protocol):
    """What a link needs of a socket."""

    def sendall(self, data: bytes) -> None:
        """Send bytes; raise an `OSError` if the connection is closed."""

    def recv(self, size: int) -> bytes:
        """Return the next bytes; none if the connection is closed."""


class SocketLink(Link):
    """The link to a world in another process, over a socket or what stands for one; see `Link`."""

    def __init__(self, stream: Stream, *, is_late: bool = False, end_ns: int = NEVER_NS) -> None:
        super().__init__(OwnLock(), is_late=is_late, end_ns=end_ns)
        # Of the socket as it is now: `script/socket_waits.py` gives sockets other methods while a program runs.
        self._send_all, self._receive = stream.sendall, stream.recv
        self._inbox = Inbox(ANSWER_BYTES_MAX)

    make_answer: Callable[[Any], Answer] = staticmethod(Answer._make)
    """Makes an answer of the fields of a message."""

    def _transmit(self, request: Request) -> None:
        try:
            self._send_all(packed(tuple(request)))
        except OSError:
            # While it exits, Python clears objects in any order: a port may be closed after this socket.
            if not sys.is_finalizing():
                self.end()

    def _wait(self, ticket: int) -> Answer:
        while True:
            received = self.take()
            # The world has closed the connection.
            if not received:
                self.end()
            for fields in self._inbox.take(received):
                if (answer := self.make_answer(fields)).ticket == ticket:
                    return answer

    def take(self) -> bytes:
        """Return the next bytes of the world; none if the connection is closed."""
        try:
            return self._receive(RECEIVE_SIZE)
        except OSError:
            return b""

    def end(self) -> None:
        """Exit at once: without the world the program cannot do anything useful."""
        sys.stdout.flush()
        os._exit(1)


class RemoteLine:
    """A robot's line in a shared world; see `Line`."""

    def __init__(self, link: Link, robot: int) -> None:
        self.lock: AbstractContextManager[Any] = link.lock
        self._link = link
        self._robot = robot
        self.think = link.think
        self.pass_to = self.wait_for_room = link.pass_to
        self._taken_ns = 0
        # Upper bound of the characters on the way to the robot.
        self._ahead_count = 0

    @property
    def now_ns(self) -> int:
        """The program's time [ns]."""
        return self._link.now_ns

    @property
    def known_ns(self) -> int:
        """The same as far as it is known [ns]; see `Line`."""
        return self._link.known_ns

    def send(self, data: bytes, spare: int) -> bool:
        """Put characters on the line, if it has room for them and some more; see `Line.send`."""
        if self.room_ns(len(data) + spare) > self.now_ns:
            return False
        self._link.send(Verb.SEND, self._robot, data)
        self._ahead_count += len(data)
        return True

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator; see `Line.read`."""
        data: bytes
        data, self._taken_ns = self._ask(Verb.READ, _plain(size), terminator, timeout_ns, poll_ns)
        return data

    @property
    def taken_ns(self) -> int:
        """When the last character arrived that was read [ns]."""
        return self._taken_ns

    def arrived_count(self) -> int:
        """Return the number of characters that have arrived and were not read."""
        return int(self._ask(Verb.COUNT))

    def sent_ns(self) -> int:
        """Return the time at which all characters will have been sent [ns]."""
        return int(self._ask(Verb.SENT))

    def room_ns(self, count: int) -> int:
        """Return when the line has room for some characters [ns]; a time that is over: it has."""
        return 0 if self._ahead_count + count <= BACKLOG_LIMIT else int(self._ask(Verb.ROOM, count))

    def wake(self) -> None:
        """Do nothing: no other thread of the program goes on while one waits."""

    def wait_for(self, reads: Sequence[Read], until_ns: int) -> list[bool]:
        """Let time pass until one of several reads is complete; see `Line.wait_for`."""
        plain = [(read.robot, _plain(read.size), read.terminator) for read in reads]
        flags: list[bool] = self._link.ask(Verb.WAIT, 0, plain, until_ns).result
        return flags

    def drop_arrived(self) -> None:
        """Drop the characters that have arrived and were not read."""
        self._link.send(Verb.DROP, self._robot)

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""
        return int(self._ask(Verb.BAUD))

    def set_baud(self, baud: int) -> None:
        """Set both ends to a speed [bit/s]."""
        self._link.send(Verb.SET_BAUD, self._robot, baud)

    def claim(self, holder: str) -> None:
        """Take the line exclusively."""
        self._ask(Verb.CLAIM, holder)

    def hang_up(self) -> None:
        """Release the line and drop unread characters."""
        self._link.send(Verb.HANG_UP, self._robot)

    def stand(self, stands: bool) -> None:
        """Tell the world that a debugger has stopped the program, or lets it go on."""
        self._link.stand(stands)

    def look(self) -> tuple[Any, ...]:
        """Ask what is to be known of the robot; see `state_of`."""
        state: tuple[Any, ...] = self._link.ask(Verb.LOOK, self._robot).result
        return state

    def _ask(self, kind: int, *arguments: Any) -> Any:
        answer = self._link.ask(kind, self._robot, *arguments)
        self._ahead_count = answer.ahead_count
        return answer.result


def _plain(size: int | None) -> int | None:
    """Return the size of a read as a message holds it: `True` is a size, too."""
    return None if size is None else min(int(size), _SIZE_MAX)
