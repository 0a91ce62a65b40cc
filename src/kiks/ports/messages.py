"""The messages between a program and the process that runs the world.

A program sends requests, stamped with its own time. Some requests only tell and get no answer, so the program goes on
at once. The others ask, and the answer carries the program's new time. Between processes, a message is four bytes for
its length and what `marshal` makes of its fields; within a process it is handed over as it is.
"""

from __future__ import annotations

import marshal
import struct
from typing import Any, NamedTuple

RECEIVE_SIZE = 1 << 16
"""Most bytes read from the connection at once."""

WINDOW = 64
"""Requests that a program may send without an answer: it limits how far a program runs ahead of the world."""


class Kind:
    """The kinds of requests, and their arguments; plain numbers, because an `Enum` costs a tenth of an exchange."""

    REACHED = 1
    """Tells that the program does nothing before its time."""
    MEET = 2
    """Asks for an answer when the world has reached the program's time."""
    FIND = 3
    """Asks for the number of the robot behind a port name."""
    CLAIM = 4
    """Asks for a robot's line exclusively, by the name of the program."""
    HANG_UP = 5
    """Releases a line, if the argument is true, and drops unread characters."""
    SEND = 6
    """Sends characters."""
    ROOM = 7
    """Asks when the line has room for a number of characters [ns]."""
    READ = 8
    """Asks for characters and when the last one arrived [ns]; the arguments are those of `Line.read`."""
    COUNT = 9
    """Asks for the number of characters that have arrived."""
    DROP = 10
    """Drops the characters that have arrived."""
    SENT = 11
    """Asks when all characters will have been sent [ns]."""
    SET_BAUD = 12
    """Sets the speed."""
    BAUD = 13
    """Asks for the speed."""
    WAIT = 14
    """Asks for an answer when one of several reads, each a tuple, is complete, or at a time [ns]."""
    END = 15
    """Represents the end of the connection; never sent."""


ASKING = frozenset(range(1, 15)) - {Kind.REACHED, Kind.HANG_UP, Kind.SEND, Kind.DROP, Kind.SET_BAUD}
"""The kinds that get an answer."""


class Request(NamedTuple):
    """A request of a program; `robot` is 0 where it does not matter, and the answer has the same ticket.

    Attributes:
        at_ns: The program's time [ns].
        thought_ns: Thinking time since the last request [ns].
        arguments: What its kind needs.
    """

    kind: int
    robot: int
    at_ns: int
    ticket: int = 0
    thought_ns: int = 0
    arguments: tuple[Any, ...] = ()


class Answer(NamedTuple):
    """An answer to a request.

    Attributes:
        ticket: Ticket of the request.
        now_ns: The program's new time [ns].
        result: What was asked for.
        ahead_count: Characters on the way to the robot.
        error: The message of an error; empty if there was none.
    """

    ticket: int
    now_ns: int
    result: Any = None
    ahead_count: int = 0
    error: str = ""


class AwaitedAnswer:
    """The answer that a program in a thread of this process waits for; other threads set its attributes.

    Attributes:
        is_cancelled: Whether the program has stopped waiting.
        is_halted: Whether a person has halted the program, which does not know it yet.
        is_held: Whether the program has yet to confirm that it waits; until then its pause must not go on.
    """

    def __init__(self) -> None:
        self.is_cancelled = self.is_halted = self.is_held = False

    @property
    def is_given_up(self) -> bool:
        """Whether nothing waits for it."""
        return self.is_cancelled or self.is_halted


class Start(NamedTuple):
    """What the process of a program gets at its start.

    Attributes:
        is_late: Whether the world may have begun already; else the program begins with it.
        end_ns: Where the time of the world ends [ns].
        thinking: The thinking policy.
        record: File for the measured thinking times; empty for none.
        offered: The port names that the program finds when it lists ports.
        seed: What all its random numbers follow from.
        module: Name of a module to run in place of the file, as `python -m` does; empty for none.
        program: Its file, or a folder or an archive with a `__main__.py`.
        arguments: What it finds in `sys.argv` after its name.
    """

    is_late: bool
    end_ns: int
    thinking: str
    record: str
    offered: list[str]
    seed: str
    module: str
    program: str
    arguments: list[str]


_LENGTH = struct.Struct("<I")

_MARSHAL_VERSION = 2
"""Later ones look for objects that occur twice, which takes half as long again."""


def packed(message: tuple[Any, ...]) -> bytes:
    """Return the fields of a message as bytes."""
    data = marshal.dumps(message, _MARSHAL_VERSION)
    return _LENGTH.pack(len(data)) + data


class Inbox:
    """Makes messages of the bytes of a connection, which come in any pieces."""

    def __init__(self) -> None:
        self._rest = b""

    def take(self, data: bytes) -> list[Any]:
        """Take bytes; return the messages that are complete with them, as tuples of their fields."""
        if self._rest:
            data = self._rest + data
        messages, start, size = [], 0, len(data)
        while start + 4 <= size and (end := start + 4 + _LENGTH.unpack_from(data, start)[0]) <= size:
            messages.append(marshal.loads(data[start + 4 : end]))
            start = end
        self._rest = data[start:]
        return messages
