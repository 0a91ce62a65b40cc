"""When replies arrive: 11 bits a character and 1 ms for each command (khepera-protocol.md 2.2), to the nanosecond."""

from fractions import Fraction

import pytest

from kiks.model.arena import Arena
from kiks.sim.simulation import SimPort, Simulation
from kiks.units import character_ns

PROCESSING_NS = 1_000_000

pytestmark = pytest.mark.parametrize("baud", [9600, 38400, 115200])


def port_at(baud: int) -> SimPort:
    port = Simulation(Arena.box(500, 500)).port(1)
    port.baudrate = baud
    port.timeout = 1.0
    return port


def test_a_single_command_whole_or_in_pieces(baud: int) -> None:
    port = port_at(baud)
    for command in (b"D,0,0\n", b"N\n", b"H\r", b"B\n", b"M\n", b"T,1,B\n", b"D,5\n"):
        begin_ns = port.sim.now_ns
        port.write(command)
        count = len(command) + len(port.readline())
        passed_ns = port.sim.now_ns - begin_ns
        assert passed_ns == count * character_ns(baud) + PROCESSING_NS
        # The formula; rounding may take a part of a nanosecond from each character.
        formula_ns = Fraction(11 * count * 10**9, baud) + PROCESSING_NS
        assert formula_ns - count <= passed_ns <= formula_ns
    port = port_at(baud)
    port.write(b"H")
    port.sleep(1.0)
    port.write(b"\n")
    port.readline()
    assert port.sim.now_ns == 1_000_000_000 + (1 + 7) * character_ns(baud) + PROCESSING_NS


def test_pipelined_commands(baud: int) -> None:
    commands, character = (b"N", b"O", b"H", b"E", b"K", b"T,1,G", b"T,1,F"), character_ns(baud)
    for end in (b"\n", b"\r", b"\r\n", b"\r\n\r\n"):
        port = port_at(baud)
        port.write(b"".join(command + end for command in commands))
        sent_count = acted_ns = answered_ns = 0
        for command in commands:
            # The terminator is the first character of the line end; what is left of it comes before the next command.
            arrived_ns = (sent_count + len(command) + 1) * character
            sent_count += len(command) + len(end)
            acted_ns = max(arrived_ns, acted_ns) + PROCESSING_NS
            answered_ns = max(acted_ns, answered_ns) + len(port.readline()) * character
            assert port.sim.now_ns == answered_ns, command
