"""What goes over a robot's line, and where the time went."""

import itertools
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.served import GUARD_S, PROGRAMS, fresh

from kiks.ports.program_command import ProgramCommand
from kiks.ports.programs import Programs
from kiks.script.runner import run_here
from kiks.sim.ring_buffer import RingBuffer
from kiks.sim.simulation import Simulation
from kiks.sim.wire_log import PIECE_LIMIT, Span, TimeShares, WireLog, WirePiece, share_time
from kiks.units import character_ns

MS = 1_000_000
CHARACTER_NS = character_ns(9600)
PROCESSING_NS = round(fresh().spec.firmware.processing_ms * MS)


def pieces(log: WireLog) -> list[WirePiece]:
    return log.pieces.since(0)[1]


def shares(sim: Simulation, from_ns: int = 0, robot: int = 1) -> TimeShares:
    return sim.wires[robot - 1].shares(from_ns, sim.now_ns)


def test_exchange_has_the_times_of_its_characters() -> None:
    sim = fresh()
    sim.run(1)
    log, port = sim.wires[0].watch(sim.now_ns), sim.port(1)
    begin_ns = sim.now_ns
    port.write(b"D,5,5\n")
    assert port.readline() == b"d\r\n"
    acted_ns = begin_ns + 6 * CHARACTER_NS + PROCESSING_NS
    assert pieces(log) == [
        WirePiece(True, b"D,5,5\n", begin_ns, begin_ns + 6 * CHARACTER_NS, acted_ns),
        WirePiece(False, b"d\r\n", acted_ns, acted_ns + 3 * CHARACTER_NS, acted_ns),
    ]
    assert sim.now_ns == pieces(log)[-1].last_ns
    assert sim.wires[0].watch(sim.now_ns) is log


def test_characters_are_cut_into_commands() -> None:
    for data, cut in (
        (b"E\nH\n", [b"E\n", b"H\n"]),
        (b"E\r\nH\r\n", [b"E\r\n", b"H\r\n"]),
        (b"E\nD,5", [b"E\n", b"D,5"]),
        (b"D,5", [b"D,5"]),
    ):
        sim = fresh()
        log = sim.wires[0].watch(sim.now_ns)
        sim.port(1).write(data)
        sent = pieces(log)
        assert [piece.data for piece in sent] == cut
        assert [piece.acted_ns is None for piece in sent] == [not each.endswith(b"\n") for each in cut]
        assert all(piece.last_ns - piece.first_ns == len(piece.data) * CHARACTER_NS for piece in sent)
        assert all(before.last_ns == after.first_ns for before, after in itertools.pairwise(sent))


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 3)), max_size=30), st.integers(1, 7))
def test_tail_keeps_the_newest(comings: list[tuple[int, int]], limit: int) -> None:
    tail: RingBuffer[int] = RingBuffer(limit)
    everything: list[int | None] = []
    for count, skipped in comings:
        skipped = skipped if count else 0
        new = list(range(len(everything) + skipped, len(everything) + skipped + count))
        tail.add(new, skipped=skipped)
        everything += [None] * skipped + new
    for number in range(len(everything) + 1):
        first, kept = tail.since(number)
        assert kept == everything[first:]
        assert first == number or len(kept) <= limit
    assert tail.count == len(everything)
    assert len(tail.since(0)[1]) <= limit


def test_log_stays_small_and_knows_since_when_it_is_whole() -> None:
    sim = fresh()
    log, port = sim.wires[0].watch(sim.now_ns), sim.port(1)
    for _ in range(PIECE_LIMIT):
        port.write(b"H\n")
        port.readline()
    assert len(pieces(log)) == PIECE_LIMIT
    assert 0 < log.since_ns == pieces(log)[0].first_ns
    assert shares(sim).window_ns == sim.now_ns - log.since_ns


def test_an_unwatched_wire_keeps_no_log() -> None:
    wire = fresh().wires[0]
    log = wire.watch(0)
    assert wire.watch(0) is log
    for kept in (log, None):
        wire.unwatch()
        assert wire.log is kept
    assert wire.shares(0, 1) is None


def test_who_watches_changes_nothing() -> None:
    ends = []
    for is_watched in (False, True):
        sim = fresh(thinking="fixed:2.5")
        if is_watched:
            sim.wires[0].watch(sim.now_ns)
        assert run_here(sim, PROGRAMS / "drive.py", ["COM1", "40", "3", "7"], {}) == 0
        ends.append((sim.state_hash(), sim.now_ns))
    assert ends[0] == ends[1]


SPANS = st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), max_size=8)


@given(st.tuples(st.integers(0, 40), st.integers(0, 40)), st.tuples(SPANS, SPANS, SPANS))
def test_shares_give_each_instant_to_the_first_who_claims_it(window: Span, claimed: tuple[list[Span], ...]) -> None:
    counts = [0, 0, 0, 0]
    for instant in range(*window):
        claims = (any(begin <= instant < end for begin, end in spans) for spans in claimed)
        counts[[*claims, True].index(True)] += 1
    found = share_time(window, **dict(zip(("link", "robot", "thinking"), claimed, strict=True)))
    assert (found, found.window_ns) == (TimeShares(*counts), max(window[1] - window[0], 0))


PROGRAM = """
import serial, time
port = serial.Serial('COM1', timeout=1)
for _ in range(10):
    port.write(b'N\\n')
    port.readline()
    time.sleep(0.05)
port.timeout = 0.01
port.read(1)
"""


@pytest.mark.slow
@pytest.mark.parametrize("is_near", [True, False], ids=["in memory", "in a process of its own"])
def test_shares_of_a_program_add_up(is_near: bool, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    sim = fresh(thinking="fixed:2.5" if is_near else "none")
    log = sim.wires[0].watch(sim.now_ns)
    if is_near:
        assert run_here(sim, program, [], {}) == 0
    else:
        assert Programs(sim, [ProgramCommand(program)], thinking="fixed:2.5", patience_s=GUARD_S).run() == 0
    found = shares(sim)
    assert found.window_ns == sim.now_ns
    assert found.link_ns == sum(len(piece.data) for piece in pieces(log)) * CHARACTER_NS
    assert (found.robot_ns, found.thinking_ns) == (10 * PROCESSING_NS, 10 * round(2.5 * MS))
    assert found.waiting_ns == 10 * 50 * MS + 10 * MS


def test_gaps_of_a_real_program_are_thinking() -> None:
    sim = fresh()
    wire = sim.wires[0]
    wire.watch(0)
    sim.run(1)
    wire.enter_client("the client of somewhere", sim.now_ns)
    wire.send(b"H\n", sim.now_ns)
    sim.run(1)
    busy_ns = (2 + len(b"h,0,0\r\n")) * CHARACTER_NS + PROCESSING_NS
    assert shares(sim).thinking_ns == 1000 * MS - busy_ns
    wire.leave_client(sim.now_ns)
    sim.run(1)
    assert (shares(sim).thinking_ns, shares(sim).waiting_ns) == (1000 * MS - busy_ns, 2000 * MS)
    assert shares(sim, sim.now_ns - MS) == TimeShares(0, 0, 0, MS)
