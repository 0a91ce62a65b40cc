"""Programs for e-pucks on real ports in lockstep: a request is one turn, however it comes."""

import pytest
from tests.ports.test_lockstep import clients

import kiks

CALIBRATION = b"k, Starting calibration - Remove any object in sensors range\r\nk, Calibration finished\r\n"


@pytest.mark.slow
def test_pieces_of_requests_make_no_difference() -> None:
    ends = set()
    for size in (1, 2, 100):
        sim = kiks.Simulation(kiks.Arena.box(500, 300), robot=["epuck", "epuck"], seed=7)
        with clients(sim=sim, thinking="fixed:2") as (run, programs):
            for request, reply in (
                (b"E\n", b"e,0,0\r\n"),
                # Without its 0, which the next one has.
                (b"\xbc\x64\0\x9c\xff\xb4\0\x01", b""),
                (b"\x99\xbb\0", bytes(6) + b"\x64\0\x9c\xff"),
                (b"\xbc\x65\0\x9c\xff\0", b""),
                (b"\xbb\0", b"\x65\0\x9c\xff"),
                (b"C\r\n", b"c,3\r\n"),
                (b"K\r", CALIBRATION),
                (b"\n\nE\n", b"e,101,-100\r\n"),
            ):
                for program in programs:
                    for begin in range(0, len(request), size):
                        program.send(request[begin : begin + size])
                        run.wait_rounds(1)
                for program in programs:
                    assert program.lines.read(len(reply)) == reply
            for robot, program in enumerate(programs, 1):
                program.hang_up()
                run.wait_free(robot)
            ends.add((run.sim.now_ns, run.sim.state_hash()))
    assert len(ends) == 1
