"""The battle turret: where it says it is, what it hits, and what that costs."""

import math

import pytest

import kiks


def a_simulation(robots: int = 2, turrets: tuple[int, ...] = (1, 2)) -> kiks.Simulation:
    sim = kiks.Simulation(kiks.Arena.box(800, 600, wall_mm=10), seed=1, robots=robots)
    for robot in range(1, robots + 1):
        sim.place(robot, 100.0 * robot, 100.0, math.pi / 2)
    for robot in turrets:
        sim.fit(robot, "battle")
    return sim


def ask(sim: kiks.Simulation, order: str, robot: int = 1) -> list[int]:
    """Ask at this very instant, so that energies are exact."""
    sim.sync()
    reply = sim.wires[robot - 1].firmware.execute(f"T,99,{order}".encode(), sim.now_ns).decode()
    return [int(word) for word in reply.split(",")[3:]]


def test_it_knows_where_it_is() -> None:
    sim = a_simulation(1, (1,))
    for heading_deg, distance_mm in ((0, 462), (90, 262), (180, 262), (270, 262), (-90, 262), (720, 462)):
        sim.place(1, 300.7, 299.6, math.radians(heading_deg))
        x_mm, y_mm, angle, ahead_mm, percent, points, hits = ask(sim, "S")
        # 300.7 mm from the left is in KiKS column 301, 600 - 299.6 from the top in row 300 (kiks-behaviour.md, 0).
        assert (x_mm, y_mm, angle) == (301, 300, heading_deg % 360)
        assert ahead_mm == pytest.approx(distance_mm, abs=2)
        assert (percent, points, hits) == (100, 27, 0)


def test_a_shot_costs_and_a_hit_hurts() -> None:
    sim = a_simulation()
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


def test_energy_comes_back_a_point_a_second() -> None:
    sim = a_simulation(1, (1,))
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
    sim = a_simulation(3)
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
    sim = a_simulation()
    sim.place(1, 100, 300, 0.0)
    sim.place(2, 155.001, 300, 0.0)
    snapshot = sim.world.state.snapshot()
    assert ask(sim, "F") == [2, 0]
    assert sim.state_hash() != snapshot.hash()
    sim.world.state.restore(snapshot)
    assert ask(sim, "S")[5] == 27
