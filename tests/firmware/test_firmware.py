"""The robot's program: what lines do to its state, the tools that have rules of their own, and the page."""

import math
import runpy
from pathlib import Path

import pytest
from tests.session_player import TURRETS

from kiks.firmware.firmware import Firmware
from kiks.firmware.khepera.commands import COMMANDS
from kiks.firmware.khepera.tools import TOOLS
from kiks.firmware.receiver import LINE_LIMIT, Receiver
from kiks.firmware.robot_kind import RobotCommand
from kiks.firmware.turret import Turret
from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec
from kiks.sim.simulation import SimPort, Simulation

UNKNOWN = b"Command not found\r\n"
DOCS = Path(__file__).parents[2] / "docs"
ERROR = b"z,Protocol error\r\n"
NO_HELP = b"help: no tool or command of that name\r\n"


def a_simulation(robot: str = "khepera_ii", **changes: object) -> Simulation:
    sim = Simulation(Arena.box(1000, 1000), robot=RobotSpec.load(robot).with_changes(**changes))
    for turret in TURRETS:
        sim.fit(1, turret)
    return sim


def a_robot(robot: str = "khepera_ii", **changes: object) -> Firmware:
    return a_simulation(robot, **changes).wires[0].firmware


def test_a_line_may_be_as_long_as_the_limit_and_an_endless_one_takes_no_memory() -> None:
    robot = a_robot()
    for sizes in ([1000], [1] * 1000, [255, 1, 1, 743], [256, 744], [300, 300, 400]):
        for length, reply in ((LINE_LIMIT, b"d\r\n"), (LINE_LIMIT + 1, UNKNOWN), (900, UNKNOWN)):
            data = b"D,5," + b"0" * (length - 5) + b"5\nM\n"
            receiver, lines, place = Receiver(), [], 0
            for size in sizes:
                lines += [line for _, line in receiver.feed(data[place : place + size])]
                place += size
            assert [robot.execute(line, 0) for line in lines] == [reply, UNKNOWN]
    receiver = Receiver()
    for _ in range(100):
        receiver.feed(b"x" * 10_000)
    ((_, line),) = receiver.feed(b"\n")
    assert len(line) == LINE_LIMIT + 1


def test_quirks() -> None:
    for quirk, line, reply in (
        ("answer_empty_lines", b"", UNKNOWN),
        ("unknown_command_with_z", b"M", b"z," + UNKNOWN),
        ("d_reply_trailing_comma", b"D,0,0", b"d,\r\n"),
        ("d_reply_trailing_comma", b"T,1,D,0", b"t,1,d\r\n"),
        ("accept_lower_case", b"h", b"h,0,0\r\n"),
        ("accept_lower_case", b"d,5,5", b"d\r\n"),
        ("accept_lower_case", b"t,1,b", b"t,1,b,1,0\r\n"),
        ("accept_lower_case", b"m", UNKNOWN),
        ("accept_lower_case", b"help n", NO_HELP),
    ):
        assert a_robot(**{f"quirks__{quirk}": True}).execute(line, 0) == reply, line
    robot = a_robot(quirks__answer_empty_lines=True)
    assert [line for _, line in robot.receiver.feed(b"\r\nN\n")] == [b"", b"", b"N"]
    assert a_robot().execute(b"", 0) == b""
    assert a_robot().execute(b"D," + b"9" * 5000 + b",5", 0) == UNKNOWN, "execute itself minds the limit"


WRONG = [
    b"A,1,2", b"A,1,2,-3", b"A,1,2,x", b"C,5", b"C,5,x", b"D,5", b"D,5,x", b"D,5,5,5", b"F,1,-1,1", b"F,1,1,", b"G,5",
    b"G,5,--5", b"J,1,2,3", b"J,1,2,3,4,5", b"J,1,2,3,x", b"L,0,3", b"L,2,1", b"L,0", b"P,5", b"P,5,5.0", b"R,64",
    b"W,5,64", b"W,5,-1", b"W,5", b"T,1,D", b"I,9", b"d,5,5", b"D5,5", b"x" * 300, b"runs demo", b"restarted",
]  # fmt: skip


def test_an_error_changes_nothing() -> None:
    sim = a_simulation()
    robot = sim.wires[0].firmware
    for before in (b"C,500,900", b"L,0,1", b"W,7,7", b"J,30,30,30,30"):
        robot.execute(before, 0)
    sim.run(0.2)
    sim.sync()
    state = sim.state_hash()
    for line in WRONG:
        assert robot.execute(line, sim.now_ns) in (ERROR, UNKNOWN), line
        assert sim.state_hash() == state, line
        assert robot.wakes_ns is None, line


def test_numbers_are_clamped_counters_keep_the_low_32_bits_and_the_bus_8() -> None:
    robot = a_robot()
    for line, field, values in (
        (b"A,1,2,99999", "speed_gains", [1, 2, 32767]),
        (b"F,0,-0,32768", "position_gains", [0, 0, 32767]),
        (b"D,500,-500", "speed_setpoint", [127, -127]),
        (b"D," + b"9" * 120 + b",-" + b"9" * 120, "speed_setpoint", [127, -127]),
        (b"C,8388607,-8388607", "target_pulses", [8388606, -8388606]),
        (b"C," + b"9" * 120 + b",-" + b"9" * 120, "target_pulses", [8388606, -8388606]),
        (b"P,256,-" + b"9" * 200, "pwm_setpoint", [255, -255]),
        (b"J,0,0,128,256", "profile_speed", [1, 127]),
        (b"J,-5,-5,128,256", "profile_acceleration", [1, 255]),
        (b"J,1,2,3,4", "profile_speed", [1, 3]),
        (b"J,1,2,3,4", "profile_acceleration", [2, 4]),
        (b"L,1,2", "led", [0, 1]),
        (b"L,0,2", "led", [1, 1]),
        (b"L,0,2", "led", [0, 1]),
        (b"L,1,1", "led", [0, 1]),
    ):
        robot.execute(b"D,1,1", 0)
        assert robot.execute(line, 0) == line[:1].lower() + b"\r\n", line
        assert getattr(robot.view, field).tolist() == values, line
    robot = a_robot()
    for number in (2**31, -(2**31) - 1, 2**32 + 5, -(2**32) - 5, 10**200, -(10**200) + 1):
        assert robot.execute(b"G,%d,0" % number, 0) == b"g\r\n"
        assert robot.execute(b"H", 0) == b"h,%d,0\r\n" % ((number + 2**31) % 2**32 - 2**31)
    for data, address in ((170, 32), (256, 0), (-1, 63), (10**100 + 3, 5)):
        assert robot.execute(b"W,%d,%d" % (data, address), 0) == b"w\r\n"
        assert robot.view.bus[address] == data & 0xFF
        assert robot.execute(b"R,%d" % address, 0) == b"r,0\r\n"


def test_channels_1_and_2_follow_the_scan_and_6_the_motors() -> None:
    robot = a_robot()
    robot.sense = lambda name: list(range(10, 18) if name == "proximity" else range(20, 28))
    for sensor, time_ns in ((0, 0), (0, 2_499_999), (1, 2_500_000), (7, 19_999_999), (0, 20_000_000)):
        assert robot.execute(b"I,1", time_ns) == b"i,%d\r\n" % (10 + sensor)
        assert robot.execute(b"I,2", time_ns) == b"i,%d\r\n" % (20 + sensor)
    sim = a_simulation()
    robot = sim.wires[0].firmware
    assert robot.execute(b"I,6", 0) == b"i,100\r\n"
    robot.execute(b"P,255,-255", 0)
    sim.run(0.1)
    sim.sync()
    assert robot.execute(b"I,6", sim.now_ns) == b"i,400\r\n"


def test_a_turret_gets_numbers_that_fit_64_bits() -> None:
    class Listener(Turret):
        number, name = 9, "Listener"
        heard: tuple[int, ...] = ()

        def order(self, letter: str, values: tuple[int, ...]) -> tuple[int, ...]:
            self.heard = values
            return ()

    sim, listener = a_simulation(), Listener()
    sim.fit(1, listener)
    assert sim.wires[0].firmware.execute(b"T,9,S,5,-" + b"9" * 200, 0) == b"t,9,s\r\n"
    assert listener.heard == (5, -(2**62))


def test_there_is_help_for_every_letter_and_flash_in_the_second_khepera_alone() -> None:
    names, robot = {command.letter: command.name for command in COMMANDS}, a_robot()
    for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ":
        reply = robot.execute(f"help {letter}".encode(), 0)
        if letter in names:
            assert reply.startswith(letter.encode())
            assert reply.endswith(f": {names[letter]}\r\n".encode())
        else:
            assert reply == NO_HELP
    for name, has_flash in (("khepera", False), ("khepera_ii", True)):
        robot = a_robot(name)
        assert (robot.execute(b"flash E", 0) == b"Flash erased\r\n") == has_flash
        assert (robot.execute(b"flash", 0) == UNKNOWN) != has_flash
        for line in (b"help", b"list", b"help flash"):
            assert (b"flash E" in robot.execute(line, 0) or b"  flash," in robot.execute(line, 0)) == has_flash


def a_port(robot: str = "khepera_ii") -> SimPort:
    port = a_simulation(robot).port(1)
    port.timeout = 1.0
    return port


def test_serial_changes_the_speed_behind_its_reply() -> None:
    port = a_port()
    port.write(b"serial 115200\n")
    assert port.readline() == b"Line at 115200 baud\r\n"
    begin_ns = port.sim.now_ns
    assert begin_ns == (14 + 21) * 1_145_833 + 1_000_000  # the old speed
    port.write(b"H\n")
    assert port.readline() == b"h,0,0\r\n"
    assert port.sim.now_ns - begin_ns == (2 + 7) * 95_486 + 1_000_000
    assert port.baudrate == 115200


def test_restart_puts_all_to_defaults() -> None:
    sim = a_simulation()
    robot = sim.wires[0].firmware

    def settings() -> dict[str, list[int]]:
        names = ("led", "bus", "motor_mode", "speed_setpoint", "on_target", "speed_gains", "position_gains")
        return {name: getattr(robot.view, name).tolist() for name in (*names, "profile_speed", "profile_acceleration")}

    fresh = settings()
    for line in (b"A,1,2,3", b"F,1,2,3", b"J,9,9,9,9", b"L,0,1", b"L,1,1", b"W,5,5"):
        robot.execute(line, 0)
    for line in (b"serial 38400", b"run demo", b"C,50,50"):
        robot.execute(line, 0)
    sim.run(0.5)
    sim.sync()
    lines = robot.execute(b"restart", sim.now_ns).decode().split("\r\n")
    assert (lines[-1], lines[-2]) == ("", "Serial Communication Protocol")
    assert "ROM of minirobot KII" in lines[-3]
    assert "Rev. 6.01" in lines[-3]
    assert settings() == fresh
    assert robot.execute(b"H", sim.now_ns) == b"h,0,0\r\n"
    assert robot.baud == 9600
    assert robot.wakes_ns is None


def test_restart_brings_the_robot_to_rest_where_it_is_and_returns_to_the_selected_speed() -> None:
    port = a_port()
    port.write(b"D,50,50\n")
    port.readline()
    port.sim.run(1.0)
    before = port.sim.pose(1)
    port.write(b"restart\n")
    assert b"Serial Communication Protocol\r\n" in [port.readline() for _ in range(3)]
    port.sim.run(1.0)
    now = port.sim.pose(1)
    assert math.dist(now[:2], before[:2]) < 100
    assert now[2] == pytest.approx(before[2], abs=0.1)
    port.write(b"E\n")
    assert port.readline() == b"e,0,0\r\n"
    robot = a_robot(firmware__baud=38400)
    robot.execute(b"serial 115200", 0)
    assert robot.baud == 115200
    robot.execute(b"restart", 0)
    assert robot.baud == 38400
    robot.selected_baud = 57600
    assert robot.baud == 38400, "the selector is read at a reset"
    robot.execute(b"restart", 0)
    assert robot.baud == 57600


def test_the_demonstration_is_braitenbergs_vehicle() -> None:
    robot = a_robot()
    for proximity, speeds in (
        ([0] * 8, [14, 14]),  # 0.7 * 20
        ([400, 0, 0, 0, 0, 0, 0, 0], [17, 10]),  # left 0.7 * (20 + 4), right 0.7 * (20 - 5): away from the left
        ([0, 0, 0, 0, 0, 400, 0, 0], [10, 17]),
        ([0, 0, 1023, 1023, 0, 0, 0, 0], [-7, -7]),  # 0.7 * (20 - 12 * 1023 / 400)
        ([0, 0, 0, 0, 0, 0, 400, 400], [20, 20]),
    ):
        robot.sense = lambda _, proximity=proximity: proximity
        robot.execute(b"run demo", 5)
        assert robot.wakes_ns == 5
        robot.wake(5)
        assert robot.view.speed_setpoint.tolist() == speeds
        assert robot.wakes_ns == 20_000_005
        robot.execute(b"restart", 5)
    for line in (b"run", b"run demon", b"run demo now", b"run Demo"):
        assert robot.execute(line, 0).startswith(b"run: one of")
        assert robot.wakes_ns is None


def test_the_demonstration_avoids_walls_and_still_answers() -> None:
    port = a_port("khepera")
    sim = port.sim
    port.write(b"run demo\n")
    assert port.readline().startswith(b"Demonstration")
    sim.run(30.0)
    assert sim.travelled_mm(1) > 1000
    port.write(b"process\nD,0,0\nN\n")
    assert b"Demonstration" in b"".join(port.readline() for _ in range(5))
    assert port.readline() == b"d\r\n"
    assert port.readline().startswith(b"n,")
    port.write(b"restart\n")
    assert port.readline().startswith(b"KiKS")
    sim.run(1.0)
    travelled_mm = sim.travelled_mm(1)
    sim.run(1.0)
    assert sim.travelled_mm(1) == pytest.approx(travelled_mm, abs=0.1)


def test_the_page_of_the_protocol_has_a_section_of_each_command_and_tool() -> None:
    page = (DOCS / "reference" / "protocol.md").read_text(encoding="utf-8")
    for name in (*(f"{row.letter}: {row.name}" for row in COMMANDS), *TOOLS):
        assert f"### {name}\n" in page
    # A new letter has an example without an entry for it.
    row = RobotCommand("X", "new", ("a", "b"), (), "", print)
    section = runpy.run_path(str(DOCS / "pages" / "protocol.py"))["command"](row)
    assert "-> X,1,1" in list(section)
