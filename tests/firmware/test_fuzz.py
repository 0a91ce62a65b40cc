"""Whatever is sent, in whatever pieces: every reply is one that the protocol allows, one for each line not empty."""

import re
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.reply_grammar import LETTERS, ORDERS, allowed, at_most, first_violation
from tests.session_player import TURRETS

from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation

NUMBERS = st.one_of(
    st.integers(-200, 200).map(str),
    st.integers(-(2**70), 2**70).map(str),
    st.sampled_from(["", "-0", "+5", "007", "--5", "5.0", " 7", "7\t", "1e3", "9" * 200, "0x1", "²"]),
)
COMMANDS = st.builds(
    lambda letter, numbers: ",".join([letter, *numbers]).encode("latin-1"),
    st.sampled_from([*(letter.decode() for letter in LETTERS), "M", "a", "T,1,B", "T,7,B"]),
    st.lists(NUMBERS, max_size=6),
)
MESSAGES = st.builds(
    lambda order, numbers: ",".join([order, *numbers]).encode("latin-1"),
    st.sampled_from([f"T,{turret},{letter.decode()}" for turret, orders in ORDERS.items() for letter in orders]),
    st.one_of(st.just([]), st.lists(NUMBERS, max_size=2), st.lists(NUMBERS, min_size=18, max_size=18)),
)
TOOLS = st.sampled_from(
    [
        *(b"help", b"help D", b" help\tx", b"list", b"net", b"process", b"memory", b"k-team", b"serial 19200"),
        *(b"serial x", b"restart", b"run demo", b"run", b"run sloader", b"sfill", b"flash E", b"flash x"),
        *(b" ", b"listen", b"list,1"),
    ]
)


@st.composite
def mutated(draw: st.DrawFn) -> bytes:
    """Return a command or tool with a few characters put in, left out or doubled."""
    line = draw(st.one_of(COMMANDS, TOOLS))
    for _ in range(draw(st.integers(1, 3))):
        begin = draw(st.integers(0, len(line)))
        end = draw(st.integers(begin, min(begin + 2, len(line))))
        line = line[:begin] + draw(st.binary(max_size=2)) + line[end:]
    return line * draw(st.sampled_from([1, 1, 1, 1, 100]))


LINES = st.one_of(COMMANDS, COMMANDS, MESSAGES, TOOLS, mutated(), st.binary(max_size=300))
ENDS = st.sampled_from([b"\n", b"\r", b"\r\n", b"\n\n"])


def answers(kind: str, data: bytes, cuts: list[int]) -> bytes:
    """Return what a fresh robot answers to some characters that come in pieces."""
    sim = Simulation(Arena.box(300, 300), robot=kind)
    for turret in TURRETS:
        sim.fit(1, turret)
    port = sim.port(1)
    places = sorted({cut % (len(data) + 1) for cut in cuts} | {0, len(data)})
    for begin, end in pairwise(places):
        port.write(data[begin:end])
    # One character takes 1.15 ms: longer than this there cannot be silence while something is still to come.
    port.timeout = 10.0
    output = bytearray()
    while part := port.read(4096):
        output += part
    return bytes(output)


@pytest.mark.slow
@settings(max_examples=share(40, 150))
@given(
    kind=st.sampled_from(["khepera", "khepera_ii"]),
    pairs=st.lists(st.tuples(LINES, ENDS), min_size=1, max_size=12),
    cuts=st.lists(st.integers(0, 2000), max_size=20),
)
def test_every_reply_is_allowed(kind: str, pairs: list[tuple[bytes, bytes]], cuts: list[int]) -> None:
    data = b"".join(line + end for line, end in pairs)
    output = answers(kind, data, cuts)
    assert first_violation(re.split(rb"[\r\n]", data), output, has_flash=kind == "khepera_ii") is None


@pytest.mark.slow
@settings(max_examples=share(10, 20))
@given(st.lists(st.tuples(st.one_of(COMMANDS, MESSAGES), ENDS), min_size=1, max_size=8), st.lists(st.integers(0, 200)))
def test_pieces_make_no_difference(pairs: list[tuple[bytes, bytes]], cuts: list[int]) -> None:
    data = b"".join(line + end for line, end in pairs)
    assert answers("khepera_ii", data, cuts) == answers("khepera_ii", data, [])


def test_the_oracle_notices_and_counts() -> None:
    for limit in (1, 6, 9, 10, 63, 255, 999, 1000, 1023, 1203):
        pattern = re.compile(at_most(limit))
        assert [n for n in range(2000) if pattern.fullmatch(str(n).encode())] == list(range(limit + 1))
        assert not pattern.fullmatch(b"01")
    for line, reply in (
        (b"N", b"n,0,0,0,0,0,0,0\r\n"),
        (b"N", b"n,0,0,0,0,0,0,0,1024\r\n"),
        (b"N", b"n,0,0,0,0,0,0,0,00\r\n"),
        (b"N", b"n,0,0,0,0,0,0,0,0\n"),
        (b"H", b"h,2147483648,0\r\n"),
        (b"H", b"h,-0,0\r\n"),
        (b"H", b"h, 0,0\r\n"),
        (b"D,5,5", b"z,Protocol error\r\n"),
        (b"D,5", b"d\r\n"),
        (b"D,5,5", b"d,\r\n"),
        (b"L,2,0", b"l\r\n"),
        (b"L,-0,+01", b"z,Protocol error\r\n"),
        (b"T,1,D", b"t,1,d\r\n"),
        (b"T,1,D,0", b"t,d\r\n"),
        (b"T,9,D,0", b"z,Protocol error\r\n"),
        (b"M", b"z,Protocol error\r\n"),
        (b"help\x1cN", b"N: proximity sensors\r\n"),
        (b"flash E", b"Flash erased\r\n"),
    ):
        assert not allowed(line, has_flash=False).fullmatch(reply), (line, reply)
    assert first_violation([b"D,1,1", b"", b"D,2,2"], b"d\r\nd\r\n", has_flash=True) is None
    assert "nothing more" in str(first_violation([b"D,1,1"], b"d\r\nd\r\n", has_flash=True))
    assert "must be answered" in str(first_violation([b"D,1,1", b"D,1,1"], b"d\r\n", has_flash=True))
