"""The messages between a program and the process that runs the world.

A program sends requests, stamped with its own time. Some requests only tell and get no answer, so the program goes on
at once. The others ask, and the answer carries the program's new time. Between processes, a message is four bytes for
its length and the array of its fields as MessagePack; within a process it is handed over as it is.

The sender of a message may be an untrusted program, so nothing is believed: `Inbox` refuses a length beyond its
limit before the message comes, and takes plain data of bounded size alone; `checked_request` checks the kind, and the
type and range of each field. Each raises a `MessageError`, and nothing else. Whether a program may do to a robot what
it asks for depends on the world, and is checked there (`ports/participant.py`).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, NamedTuple

import msgpack

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import KiksError, LinkError, printable
from kiks.model.checks import CLOCK_END_NS, ROBOTS_MAX
from kiks.sim.port import BAUD_MAX, BAUD_MIN
from kiks.sim.read_completion import NEVER_NS, is_ended

RECEIVE_SIZE = 1 << 16
"""Most bytes read from the connection at once."""

WINDOW = 64
"""Requests that a program may send without an answer: it limits how far a program runs ahead of the world."""

REQUEST_BYTES_MAX = 1 << 16
"""Longest request."""

ANSWER_BYTES_MAX = 2 << 20
"""Longest answer: the characters that a line keeps for its reader (`OUTPUT_LIMIT`), and more."""

ERROR_MAX = 1000
"""Most characters of the error of a world that is not trusted."""

DOUBT_MAX = 200
"""Longest reason why a program might do something else next time [characters]."""

ITEMS_MAX = 1024
"""Most items of an array in a message, such as the reads of `Verb.WAIT`."""


class MessageError(KiksError):
    """What has come is no message, as a sentence about the program: 'sent ...'."""


class Verb:
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
    """Releases a line, and drops unread characters."""
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
    DOUBT = 16
    """Tells why the program might do something else next time, in at most `DOUBT_MAX` characters."""
    STAND = 17
    """Tells that a debugger has stopped the program, or lets it go on; takes effect at once."""
    LOOK = 18
    """Asks what is to be known of a robot; see `state_of`."""
    DEBUG = 19
    """Tells the debugger something, and asks what to do: a piece of a text, and whether it is the last one."""


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

    def check(self) -> None:
        """Check that the program still waits.

        Raises:
            LinkError: If not.
        """
        if self.is_given_up:
            raise LinkError("the answer must be waited for, but the program was interrupted. Ask again.")


class Start(NamedTuple):
    """What the process of a program gets at its start.

    Attributes:
        is_late: Whether the world may have begun already; else the program begins with it.
        end_ns: Where the time of the world ends [ns].
        thinking: The thinking policy.
        offered: The port names that the program finds when it lists ports.
        seed: What all its random numbers follow from.
        record: File for the measured thinking times; empty for none.
        module: Name of a module to run in place of the file, as `python -m` does; empty for none.
        program: Its file, or a folder or an archive with a `__main__.py`.
        arguments: What it finds in `sys.argv` after its name.
        pulse_mm: Way of its robot's wheels for a pulse of their encoders [mm].
        is_debugged: Whether a debugger follows the program; its first request then asks what it shall do.
        addresses: The addresses at which it finds robots in a network, each with the robot's name.
    """

    is_late: bool
    end_ns: int
    thinking: str
    offered: list[str]
    seed: str
    record: str = ""
    module: str = ""
    program: str = ""
    arguments: list[str] = []  # noqa: RUF012  (replaced, never changed)
    pulse_mm: float = 0.0
    is_debugged: bool = False
    addresses: dict[str, str] = {}  # noqa: RUF012  (replaced, never changed)


_LENGTH = struct.Struct("<I")

_pack: Callable[[tuple[Any, ...]], bytes] = msgpack.Packer(unicode_errors="surrogatepass").pack


def packed(message: tuple[Any, ...]) -> bytes:
    """Return the fields of a message as bytes."""
    data = _pack(message)
    return _LENGTH.pack(len(data)) + data


class Inbox:
    """Makes messages of the bytes of a connection, which come in any pieces.

    Args:
        limit: Longest message [bytes].
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._rest = b""

    def take(self, data: bytes) -> list[Any]:
        """Take bytes; return the messages that are complete with them: of each, its fields, not checked yet.

        Raises:
            MessageError: If they are no messages, or one is too long.
        """
        if self._rest:
            data = self._rest + data
        messages, start, size = [], 0, len(data)
        while start + 4 <= size:
            length = _LENGTH.unpack_from(data, start)[0]
            if length > self._limit:
                raise MessageError(f"sent a message of {length} bytes to the world")
            end = start + 4 + length
            if end > size:
                break
            messages.append(_unpacked(data[start + 4 : end]))
            start = end
        self._rest = data[start:]
        return messages


def _unpacked(data: bytes) -> Any:
    try:
        # Bytes and texts are no longer than the message. An array may say so, too, and takes eight times its length.
        return msgpack.unpackb(
            data, use_list=False, unicode_errors="surrogatepass", max_array_len=ITEMS_MAX, max_map_len=0, max_ext_len=0
        )
    except (ValueError, msgpack.UnpackException):
        raise MessageError("sent something to the world that is no message") from None


def checked_request(fields: Any) -> Request:
    """Return the fields of a message as a request.

    A time beyond the end of all time becomes that end.

    Raises:
        MessageError: If they are none.
    """
    if fields.__class__ is tuple and len(fields) == 6:
        kind, robot, at_ns, ticket, thought_ns, arguments = fields
        if (
            kind.__class__ is robot.__class__ is at_ns.__class__ is ticket.__class__ is thought_ns.__class__ is int
            and arguments.__class__ is tuple
            and robot >= 0 <= at_ns
            and ticket >= 0 <= thought_ns
            and _ARGUMENTS.get(kind, _is_unknown)(arguments)
        ):
            # A program may sleep for ever; the world ends then.
            if at_ns > CLOCK_END_NS or thought_ns > CLOCK_END_NS:
                at_ns, thought_ns = min(at_ns, CLOCK_END_NS), min(thought_ns, CLOCK_END_NS)
                return Request(kind, robot, at_ns, ticket, thought_ns, arguments)
            return _as_request(Request, fields)
    raise MessageError("sent something to the world that is no request")


def checked_answer(fields: Any) -> Answer:
    """Return the fields of a message as an answer, whose error, if any, is a line; see `Asked` for its result.

    Raises:
        MessageError: If they are none.
    """
    if fields.__class__ is tuple and len(fields) == 5:
        ticket, now_ns, _, ahead_count, error = fields
        if (
            ticket.__class__ is now_ns.__class__ is ahead_count.__class__ is int
            and error.__class__ is str
            and 0 <= now_ns <= CLOCK_END_NS
            and 0 <= ahead_count <= ANSWER_BYTES_MAX
        ):
            return Answer._make(fields)._replace(error=printable(error[:ERROR_MAX]))
    raise MessageError("sent something to the program that is no answer")


class Asked:
    """The requests of a program to a world that it does not trust, each of which has one answer of its kind.

    A program that has only sent text may print what it reads as it is, so it gets nothing that steers its terminal. One
    that has sent other bytes speaks to a robot in binary, and takes any.
    """

    def __init__(self) -> None:
        self._open: dict[int, Request] = {}
        self._takes_any_byte = False

    def note(self, request: Request) -> None:
        """Note a request that was sent."""
        if request.kind == Verb.SEND:
            self._takes_any_byte |= not request.arguments[0].isascii()
        if request.kind in ASKING:
            self._open[request.ticket] = request

    def answer(self, fields: Any) -> Answer:
        """Return the fields of a message as the answer to a request.

        Raises:
            MessageError: If they are none.
        """
        answer = checked_answer(fields)
        if (request := self._open.pop(answer.ticket, None)) is not None:
            # A host that turned the program's time back could make it wait for ever.
            passed_ns = answer.now_ns - min(request.at_ns, CLOCK_END_NS)
            is_right = _RESULTS[request.kind]
            if passed_ns >= 0 and (
                answer.error
                or (
                    is_right(answer.result, passed_ns, *request.arguments)
                    and (self._takes_any_byte or request.kind != Verb.READ or not _steers(answer.result[0]))
                )
            ):
                return answer
        raise MessageError("sent something to the program that answers none of its requests")


_as_request: Callable[[type[Request], tuple[Any, ...]], Request] = tuple.__new__
"""`Request._make` without a check of the length, in half its time."""


def _is_unknown(_arguments: tuple[Any, ...]) -> bool:
    return False


def _are(*checks: Callable[[Any], bool]) -> Callable[[tuple[Any, ...]], bool]:
    """Return a function that checks arguments, one by one."""
    count = len(checks)
    if count == 1:
        first = checks[0]
        return lambda arguments: len(arguments) == 1 and first(arguments[0])
    return lambda arguments: (
        len(arguments) == count and all(check(each) for check, each in zip(checks, arguments, strict=True))
    )


def _is_size(size: Any) -> bool:
    return size is None or (size.__class__ is int and size >= 0)


def _is_terminator(terminator: Any) -> bool:
    return terminator is None or terminator.__class__ is bytes


def _is_span(time_ns: Any) -> bool:
    return time_ns.__class__ is int and -CLOCK_END_NS <= time_ns <= 2 * CLOCK_END_NS


def _are_read(arguments: tuple[Any, ...]) -> bool:
    # In one go: most requests are reads.
    if len(arguments) != 4:
        return False
    size, terminator, timeout_ns, poll_ns = arguments
    return (
        (size is None or (size.__class__ is int and size >= 0))
        and (terminator is None or terminator.__class__ is bytes)
        and (timeout_ns is None or _is_span(timeout_ns))
        and poll_ns.__class__ is int
        and 0 <= poll_ns <= CLOCK_END_NS
    )


_STEERING = bytes({*range(0x20), *range(0x7F, 0xA0)} - {*b"\t\r\n\a\f"})
"""Characters that steer terminals; a bell and a form feed, with which some robots begin, do no harm."""


def _steers(data: bytes) -> bool:
    return data.translate(None, _STEERING) != data


def _is_read(
    result: Any, passed_ns: int, size: int | None, terminator: bytes | None, timeout_ns: int | None, _poll_ns: int
) -> bool:
    if not (result.__class__ is tuple and len(result) == 2 and result[0].__class__ is bytes and _is_span(result[1])):
        return False
    data = result[0]
    is_complete = len(data) == size or is_ended(data, terminator)
    is_in_vain = timeout_ns is not None and passed_ns >= timeout_ns
    # An incomplete read would be asked for again without an end.
    return (is_complete or is_in_vain) and (size is None or len(data) <= size)


def _is_within(least: int, most: int) -> Callable[..., bool]:
    return lambda result, *_: result.__class__ is int and least <= result <= most


_is_one_read = _are(lambda robot: robot.__class__ is int, _is_size, _is_terminator)


def _are_none(arguments: tuple[Any, ...]) -> bool:
    return arguments == ()


def _is_none(result: Any, *_: Any) -> bool:
    return result is None


def _is_time(result: Any, *_: Any) -> bool:
    return _is_span(result)


def _is_state(result: Any, *_: Any) -> bool:
    if not (result.__class__ is tuple and list(map(type, result)) == _STATE):
        return False
    senses = result[4:8]
    return _is_span(result[0]) and all(type(each) is int for sense in senses for each in sense)


_STATE = [int, float, float, float, tuple, tuple, tuple, tuple, bytes, bytes]

_RULES: dict[int, tuple[Callable[[tuple[Any, ...]], bool], Callable[..., bool] | None]] = {
    Verb.REACHED: (_are_none, None),
    Verb.MEET: (_are_none, _is_none),
    Verb.FIND: (_are(lambda name: name.__class__ is str), _is_within(1, ROBOTS_MAX)),
    Verb.CLAIM: (_are(lambda holder: holder.__class__ is str), _is_none),
    Verb.HANG_UP: (_are_none, None),
    Verb.SEND: (lambda each: len(each) == 1 and each[0].__class__ is bytes and len(each[0]) <= BACKLOG_LIMIT, None),
    Verb.ROOM: (_are(lambda count: count.__class__ is int and 0 <= count < 1 << 32), _is_time),
    Verb.READ: (_are_read, _is_read),
    Verb.COUNT: (_are_none, _is_within(0, ANSWER_BYTES_MAX)),
    Verb.DROP: (_are_none, None),
    Verb.SENT: (_are_none, _is_time),
    Verb.SET_BAUD: (_are(lambda baud: baud.__class__ is int and BAUD_MIN <= baud <= BAUD_MAX), None),
    Verb.BAUD: (_are_none, _is_within(BAUD_MIN, BAUD_MAX)),
    Verb.WAIT: (
        _are(
            lambda reads: (
                reads.__class__ is tuple and all(read.__class__ is tuple and _is_one_read(read) for read in reads)
            ),
            lambda until_ns: _is_span(until_ns) or (until_ns.__class__ is int and until_ns == NEVER_NS),
        ),
        lambda result, _, reads, __: result.__class__ is tuple and [*map(type, result)] == [bool] * len(reads),
    ),
    Verb.LOOK: (_are_none, _is_state),
    Verb.STAND: (_are(lambda stands: stands.__class__ is bool), None),
    Verb.DOUBT: (_are(lambda why: why.__class__ is str and why.isprintable() and len(why) <= DOUBT_MAX), None),
    Verb.DEBUG: (
        _are(lambda text: text.__class__ is str and text.isascii(), lambda is_last: is_last.__class__ is bool),
        lambda result, *_: result.__class__ is str,
    ),
}
"""Of each request that is sent: whether its arguments are right, and whether the result of its answer is, for the time
that has passed [ns] and the arguments; None if it has no answer."""

_ARGUMENTS = {verb: are_right for verb, (are_right, _) in _RULES.items()}
_RESULTS = {verb: is_right for verb, (_, is_right) in _RULES.items() if is_right is not None}

ASKING = frozenset(_RESULTS)
"""The requests that get an answer."""
