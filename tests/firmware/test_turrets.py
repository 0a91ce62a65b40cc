"""The one interface of all turrets: tables, names, errors, turrets of a user's own, memory; and the battle turret."""

import logging
import math
import re
import runpy
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from tests.model.refusals import refused
from tests.reply_grammar import ORDERS
from tests.session_player import FOLDER, TURRETS

import kiks
from kiks.engine.state import BODY, MEMORY_COUNT, ROBOT
from kiks.firmware.general_io import GeneralIO
from kiks.firmware.turret import Orders, Shape, Turret

ROOT = Path(__file__).parents[2]


class Counter(Turret):
    """A turret that counts, rolls dice and fails."""

    number, name, memory_count = 24, "Counter", 2

    def count(self, step: int) -> tuple[int, ...]:
        """C: count on."""
        self.site.memory[0] += step
        return (int(self.site.memory[0]),)

    def roll(self) -> tuple[int, ...]:
        """R: a die."""
        return (1 + int(6 * self.site.random()),)

    def fail(self) -> tuple[int, ...]:
        """X: fail."""
        raise ZeroDivisionError

    def babble(self) -> Any:
        """Y: answer nonsense."""
        return ("seven",)

    def reset(self) -> None:
        """Begin again."""
        if hasattr(self, "site"):
            self.site.memory[:] = 0

    orders: ClassVar[Orders] = {"C": (1, count), "R": (0, roll), "X": (0, fail), "Y": (0, babble)}


def execute(sim: kiks.Simulation, line: str, robot: int = 1) -> str:
    """Give an order at this very instant, so that times and energies are exact."""
    sim.sync()
    return sim.wires[robot - 1].firmware.execute(line.encode(), sim.now_ns).decode().rstrip()


def test_records_have_no_gaps() -> None:
    """The hash covers their bytes, and padding bytes between the fields would have any value."""
    for record in (ROBOT, BODY):
        assert sum(record[name].itemsize for name in record.names or ()) == record.itemsize


def test_tables_are_complete_and_each_order_has_a_transcript_and_a_line_in_the_documents() -> None:
    sim = kiks.Simulation(robots=2)
    for name in TURRETS:
        turret = sim.fit(2, name)
        known = {letter.decode() for letter in ORDERS.get(turret.number, {})}
        assert (set(turret.orders) if turret.number >= 0 else set()) == known
        for letter, (count, act) in turret.orders.items():
            assert count >= 0
            assert (act.__doc__ or "").startswith(f"{letter}: ")
    assert execute(sim, "net") == "No intelligent turret"
    assert [line.split(", ")[1] for line in execute(sim, "net", 2).splitlines()] == ["ID 1", "ID 2", "ID 4", "ID 99"]
    sent = "".join(path.read_text(encoding="ascii") for path in FOLDER.glob("*.txt"))
    page = (ROOT / "docs" / "howto" / "turrets.md").read_text(encoding="utf-8")
    for number, orders in ORDERS.items():
        for letter in (*orders, b"B"):
            order = f"T,{number},{letter.decode()}"
            assert re.search(rf"^> .*{order}\b", sent, re.MULTILINE), order
            assert re.search(rf"`{order}\b", page), order


def test_all_of_them_can_be_drawn() -> None:
    sim = kiks.Simulation()
    fitted = {name: sim.fit(1, name) for name in TURRETS}
    digest = sim.state_hash()
    for turret in fitted.values():
        assert turret.shapes()
        for shape in turret.shapes():
            assert isinstance(shape, Shape)
            assert re.fullmatch("#[0-9a-f]{6}", shape.colour)
            assert (len(shape.points) == 1) == (shape.radius_mm > 0)
            assert all(abs(mm) < 100 for point in shape.points for mm in point)
    assert sim.state_hash() == digest
    farthest = []
    for arm in (255, 127):
        execute(sim, f"T,1,E,{arm}")
        sim.run(1.1)
        sim.sync()
        farthest.append([max(x for x, _ in shape.points) for shape in fitted["gripper"].shapes()])
    assert min(farthest[0]) > 60 > 0 > max(farthest[1])


def test_general_io_is_wired_to_the_outside_and_minds_its_numbers() -> None:
    sim = kiks.Simulation()
    io = sim.fit(1, "io")
    assert isinstance(io, GeneralIO)
    robot = kiks.Khepera(sim.port(1))
    robot.write_bus(170, 32)
    assert io.outputs == 170
    io.inputs = 0b101
    io.set_input(7, True)
    io.set_input(0, False)
    assert robot.read_bus(32) == io.inputs == 0b1000_0100
    assert robot.read_bus(31) == 0
    for channel, volts in ((3, 2.0), (4, -1.0), (5, 100.0)):
        io.set_analog(channel, volts)
    assert [robot.analog(channel) for channel in (3, 4, 5)] == [500, 0, 1023]
    digest = sim.state_hash()
    io.set_analog(3, 2.1)
    assert sim.state_hash() != digest
    robot.send("restart")
    sim.run(0.1)
    assert (io.outputs, io.inputs) == (0, 0b1000_0100)
    io: Any = kiks.Simulation().fit(1, "io")
    for call, words in (
        (lambda: setattr(io, "inputs", 256), "inputs must be a whole number from 0 to 255, but it was 256"),
        (lambda: setattr(io, "inputs", 1.5), "inputs must be a whole number from 0 to 255, but it was 1.5"),
        (lambda: io.set_input(8, True), "wire must be a whole number from 0 to 7, but it was 8"),
        (lambda: io.set_analog(2, 1.0), "channel must be a whole number from 3 to 5, but it was 2"),
        (lambda: io.set_analog(3, float("nan")), "volts must be a finite number, but it was nan"),
        (lambda: io.set_analog(3, "1"), "volts must be a finite number, but it was '1'"),
    ):
        refused(words, call)


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    path = ROOT / "examples" / "turrets" / "compass.py"
    runpy.run_path(str(path), run_name="__main__")
    assert re.fullmatch(r"heading 30\nturned by 8\d\n", capsys.readouterr().out)
    assert len(path.read_text(encoding="utf-8").splitlines()) < 60


def test_what_it_remembers_stands_in_the_state_apart_from_what_others_do() -> None:
    sim = kiks.Simulation(robots=2)
    for robot in (1, 2):
        sim.fit(robot, Counter())
    assert execute(sim, "T,24,C,5") == "t,24,c,5"
    snapshot = sim.world.state.snapshot()
    digest = sim.state_hash()
    assert (execute(sim, "T,24,C,5"), execute(sim, "T,24,C,1", 2)) == ("t,24,c,10", "t,24,c,1")
    assert sim.state_hash() != digest
    sim.world.state.restore(snapshot)
    assert sim.state_hash() == digest
    assert execute(sim, "T,24,C,5") == "t,24,c,10"
    execute(sim, "restart")
    assert execute(sim, "T,24,C,5") == "t,24,c,5"
    sim = kiks.Simulation()
    sim.fit(1, Counter())
    sim.fit(1, a_turret(number=25, memory_count=MEMORY_COUNT - 2))
    execute(sim, "T,24,C,5")
    assert (execute(sim, "T,25,C,7"), execute(sim, "T,24,C,0")) == ("t,25,c,7", "t,24,c,5")
    words = r"memory_count of a turret must be .* from 0 to 0, but it was 1"
    refused(words, sim.fit, 1, a_turret(number=26, memory_count=1))


def a_turret(**changes: Any) -> Turret:
    return type("Odd", (Counter,), changes)()


def test_chance_repeats() -> None:
    def rolls(seed: int, robot: int) -> tuple[str, ...]:
        sim, found = kiks.Simulation(robots=2, seed=seed), []
        sim.fit(robot, Counter())
        for _ in range(20):
            found.append(execute(sim, "T,24,R", robot))
            sim.run(0.01)
        return tuple(found)

    assert rolls(1, 1) == rolls(1, 1)
    assert len({rolls(seed, robot) for seed in (1, 2) for robot in (1, 2)}) == 4


def test_its_faults_never_reach_the_wire(caplog: pytest.LogCaptureFixture) -> None:
    sim = kiks.Simulation()
    sim.fit(1, Counter())
    with caplog.at_level(logging.ERROR):
        for order in "XY":
            assert execute(sim, f"T,24,{order}") == "z,Protocol error"
    assert "Turret 24 (Counter) must not raise, but order X did." in caplog.text
    assert "ZeroDivisionError" in caplog.text


def test_a_ray_finds_what_is_there() -> None:
    sim = kiks.Simulation(kiks.Arena.box(600, 600), robots=2)
    sim.place(1, 300, 300, 0.0)
    sim.place(2, 300, 400, 0.0)
    ball = sim.add_ball(200, 300)
    site = sim.fit(1, Counter()).site
    rim_mm = 100 - sim.bodies()["radius_mm"][0]
    for angle_rad, found, distance_mm, error_mm in (
        (0.0, (0, 0), 290, 0.1),
        (np.pi / 2, (2, 0), 72.5, 1e-6),
        (-np.pi, (0, ball), rim_mm, 1e-6),
    ):
        met = site.ray(angle_rad)
        assert (met.robot, met.body) == found
        assert met.distance_mm == pytest.approx(distance_mm, abs=error_mm)
    assert site.ray() == site.ray(0.0)
    assert site.poses() == [pytest.approx((300, 300, 0)), pytest.approx((300, 400, 0))]
    assert len(site.bodies()) == 1
    assert (site.arena_mm, site.robot) == ((600, 600), 1)


def test_what_is_no_turret_is_refused_and_nothing_is_fitted_twice() -> None:
    sim = kiks.Simulation()
    for turret, words in (
        (7, "turret must be a name or a kiks.firmware.turret.Turret, but it was 7"),
        (Counter, "turret must be a name or a kiks.firmware.turret.Turret"),
        (a_turret(number=100), "turret Odd: number must be at most 99, but it was 100. 24 to 31 are for users."),
        (a_turret(number="1"), "turret Odd: number must be a whole number, but it was '1'"),
        (a_turret(name="Gr\u00fc\u00dfe"), "turret Odd: name must be a line of ASCII"),
        (a_turret(name=""), "turret Odd: name must be a line of ASCII"),
        (a_turret(revision=(1,)), r"turret Odd: revision must be two whole numbers, but it was \(1,\). Take"),
        (a_turret(revision=(1, -1)), r"turret Odd: revision\[1\] must be at least 0, but it was -1"),
        (a_turret(orders={"B": (0, len)}), "orders of a turret must be capital letters other than B, but one was 'B'"),
        (a_turret(orders={"c": (0, len)}), "orders of a turret must be capital letters other than B, but one was 'c'"),
        (a_turret(orders={"C": len}), "orders of a turret must be a count of numbers and a function, but C was"),
        (a_turret(memory_count=17), "turret Odd: memory_count must be at most 16, but it was 17"),
    ):
        refused(words, sim.fit, 1, turret)
    for count, name in enumerate(TURRETS, 1):
        sim.fit(1, name)
        refused("turret must be one that robot 1 has not got", sim.fit, 1, name)
        assert len(sim.wires[0].firmware.fitted) == count


def a_battle(robots: int = 2, turrets: tuple[int, ...] = (1, 2)) -> kiks.Simulation:
    sim = kiks.Simulation(kiks.Arena.box(800, 600, wall_mm=10), seed=1, robots=robots)
    for robot in range(1, robots + 1):
        sim.place(robot, 100.0 * robot, 100.0, math.pi / 2)
    for robot in turrets:
        sim.fit(robot, "battle")
    return sim


def ask(sim: kiks.Simulation, order: str, robot: int = 1) -> list[int]:
    return [int(word) for word in execute(sim, f"T,99,{order}", robot).split(",")[3:]]


def test_the_battle_turret_knows_where_it_is() -> None:
    sim = a_battle(1, (1,))
    for heading_deg, distance_mm in ((0, 462), (90, 262), (180, 262), (270, 262), (-90, 262), (720, 462)):
        sim.place(1, 300.7, 299.6, math.radians(heading_deg))
        x_mm, y_mm, angle, ahead_mm, percent, points, hits = ask(sim, "S")
        # 300.7 mm from the left is in KiKS column 301, 600 - 299.6 from the top in row 300 (kiks-behaviour.md, 0).
        assert (x_mm, y_mm, angle) == (301, 300, heading_deg % 360)
        assert ahead_mm == pytest.approx(distance_mm, abs=2)
        assert (percent, points, hits) == (100, 27, 0)


def test_a_shot_costs_a_hit_hurts_and_energy_comes_back_a_point_a_second() -> None:
    sim = a_battle()
    sim.place(1, 100, 300, 0.0)
    sim.place(2, 300, 310, 0.0)
    target, distance_mm = ask(sim, "F")
    assert target == 2
    assert distance_mm == int(200 - math.sqrt(27.5**2 - 10**2) - 27.5)
    assert ask(sim, "S")[4:] == [81, 22, 0]
    assert ask(sim, "S", 2)[4:] == [63, 17, 1]
    assert ask(sim, "S", 2)[6] == 0  # read
    ask(sim, "F")
    ask(sim, "F")
    assert ask(sim, "S", 2)[4:] == [0, 0, 2]  # 27.5 - 3 * 10
    assert ask(sim, "F", 2) == [-1, -1]
    assert ask(sim, "S", 1)[5] == 12
    sim = a_battle(1, (1,))
    assert [ask(sim, "F")[0] for _ in range(5)] == [-1] * 5
    assert ask(sim, "S")[5] == 2
    assert ask(sim, "F") == [-1, -1]
    sim.run(2.499)
    assert ask(sim, "F") == [-1, -1]
    sim.run(0.002)
    assert ask(sim, "F")[1] >= 0
    sim.run(10.0)
    assert ask(sim, "S")[5] == 10
    sim.run(100.0)
    assert ask(sim, "S")[4:6] == [100, 27]


@pytest.mark.parametrize(
    ("what", "target", "distance_mm"),
    [("wall", -1, 62), ("ball", -1, 140), ("robot without the turret", 3, 145), ("lifted", 2, 445)],
)
def test_things_stop_a_shot(what: str, target: int, distance_mm: int) -> None:
    sim = a_battle(3)
    sim.place(1, 100, 300, math.pi if what == "wall" else 0.0)
    sim.place(2, 600, 300, 0.0)
    if what == "robot without the turret":
        sim.place(3, 300, 300, 0.0)
    elif what != "wall":
        sim.add_ball(300, 300)
        sim.world.state.bodies["is_lifted"] = what == "lifted"
        sim.world.rebuild_scene()
    assert ask(sim, "F") == [target, distance_mm]
    assert ask(sim, "S", 2)[6] == (1 if what == "lifted" else 0)


def test_nose_to_nose_the_distance_is_nought_and_energy_stands_in_the_state() -> None:
    sim = a_battle()
    sim.place(1, 100, 300, 0.0)
    sim.place(2, 155.001, 300, 0.0)
    snapshot = sim.world.state.snapshot()
    assert ask(sim, "F") == [2, 0]
    assert sim.state_hash() != snapshot.hash()
    sim.world.state.restore(snapshot)
    assert ask(sim, "S")[5] == 27
