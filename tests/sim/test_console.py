"""Commands that a person types."""

import pytest
import serial
from tests.served import fresh

from kiks.errors import LinkError, ParameterError
from kiks.sim.console import type_lines


def test_typed_command_acts_and_is_answered_when_time_has_got_there() -> None:
    sim = fresh()
    sim.run(1)
    (typed,) = type_lines(sim, 1, "D,10,15")
    assert (typed.robot, typed.text, typed.time_s, typed.reply, typed.reply_s) == (1, "D,10,15", 1.0, None, None)
    before = sim.pose(1)
    sim.run(0.5)
    assert typed.reply == "d"
    assert 1.0 < typed.reply_s < 1.1
    assert sim.pose(1) != before
    # A reply has arrived with its last character.
    sim, clock = fresh(), fresh()
    (typed,) = type_lines(sim, 1, "N")
    port = clock.port(1)
    port.write(b"N\n")
    reply = port.readline().decode().strip()
    for end_ns, heard in ((clock.now_ns - 1, None), (clock.now_ns, reply)):
        sim.advance_to(end_ns)
        assert typed.reply == heard


def test_several_lines_are_answered_in_their_order() -> None:
    sim = fresh()
    sent = type_lines(sim, 1, "G,7,8\n\n  H \nX\nD,5\n")
    sim.run(1)
    answered = [("G,7,8", "g"), ("H", "h,7,8"), ("X", "Command not found"), ("D,5", "z,Protocol error")]
    assert [(typed.text, typed.reply) for typed in sent] == answered


@pytest.mark.parametrize("is_asking", [True, False])
def test_what_is_typed_stands_between_the_commands_of_a_program(is_asking: bool) -> None:
    """The program gets its own replies alone, also if a person types while it waits for one."""
    sim = fresh()
    with serial.serial_for_url(sim.url(1), timeout=1) as port:
        port.write(b"D,5,5\nG,3")
        with pytest.raises(LinkError, match=r"between the commands of a program, but .* has sent 'G,3' and no line's"):
            type_lines(sim, 1, "D,0,0")
        port.write(b",4\n")
        assert is_asking or [port.readline() for _ in "DG"] == [b"d\r\n", b"g\r\n"]
        typed = type_lines(sim, 1, "D,0,0\nE")
        assert not is_asking or [port.readline() for _ in "DG"] == [b"d\r\n", b"g\r\n"]
        port.write(b"H\n")
        assert port.readline().startswith(b"h,")
    assert [(each.reply or "")[:2] for each in typed] == ["d", "e,"]


@pytest.mark.parametrize("waits", [True, False])
def test_programs_and_what_is_typed_hear_nothing_of_each_other(waits: bool) -> None:
    """A program gets no reply to what was typed before it came, and takes none with it that is on its way."""
    sim = fresh()
    (typed,) = type_lines(sim, 1, "B")
    with serial.serial_for_url(sim.url(1), timeout=1) as port:
        port.write(b"H\n")
        assert not waits or port.readline() == b"h,0,0\r\n"
    sim.run(0.1)
    assert (typed.reply or "").startswith("b,")
    with serial.serial_for_url(sim.url(1), timeout=1) as port:
        port.write(b"E\n")
        assert port.readline() == b"e,0,0\r\n"


def test_a_client_that_goes_takes_its_late_commands_and_replies_with_it_and_no_typed_command() -> None:
    sim = fresh()
    (wire,) = sim.wires
    wire.send(b"N\n", 0)
    sim.run(0.02)  # its reply is on the line
    wire.send(b"D,3,4\n" * 100, sim.now_ns)
    (typed,) = type_lines(sim, 1, "B")
    wire.drop_after(wire.pending[1][0], sim.now_ns)
    assert [line for _, line, _ in wire.pending] == [b"D,3,4", b"D,3,4", b"B"]
    assert wire.line.carry(1, sim.now_ns) == sim.now_ns, "the line is free for replies"
    sim.run(1)
    assert (typed.reply or "").startswith("b,")


@pytest.mark.parametrize("text", ["", " \n ", "D,5,5 ☺", "D" * 257, "D,5\t,5"])
def test_nonsense_is_refused_before_it_is_sent(text: str) -> None:
    sim = fresh()
    with pytest.raises(ParameterError, match=r"a command must"):
        type_lines(sim, 1, text)
    assert sim.next_event_ns() is None


def test_full_line_is_told() -> None:
    sim = fresh()
    for _ in range(2):
        type_lines(sim, 1, "\n".join(["D,1,1"] * 300))
    with pytest.raises(LinkError, match=r"must have room .* Let time pass first"):
        type_lines(sim, 1, "\n".join(["D,1,1"] * 100))
    sim.run(5)
    assert len(type_lines(sim, 1, "D,0,0")) == 1
    with pytest.raises(ParameterError, match=r"robot must be the number of an existing robot"):
        type_lines(sim, 2, "D,0,0")
