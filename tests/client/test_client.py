"""kiks.Khepera and the functions of the Matlab KiKS."""

import fcntl
import math
import os
import resource
import socket
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import serial

import kiks
from kiks.client.khepera import Status
from kiks.client.port import _is_readable
from kiks.script.runner import run_here


@pytest.fixture
def sim() -> kiks.Simulation:
    return kiks.Simulation(kiks.Arena.box(600, 600), seed=2)


class Silent:
    """A port of a robot that says no more than was put in."""

    def __init__(self, *replies: bytes) -> None:
        self.sent = b""
        self._replies = iter(replies)

    def write(self, data: bytes) -> int:
        self.sent += data
        return len(data)

    def read_until(self, expected: bytes = b"\n") -> bytes:
        return next(self._replies, b"")

    def close(self) -> None:
        pass


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
        robot.set_pwm(40, 40)
        assert robot.status()[1].mode == 2
        robot.led(0, 2)
        assert len(robot.proximity()) == len(robot.ambient()) == 8
        assert all(430 < light < 470 for light in robot.ambient())
        assert robot.analog(3) == 0
        assert 100 < robot.analog(6) < 400
        assert robot.version() == ("5.02", "5.01")
        robot.write_bus(170, 32)
        assert (robot.read_bus(5), robot.send("M")) == (0, "Command not found")
        assert robot.time_s == pytest.approx(sim.time_s)


@pytest.mark.parametrize("opened", [lambda sim: sim.port(1), lambda sim: sim.url(1), "serial", "real"])
def test_a_closed_robot_says_so(sim: kiks.Simulation, opened: Any) -> None:
    """However it was opened; a `Silent` one stands for a real robot's port, which would still take characters."""
    if opened == "serial":
        port: Any = serial.serial_for_url(sim.url(1), timeout=1)
    else:
        port = Silent(b"h,0,0\r\n") if opened == "real" else opened(sim)
    with kiks.Khepera(port) as robot:
        assert robot.encoders() == (0, 0)
    for use in (robot.encoders, robot.proximity, robot.stop, lambda: robot.send("B"), lambda: robot.turret(1, "B")):
        with pytest.raises(kiks.LinkError, match="must be open to be used, but this one is closed"):
            use()
    robot.close()


OUT_OF_RANGE: list[tuple[Callable[[kiks.Khepera], object], str]] = [
    (lambda robot: robot.set_speed(0, "5"), "right must be a finite number, but it was '5'"),
    (lambda robot: robot.set_speed(math.nan, 0), "left must be a finite number, but it was nan"),
    (lambda robot: robot.set_pwm(0, -500), "right must be from -255 to 255, but it was -500"),
    (lambda robot: robot.move_to(10**12, 0), "left must be from -8388606 to 8388606, but it was 1000000000000"),
    (lambda robot: robot.move_to(0, 0, wait=1), "wait must be True or False, but it was 1"),
    (lambda robot: robot.move_to(0, 0, poll_s=-1), "poll_s must be from 0 to"),
    (lambda robot: robot.set_encoders(2**31), "left must be from -2147483648 to 2147483647, but it was 2147483648"),
    (lambda robot: robot.set_profile(-1, 0), "speed must be from 1 to 127, but it was -1"),
    (lambda robot: robot.set_profile(20, 256), "acceleration must be from 1 to 255, but it was 256"),
    (lambda robot: robot.set_speed_gains(-1), "kp must be from 0 to 32767, but it was -1"),
    (lambda robot: robot.set_position_gains(1, 2, 40000), "kd must be from 0 to 32767, but it was 40000"),
    (lambda robot: robot.analog(9), "channel must be a whole number from 0 to 6, but it was 9"),
    (lambda robot: robot.led(5, 1), "led must be a whole number from 0 to 1, but it was 5"),
    (lambda robot: robot.led(1, 0.5), "action must be a whole number from 0 to 2, but it was 0.5"),
    (lambda robot: robot.read_bus(64), "address must be a whole number from 0 to 63, but it was 64"),
    (lambda robot: robot.write_bus(256, 0), "data must be a whole number from 0 to 255, but it was 256"),
    (lambda robot: robot.turret(100, "N"), "number must be a whole number from 0 to 99, but it was 100"),
    (lambda robot: robot.turret(1, ""), "order must be a letter and numbers such as 'N' or 'D,1', but it was ''"),
    (lambda robot: robot.turret(1, "N\nN"), "order must be a letter and numbers"),
    (lambda robot: robot.pause(-1), "seconds must be from 0 to"),
    (lambda robot: robot.read_numbers(b"N\n", -1), "count must be a whole number from 0"),
]


def test_an_argument_is_blamed_by_its_name_before_anything_is_sent() -> None:
    port = Silent()
    for call, words in OUT_OF_RANGE:
        with pytest.raises(kiks.ParameterError, match=words):
            call(kiks.Khepera(port))
    assert port.sent == b""


def test_quantities_are_rounded_and_speeds_are_cut() -> None:
    port = Silent(b"d\r\n", b"c\r\n", b"g\r\n", b"p\r\n")
    robot = kiks.Khepera(port)
    robot.set_speed(127.9, -1e12)
    robot.move_to(1.9, np.float32(-2.6))
    robot.set_encoders(0.6, np.int16(7))
    robot.set_pwm(12.4, -254.7)
    assert port.sent == b"D,127,-127\nC,2,-3\nG,1,7\nP,12,-255\n"


def test_settings_that_are_left_out_are_those_of_a_robot_at_its_start(sim: kiks.Simulation) -> None:
    robot = kiks.Khepera(sim.port(1))

    def settings() -> list[list[int]]:
        state: Any = sim.world.state.robots[0, 0]
        names = "profile_speed", "profile_acceleration", "speed_gains", "position_gains"
        return [*(state[name].tolist() for name in names), list(robot.encoders())]

    at_start = settings()
    robot.set_profile(1, 2)
    robot.set_speed_gains(1, 2, 3)
    robot.set_position_gains(4, 5, 6)
    robot.set_encoders(7, 8)
    assert settings() == [[1, 1], [2, 2], [1, 2, 3], [4, 5, 6], [7, 8]]
    for set_again in (robot.set_profile, robot.set_speed_gains, robot.set_position_gains, robot.set_encoders):
        set_again()
    assert settings() == at_start


def test_the_robot_takes_the_largest_arguments_as_they_are(sim: kiks.Simulation) -> None:
    """The client's ranges are those of the firmware: nothing within them is cut or refused."""
    robot = kiks.Khepera(sim.port(1))
    state: Any = sim.world.state.robots[0, 0]
    robot.set_pwm(-255, 255)
    assert state["pwm_setpoint"].tolist() == [-255, 255]
    robot.set_speed(-127, 127)
    assert state["speed_setpoint"].tolist() == [-127, 127]
    robot.set_profile(127, 255)
    assert (state["profile_speed"].tolist(), state["profile_acceleration"].tolist()) == ([127, 127], [255, 255])
    robot.set_speed_gains(32767, 0, 32767)
    assert state["speed_gains"].tolist() == [32767, 0, 32767]
    robot.move_to(-8388606, 8388606)
    assert state["target_pulses"].tolist() == [-8388606, 8388606]
    robot.set_pwm(0, 0)
    robot.pause(1.0)
    robot.set_encoders(-(2**31), 2**31 - 1)
    assert robot.encoders() == (-(2**31), 2**31 - 1)
    assert (robot.analog(6), robot.read_bus(63)) == (100, 0)
    robot.led(1, 2)
    robot.write_bus(255, 63)
    assert sim.world.state.robots["bus"][0, 0, 63] == 255


def test_move_to_fails_if_the_wheels_do_not_arrive() -> None:
    sim = kiks.Simulation(kiks.Arena.box(300, 300), seed=1)
    with kiks.Khepera(sim.port(1)) as robot:
        robot.set_profile(1, 1)
        with pytest.raises(kiks.LinkError, match="both wheels must arrive within 600 s, but one has not"):
            robot.move_to(1_000_000, -1_000_000, wait=True, poll_s=1.0)
        assert 600 < sim.time_s < 602


def test_error_shows_what_a_robot_or_a_port_does_wrong(sim: kiks.Simulation) -> None:
    robot = kiks.Khepera(sim.port(1))
    sim.port(1).write(b"H\n")
    with pytest.raises(
        kiks.LinkError, match=r"reply to b'D,1,1\\n' must be that of this kind of robot, but it was b'h"
    ):
        robot.set_speed(1, 1)
    with pytest.raises(kiks.LinkError, match="Is the turret fitted"):
        kiks.Khepera(kiks.Simulation().port(1)).turret(1, "B")
    with pytest.raises(kiks.ParameterError, match="text must be one line"):
        robot.send("N\nN")
    with pytest.raises(kiks.LinkError, match=r"must come before the timeout, but only b'h,1' came. Check the cable"):
        kiks.Khepera(Silent(b"h,1")).encoders()
    with pytest.raises(kiks.LinkError, match=r"'/dev/ttyNOWHERE' must be one that can be opened"):
        kiks.Khepera("/dev/ttyNOWHERE")


def test_functions_of_the_matlab_kiks(sim: kiks.Simulation) -> None:
    ref = kiks.kopen([-1, 19200, 1])
    assert tuple(ref) == (-1.0, -1.0, -1.0, -1.0)
    assert (kiks.ksend("D,5,5\n", ref), kiks.ksend("D,5,5\r", ref)) == ("d", "d")
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


def test_functions_of_the_matlab_kiks_reach_real_ports_under_kiks_run(sim, tmp_path, capsys):
    program = tmp_path / "program.py"
    program.write_text("import kiks\nref = kiks.kopen([0])\nprint(kiks.ksend('H\\n', ref, 2))\nkiks.kclose(ref)\n")
    assert run_here(sim, program, [], {}) == 0
    assert capsys.readouterr().out == "h,0,0\n"


def test_a_port_whose_settings_are_refused_stays_free(sim: kiks.Simulation) -> None:
    for settings, words in (
        ([-1, -5, 1], "baud must be a whole number from 75 to 4000000, but it was -5"),
        ([-1, 9600.7, 1], r"settings must be \[port, baud, timeout\], the first two whole numbers"),
        ([-1, 9600, -1], "timeout must be a finite number of at least 0, but it was -1"),
    ):
        with pytest.raises(kiks.ParameterError, match=words):
            kiks.kopen(settings)
    with pytest.raises(kiks.ParameterError, match="baud must be a whole number from 75"):
        kiks.Khepera(sim.url(1), baud=10)
    with pytest.raises(ValueError, match="baudrate must be a whole number from 75"):
        serial.serial_for_url(sim.url(1), baudrate=10)
    kiks.Khepera(sim.url(1)).close()


def test_a_speed_is_that_of_the_line_and_an_open_port_that_has_none_is_refused(sim: kiks.Simulation) -> None:
    port = serial.serial_for_url(sim.url(1), timeout=1)
    for baud, found in ((38400, 38400), (None, 38400), (19200, 19200)):
        assert kiks.Khepera(sim.port(1), baud=baud).encoders() == (0, 0)
        assert sim.port(1).baudrate == found
    assert kiks.Khepera(port, baud=57600).encoders() == (0, 0)
    assert port.baudrate == sim.port(1).baudrate == 57600
    assert kiks.Champion(kiks.controllers.linear(), [0.0] * 18).drive(port, seconds=0) == 0
    assert port.baudrate == 57600
    port.close()
    with pytest.raises(kiks.LinkError, match="baud must be a speed that the open port can be set to, but it was 9600"):
        kiks.Khepera(Silent(), baud=9600)
    with pytest.raises(kiks.ParameterError, match="baud must be a whole number from 75"):
        kiks.drive(sim.port(1), kiks.controllers.linear(), [0.0] * 18, seconds=1, baud=10)


@pytest.mark.parametrize("timeout", [-1, "1", math.nan])
def test_a_wrong_timeout_leaves_no_reply_unread(sim: kiks.Simulation, timeout: float) -> None:
    ref = kiks.kopen([-1])
    with pytest.raises(kiks.ParameterError, match="timeout must be a finite number of at least 0"):
        kiks.ksend("N\n", ref, timeout)
    assert kiks.ksend("D,1,1\n", ref) == "d"
    kiks.kclose(ref)


REFUSED: list[tuple[Callable[[kiks.Simulation], object], str]] = [
    *(
        (
            lambda _, count=count: kiks.Simulation(robots=count),
            "robots must be a whole number from 0 to 1000, but it was",
        )
        for count in (-1, 1001, 1.5, "2")
    ),
    (lambda _: kiks.Simulation("maze.png"), r"arena must be a kiks.Arena, but it was 'maze.png'. Give kiks.Arena.load"),
    (lambda sim: sim.place(1, 20, 300, 0), r"at \(20, 300\) mm a wall is 17.5 mm inside it"),
    (lambda sim: sim.place(1, -500, 300, 0), "must be free"),
    (lambda sim: sim.place(1, 5000, 0, 0), r"at \(5000, 0\) mm it is outside of the arena. The arena is 600 x"),
    (lambda sim: sim.place(1, math.nan, 300, 0), "x_mm must be a finite number"),
    (lambda sim: sim.pose(2), "This simulation has robot 1"),
    (lambda sim: sim.run(-1), "Time never runs backwards"),
    (lambda sim: sim.run("5"), r"seconds must be a number from 0 to 1e9, but it was '5'.$"),
]


def test_a_simulation_checks_its_arguments(sim: kiks.Simulation) -> None:
    sim.place(1, 300.0, 400.0, math.pi / 3)
    for call, words in REFUSED:
        with pytest.raises(kiks.ParameterError, match=words):
            call(sim)
        assert sim.pose(1) == (300.0, 400.0, math.pi / 3)


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
