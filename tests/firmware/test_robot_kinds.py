"""Kinds of robots: each is whole, and nothing outside of its folder takes it for another one."""

from collections.abc import Callable

import numpy as np
import pytest

import kiks
from kiks.control.senses import SENSES
from kiks.engine.state import ROBOT, State
from kiks.errors import ParameterError
from kiks.firmware.firmware import Firmware
from kiks.firmware.receiver import Receiver
from kiks.firmware.robot_kind import RobotCommand, RobotKind, robot_kind
from kiks.model.robot import SENSOR_COUNT, RobotSpec, robot_names, robot_toml
from kiks.model.robot_kinds import ROBOT_KINDS


class Echo(Firmware):
    """Answers each line by itself, and notes what it reads of a sense."""

    def __init__(self, spec: RobotSpec, state: State, number: int, sense: Callable[[str], list[int]]) -> None:
        self.receiver = Receiver()
        self.lines: list[bytes] = []
        super().__init__(spec, state, number, sense)

    def execute(self, line: bytes, now_ns: int) -> bytes:
        self.lines.append(line)
        return line + b" %d\n" % len(self.sense("proximity"))

    def reset(self) -> None:
        self.baud = self.selected_baud

    def wake(self, now_ns: int) -> bytes:
        raise AssertionError


ECHO = RobotKind(
    firmware=Echo,
    commands=(RobotCommand("go", "drive", ("speed",), (), "", print),),
    usual="go",
    speeds=b"go %d %d\n",
    speeds_reply=b"ok\n",
    speed_max=9,
    senses={"proximity": "near"},
    counts_max=99,
    sensor_names=tuple("abcdefgh"),
)


@pytest.mark.parametrize("name", ROBOT_KINDS)
def test_a_kind_is_whole(name: str) -> None:
    kind = robot_kind(name)
    letters = [command.letter for command in kind.commands]
    assert len(kind.sensor_names) == SENSOR_COUNT
    assert len(set(letters)) == len(letters)
    assert set(kind.usual) <= set(letters)
    assert {sense: SENSES[sense].command_for(kind) for sense in kind.senses} == dict(kind.senses)
    sim = kiks.Simulation(robot=next(each for each in robot_names() if RobotSpec.load(each).kind == name))
    leds = kind.looks(sim.specs[0].body).leds
    assert kind.lit(np.zeros(3, ROBOT)).shape == (3, len(leds))
    assert len({led.name for led in leds}) == len(leds) <= 16
    sim.wires[0].send(kind.stop, 0)
    sim.run(0.1)
    assert sim.wires[0].line.take(99) == kind.speeds_reply


def test_a_robot_has_the_firmware_the_stop_and_the_names_of_its_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(ROBOT_KINDS, "echo", "this module")
    monkeypatch.setattr("pkgutil.resolve_name", lambda _: ECHO)
    spec = RobotSpec.load("khepera").with_changes(body__diameter_mm=60.0)
    object.__setattr__(spec, "kind", "echo")
    sim = kiks.Simulation(robot=spec)
    port, (wire,) = sim.port(1), sim.wires
    port.write(b"hello\n")
    assert port.readline() == b"hello 8\n"
    wire.halt(sim.now_ns)
    sim.run(0.1)
    assert isinstance(wire.firmware, Echo)
    assert wire.firmware.lines == [b"hello", b"go 0 0"]
    assert sim.explain(1, 2).name == "c"


def test_a_file_names_a_kind_or_is_a_kheperas() -> None:
    spec = RobotSpec.load("khepera_ii")
    assert spec.kind == "khepera"
    assert "kind" not in robot_toml(spec)  # so that earlier versions read it
    with pytest.raises(ParameterError, match=r"kind must be 'khepera'.* or .*, but it was 'r2d2'"):
        RobotSpec(**(vars(spec) | {"kind": "r2d2"}))
