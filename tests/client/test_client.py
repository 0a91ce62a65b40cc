"""kiks.Khepera and the functions of the Matlab KiKS."""

from __future__ import annotations

import fcntl
import math
import os
import resource
import socket

import pytest

import kiks
from kiks.client.khepera import Status
from kiks.client.port import _is_readable


@pytest.fixture
def sim() -> kiks.Simulation:
    return kiks.Simulation(kiks.Arena.box(2000, 2000), seed=2)


def test_every_method(sim: kiks.Simulation) -> None:
    with kiks.Khepera(sim.port(1)) as robot:
        robot.set_speed(4.6, -4.4)
        robot.pause(0.5)
        assert [abs(speed) for speed in robot.speed()] == pytest.approx([5, 4], abs=1)
        assert robot.status()[0] in [Status(False, 0, error) for error in (-1, 0, 1, 2)]
        robot.stop()
        robot.pause(0.5)
        robot.set_encoders(100, -100)
        assert robot.encoders() == (100, -100)
        robot.set_profile(10, 32)
        robot.move_to(600, 400, wait=True)
        assert robot.encoders() == pytest.approx((600, 400), abs=8)
        robot.set_profile()
        robot.set_speed_gains()
        robot.set_position_gains()
        robot.set_pwm(40, 40)
        assert robot.status()[1].mode == 2
        robot.led(0, 2)
        assert len(robot.proximity()) == len(robot.ambient()) == 8
        assert all(430 < light < 470 for light in robot.ambient())
        assert robot.analog(3) == 0
        assert 100 < robot.analog(6) < 400
        assert robot.version() == ("5.02", "5.01")
        robot.write_bus(170, 32)
        assert robot.read_bus(5) == 0
        assert robot.send("M") == "Command not found"
        assert robot.time_s == pytest.approx(sim.time_s)


def test_move_to_fails_if_the_wheels_do_not_arrive() -> None:
    sim = kiks.Simulation(kiks.Arena.box(300, 300), seed=1)
    with kiks.Khepera(sim.port(1)) as robot:
        robot.set_profile(1, 1)
        with pytest.raises(kiks.LinkError, match="both wheels must arrive within 600 s, but one has not"):
            robot.move_to(1_000_000, -1_000_000, wait=True, poll_s=1.0)
        assert 600 < sim.time_s < 602


def test_error_shows_an_unexpected_reply(sim: kiks.Simulation) -> None:
    robot = kiks.Khepera(sim.port(1))
    sim.port(1).write(b"H\n")
    with pytest.raises(kiks.LinkError, match=r"reply to b'D,1,1\\n' must be that of a Khepera, but it was b'h,0,0"):
        robot.set_speed(1, 1)
    with pytest.raises(kiks.LinkError, match="Is the turret fitted"):
        kiks.Khepera(kiks.Simulation().port(1)).turret(1, "B")
    with pytest.raises(kiks.ParameterError, match="text must be one line"):
        robot.send("N\nN")


def test_error_shows_an_incomplete_reply() -> None:
    class Dead:
        def write(self, data: bytes) -> int:
            return len(data)

        def read_until(self, expected: bytes = b"\n") -> bytes:
            return b"h,1"

        def close(self) -> None:
            pass

    with pytest.raises(kiks.LinkError, match=r"must come before the timeout, but only b'h,1' came. Check the cable"):
        kiks.Khepera(Dead()).encoders()


def test_error_names_a_port_that_cannot_be_opened() -> None:
    with pytest.raises(kiks.LinkError, match=r"'/dev/ttyNOWHERE' must be one that can be opened"):
        kiks.Khepera("/dev/ttyNOWHERE")


def test_functions_of_the_matlab_kiks(sim: kiks.Simulation) -> None:
    ref = kiks.kopen([-1, 19200, 1])
    assert tuple(ref) == (-1.0, -1.0, -1.0, -1.0)
    assert kiks.ksend("D,5,5\n", ref) == "d"
    assert kiks.ksend("D,5,5\r", ref) == "d"
    before_s = kiks.ktime(-1)
    kiks.pause(2.0)
    assert kiks.ktime(ref) == pytest.approx(before_s + 2.0, abs=1e-3)
    left, right = map(int, kiks.ksend("H\n", ref).split(",")[1:])
    assert left == right == pytest.approx(1000, abs=30)
    assert kiks.ksend("", ref) == ""
    with pytest.raises(kiks.LinkError, match=r"port -1 must be closed before it is opened.*kclose"):
        kiks.kopen([-1, 9600, 1])
    kiks.kclose(ref)
    kiks.kclose(ref)
    assert kiks.ktime(-1) is None
    with pytest.raises(kiks.LinkError, match="ref must be what kopen returned"):
        kiks.ksend("N\n", ref)
    with pytest.raises(kiks.ParameterError, match=r"settings must be \[port, baud, timeout\]"):
        kiks.kopen([])
    # The counters survive; `[]` closes every simulated port.
    again = kiks.kopen([-1])
    assert int(kiks.ksend("H\n", again).split(",")[1]) > 900
    kiks.kclose([])
    assert kiks.ktime(-1) is None
    assert sim.time_s > 2


def test_polling_the_time_lets_it_pass(sim: kiks.Simulation) -> None:
    ref = kiks.kopen([-1, 9600, 1])
    while kiks.ktime(-1) < 3.0:
        pass
    kiks.kclose(ref)
    assert 3.0 <= sim.time_s < 3.2


@pytest.mark.parametrize("robots", [-1, 1001, 1.5, "2"])
def test_number_of_robots_is_checked(robots: object) -> None:
    with pytest.raises(kiks.ParameterError, match="robots must be a whole number from 0 to 1000, but it was"):
        kiks.Simulation(robots=robots)  # type: ignore[arg-type]


def test_place_checks_its_arguments(sim: kiks.Simulation) -> None:
    sim.place(1, 500.0, 400.0, math.pi / 3)
    assert sim.pose(1) == (500.0, 400.0, math.pi / 3)
    with pytest.raises(kiks.ParameterError, match=r"at \(20, 500\) mm a wall is 17.5 mm inside it"):
        sim.place(1, 20, 500, 0)
    with pytest.raises(kiks.ParameterError, match="must be free"):
        sim.place(1, -500, 500, 0)
    with pytest.raises(kiks.ParameterError, match="x_mm must be a finite number"):
        sim.place(1, math.nan, 500, 0)
    with pytest.raises(kiks.ParameterError, match="This simulation has robot 1"):
        sim.pose(2)
    with pytest.raises(kiks.ParameterError, match="Time never runs backwards"):
        sim.run(-1)


def test_arena_must_be_an_arena() -> None:
    with pytest.raises(kiks.ParameterError, match=r"arena must be a kiks.Arena, but it was 'maze.png'. Read a file"):
        kiks.Simulation("maze.png")  # type: ignore[arg-type]


@pytest.mark.parametrize("least", [0, 1024], ids=["small", "large"])
def test_read_waits_on_descriptors_beyond_the_limit_of_select(least: int) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= hard < 1100:
        pytest.skip("this computer gives no descriptor beyond 1024")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 1100), hard))
    here, there = socket.socketpair()
    with here, there:
        descriptor = fcntl.fcntl(here, fcntl.F_DUPFD, least)
        try:
            assert not _is_readable(descriptor, 0.0)
            there.send(b"x")
            assert _is_readable(descriptor, None)
        finally:
            os.close(descriptor)
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
