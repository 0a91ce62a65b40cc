"""Kinds of robots: each is whole, and nothing outside of its folder takes it for another one."""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from tools import house_figures

import kiks
from kiks.batch.loop_timing import LENGTHS
from kiks.control.senses import SENSES
from kiks.engine.state import ROBOT, State
from kiks.errors import ParameterError
from kiks.firmware.firmware import Firmware
from kiks.firmware.receiver import Receiver
from kiks.firmware.robot_kind import RobotCommand, RobotKind, robot_kind
from kiks.model.robot import SENSOR_COUNT, RobotSpec, robot_names, robot_toml
from kiks.model.robot_kinds import ROBOT_KINDS
from kiks.recording.entries import Entry
from kiks.recording.tables import parse_reading
from kiks.sim.run_log import Kind


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
    assert len(kind.set_speeds(-kind.speed_max, -kind.speed_max)) < LENGTHS
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


def test_tables_of_recordings_have_what_each_kind_replies_to_a_sense(tmp_path: Path) -> None:
    sim = kiks.Simulation(kiks.Arena.box(500, 500), robot=["epuck", "khepera"], seed=1)
    with sim.record(tmp_path / "run.mcap"):
        for robot, requests in enumerate((b"Q\nN\n", b"H\nN\n"), 1):
            sim.port(robot).write(requests)
        sim.run(0.5)
    recording = kiks.Recording(tmp_path / "run.mcap")
    assert [recording.table(name)["robot"].tolist() for name in ("positions", "readings", "Q")] == [[1, 2], [1, 2], [1]]
    near = Entry(Kind.ACT, 0, 0, 0, 0, b"near,1,2,3,4,5,6,7,8\n")
    assert parse_reading(near, [ECHO]) == ("N", (1, 2, 3, 4, 5, 6, 7, 8))
    assert parse_reading(near, [robot_kind("khepera")]) is None


NAMES = {*ROBOT_KINDS, *robot_names(), *(RobotSpec.load(name).name for name in robot_names())}
"""The names of all robots and kinds of robots."""


def decisions_on_names(node: ast.AST) -> Iterator[str]:
    """Yield what asks for a robot's name in a syntax tree: comparisons, cases, keys, and methods that look it up."""

    def has_name(*parts: ast.AST | None) -> bool:
        return any(
            isinstance(each, ast.Constant) and each.value in NAMES
            for part in parts
            if part is not None
            for each in ast.walk(part)
        )

    for each in ast.walk(node):
        match each:
            case ast.Compare():
                found = has_name(each.left, *each.comparators)
            case ast.MatchValue():
                found = has_name(each.value)
            case ast.Subscript(slice=ast.Constant() as key):
                found = has_name(key)
            case ast.Dict():
                found = has_name(*(key for key in each.keys if isinstance(key, ast.Constant)))
            case ast.Call(func=ast.Attribute(attr="get" | "pop" | "startswith" | "endswith")):
                found = has_name(*each.args[:1])
            case _:
                found = False
        if found:
            yield f"{getattr(each, 'lineno', 0)}: {ast.unparse(each)}"


@pytest.mark.parametrize(
    ("code", "count"),
    [
        ("if kind == 'epuck': pass", 1),
        ("x = 1 if kind in ('khepera', 'khepera_ii') else 2", 1),
        ("match kind:\n  case 'epuck' | 'khepera': pass", 2),
        ("y = {'khepera': 55}[kind]", 1),
        ("y = sizes['khepera']", 1),
        ("y = spec.name.startswith('e-puck')", 1),
        ("def f(robot: str = 'khepera') -> None: load('epuck')", 0),
    ],
)
def test_decisions_on_names_are_found(code: str, count: int) -> None:
    assert len(list(decisions_on_names(ast.parse(code)))) == count


def test_nothing_asks_for_the_name_of_a_robot() -> None:
    """So a further kind needs no change but its row; defaults are no questions."""
    wrong = [
        f"{place}:{found}"
        for file in house_figures.files()
        if (place := file.relative_to(house_figures.SOURCES).as_posix()) != "model/robot_kinds.py"
        for found in decisions_on_names(house_figures.tree_of(file))
    ]
    assert not wrong, "\n".join(wrong)


def test_few_lines_outside_of_its_own_files_name_the_epuck() -> None:
    naming, _ = house_figures.lines_that_name_it()
    assert 0 < len(naming) <= 40, "\n".join(naming)
