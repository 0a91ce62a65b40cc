"""Messages between processes: however a stream is cut, the same requests come out, and garbage is refused."""

import socket
import struct
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.ports.helpers import wheels
from tests.served import fresh

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.model.checks import CLOCK_END_NS
from kiks.ports.messages import REQUEST_BYTES_MAX, Answer, Inbox, MessageError, Request, Verb, checked_request, packed
from kiks.ports.participant import BURST_MAX
from kiks.ports.programs import Programs
from kiks.ports.socket_participant import QUEUE_MAX, SocketParticipant
from kiks.sim.read_completion import NEVER_NS

COUNTS = st.integers(0, 1 << 40)
NUMBERS = st.integers(-(1 << 63), (1 << 64) - 1)
SIZES = st.none() | COUNTS
TERMINATORS = st.none() | st.binary(max_size=9)
SPANS = st.integers(-CLOCK_END_NS, CLOCK_END_NS)
TEXTS = st.text(st.characters(), max_size=9)
READS = st.lists(st.tuples(st.integers(1, 2), SIZES, TERMINATORS), max_size=3).map(tuple)
ARGUMENTS = {
    **dict.fromkeys((Verb.REACHED, Verb.MEET, Verb.COUNT, Verb.DROP, Verb.SENT, Verb.BAUD, Verb.HANG_UP), st.just(())),
    Verb.FIND: st.tuples(st.sampled_from(["COM1", "kiks://1", "kiks://2", "kiks://[", "kiks://7?x=1"]) | TEXTS),
    Verb.CLAIM: st.tuples(TEXTS),
    Verb.SEND: st.tuples(st.sampled_from([b"N\n", b"D,3,4\n", b"\n" * 4096]) | st.binary(max_size=80)),
    Verb.ROOM: st.tuples(st.integers(0, 5000)),
    Verb.READ: st.tuples(SIZES, TERMINATORS, st.none() | SPANS, COUNTS),
    Verb.SET_BAUD: st.tuples(st.integers(75, 4_000_000)),
    Verb.WAIT: st.tuples(READS, st.just(NEVER_NS) | SPANS),
}
HEADS = st.integers(0, 3), st.integers(0, 10**9), COUNTS, COUNTS
REQUESTS = st.sampled_from(sorted(ARGUMENTS)).flatmap(
    lambda kind: st.builds(Request, st.just(kind), *HEADS, ARGUMENTS[kind])
)
"""Requests of the right form: what they ask for may be forbidden."""

JUNK = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.floats() | TEXTS | st.binary(max_size=9),
    lambda inner: st.lists(inner, max_size=7) | st.dictionaries(TEXTS, inner, max_size=2),
    max_leaves=9,
)
BREACHES = (
    REQUESTS.map(tuple).map(packed)
    | st.builds(lambda request, at, value: spoilt(request, at, value), REQUESTS, st.integers(0, 5), JUNK)
    | st.binary(max_size=30)
    | JUNK.map(lambda value: framed(msgpack.packb(value, unicode_errors="surrogatepass")))
)
"""Bytes that a program might send."""


def framed(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def spoilt(request: Request, at: int, value: object) -> bytes:
    """Return a request with something else in place of one field."""
    fields = list(request)
    fields[at] = value
    return framed(msgpack.packb(fields, unicode_errors="surrogatepass"))


class Elsewhere(SocketParticipant):
    """A program that sends what a test says."""

    def __init__(self, programs: Programs, robot: int) -> None:
        here, self.there = socket.socketpair()
        super().__init__(f"program {robot}", here, robot, programs._scheduler, programs._names, programs._selector)
        self.is_waited_for = False
        self.answers: list[Answer] = []
        programs._scheduler.join(self)

    def reply(self, answer: Answer) -> None:
        packed(tuple(answer))
        self.answers.append(answer)

    def close(self) -> None:
        super().close()
        self.there.close()

    def send(self, *requests: Request) -> None:
        self.take(b"".join(packed(tuple(request)) for request in requests))


@given(st.lists(REQUESTS, max_size=6), st.lists(st.integers(0, 800), max_size=6))
def test_requests_do_not_depend_on_how_their_bytes_are_cut(requests: list[Request], cuts: list[int]) -> None:
    stream = b"".join(packed(tuple(request)) for request in requests)
    places = sorted(min(cut, len(stream)) for cut in cuts)
    inbox, taken = Inbox(REQUEST_BYTES_MAX), []
    for begin, end in zip([0, *places], [*places, len(stream)], strict=True):
        taken += [checked_request(fields) for fields in inbox.take(stream[begin:end])]
    assert taken == requests


@given(JUNK | REQUESTS.map(tuple), st.integers(0, 5), JUNK)
def test_what_is_no_request_is_refused_and_nothing_else_happens(fields: object, at: int, value: object) -> None:
    if isinstance(fields, tuple):
        fields = tuple(value if index == at else field for index, field in enumerate(fields))
    with suppress(MessageError):
        request = checked_request(fields)
        assert max(request.at_ns, request.thought_ns) <= CLOCK_END_NS
        packed(tuple(request))


def test_length_and_form_of_a_message_are_checked_before_it_takes_memory() -> None:
    for data in (
        b"\xff\xff\xff\xff",
        struct.pack("<I", REQUEST_BYTES_MAX + 1),
        framed(b"\xdd\xff\xff\xff\xff"),
        framed(b"\xc6\xff\xff\xff\xff"),
        framed(b"\x91" * 60_000),
        framed(b"\xdc\x04\x00" * 20_000),
        framed(b"\x81\x01\x01"),
        framed(b"\xc7\x08\xff" + bytes(8)),
        framed(b""),
        framed(b"\x01\x02"),
        framed(b"\xc1"),
    ):
        with pytest.raises(MessageError, match=r"^sent "):
            Inbox(REQUEST_BYTES_MAX).take(data)


@contextmanager
def two_in_a_match() -> Iterator[tuple[Programs, Elsewhere, Elsewhere]]:
    """Yield a world of two robots with a program for each, which must not take the other's."""
    with ExitStack() as stack:
        programs = stack.enter_context(closing(Programs(fresh(2), are_apart=True)))
        one, two = (stack.enter_context(closing(Elsewhere(programs, robot))) for robot in (1, 2))
        yield programs, one, two


def run_until_answered(programs: Programs, program: Elsewhere, count: int) -> None:
    for _ in range(1000):
        if len(program.answers) == count:
            return
        programs.round(0)


@given(st.lists(BREACHES, max_size=12))
def test_whatever_a_program_sends_the_world_goes_on_and_its_neighbour_is_not_touched(pieces: list[bytes]) -> None:
    with two_in_a_match() as (programs, hostile, neighbour):
        for piece in pieces:
            hostile.take(piece)
            programs.round(0)
        hostile.disconnect()
        neighbour.send(
            Request(Verb.CLAIM, 2, 0, 1, 0, ("me",)),
            Request(Verb.SEND, 2, 0, 0, 0, (b"D,3,4\n",)),
            Request(Verb.READ, 2, 0, 2, 0, (None, b"\n", None, 0)),
        )
        run_until_answered(programs, neighbour, 2)
        assert [answer.result for answer in neighbour.answers[1:]] == [(b"d\r\n", neighbour.answers[1].now_ns)]


CLAIM = Request(Verb.CLAIM, 1, 0, 1, 0, ("me",))
BREAKS = {
    "used the line of robot 2 without having opened it": [Request(Verb.SEND, 2, 0, 0, 0, (b"D,3,4\n",))],
    "used the line of robot 9 without having opened it": [Request(Verb.READ, 9, 0, 0, 0, (1, None, 0, 0))],
    "used the line of robot 8 without having opened it": [Request(Verb.WAIT, 0, 0, 1, 0, (((8, 1, None),), NEVER_NS))],
    "asked for robot 9, which there is not": [Request(Verb.CLAIM, 9, 0, 1, 0, ("me",))],
    "sent more characters than its line takes": [
        CLAIM,
        *[Request(Verb.SEND, 1, 0, 0, 0, (b"\n" * BACKLOG_LIMIT,))] * (BURST_MAX // BACKLOG_LIMIT + 1),
    ],
    f"sent more than {QUEUE_MAX} requests without waiting for an answer": [
        CLAIM,
        Request(Verb.READ, 1, 0, 2, 0, (1, None, None, 0)),
        *[Request(Verb.MEET, 0, 0, 3)] * (QUEUE_MAX + 1),
    ],
}


@pytest.mark.parametrize(("reason", "requests"), BREAKS.items(), ids=BREAKS)
def test_program_that_breaks_a_rule_is_ended_and_its_reason_says_which(reason: str, requests: list[Request]) -> None:
    with two_in_a_match() as (programs, hostile, _):
        hostile.send(*requests)
        programs.round(0)
        assert (hostile.reason, hostile.has_left, hostile.has_hung_up) == (reason, True, True)


@pytest.mark.parametrize(("is_stopped", "reason"), [(False, ""), (True, ""), (False, "it has broken a rule")])
def test_end_of_a_program_stops_no_robot_that_another_one_has_taken_over(is_stopped: bool, reason: str) -> None:
    with two_in_a_match() as (programs, first, second):
        first.send(CLAIM, Request(Verb.HANG_UP, 1, 0))
        programs.round(0)
        first.send(Request(Verb.REACHED, 0, 10**9))  # so that the world goes on without it
        first.is_stopped, first.reason = is_stopped, reason
        reading = Request(Verb.READ, 1, 0, 2, 0, (None, b"\n", None, 0))
        second.send(CLAIM, Request(Verb.SEND, 1, 0, 0, 0, (b"D,3,4\n",)), reading)
        run_until_answered(programs, second, 2)
        first.disconnect()
        second.send(Request(Verb.SEND, 1, 0, 0, 0, (b"B\n",)), reading)
        run_until_answered(programs, second, 3)
        assert [answer.result[0][:1] for answer in second.answers[1:]] == [b"d", b"b"]
        assert wheels(programs.sim) == [3, 4]


def test_in_a_match_no_program_takes_the_robot_of_another_one() -> None:
    with two_in_a_match() as (programs, hostile, _):
        programs._names.own(1)
        programs._names.own(2)
        asked = [
            Request(Verb.FIND, 0, 0, 1, 0, ("kiks://2",)),
            Request(Verb.CLAIM, 2, 0, 2, 0, ("me",)),
            Request(Verb.FIND, 0, 0, 3, 0, ("kiks://1",)),
        ]
        hostile.send(*asked)
        programs.round(0)
        assert ["a program must drive its own robot" in answer.error for answer in hostile.answers] == [1, 1, 0]
        assert (hostile.answers[-1].result, hostile.reason) == (1, "")
