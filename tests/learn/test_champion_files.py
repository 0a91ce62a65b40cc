"""A champion's file carries its world and its robot, and gives both back to the bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.learn.small import small

import kiks
from kiks.learn.exam import EXAM_SEED
from kiks.model.arena import Ball, Cylinder, Lamp, Pose
from kiks.model.project import Project, ProjectRobot

LINEAR = kiks.controllers.linear()
PARAMETERS = tuple(np.linspace(-3, 3, 18).tolist())


def furnished() -> kiks.Arena:
    walls = np.zeros((400, 500), np.uint8)
    walls[100:150, 200:210] = 90
    return replace(
        kiks.Arena.from_array(walls),
        name="furnished",
        starts=(Pose(60.0, 70.125, 1.0), Pose(400.0, 300.0, 0.5)),
        balls=(Ball(300.0, 200.0),),
        cylinders=(Cylinder(100.0, 300.0),),
        lamps=(Lamp(250.0, 200.0, 5.0),),
    )


def end_of(champion: kiks.Champion, seconds: float = 2.0) -> str:
    """Return the hash of its world after some time."""
    sim, ports = champion.simulation()
    champion.drive(ports, seconds=seconds)
    return sim.state_hash()


@pytest.mark.parametrize("robot", ["khepera_ii", kiks.RobotSpec.load("khepera").with_changes(body__pulse_mm=0.081)])
def test_a_champion_lives_in_its_world_again(robot: str | kiks.RobotSpec, tmp_path: Path) -> None:
    world = Project(furnished(), robots=(ProjectRobot(),) * 2, seed=12345)
    found = {"task": "far", "fitness": 0.1, "measures": {"a b": 1e-9}, "generation": 3, "algorithm": "ga", "seed": 7}
    timing = kiks.Timing(0.05, None, 0.01)
    champion = kiks.Champion(LINEAR, PARAMETERS, robot=robot, world=world, timing=timing, **found)
    champion.save(tmp_path / "one.toml")
    again = kiks.Champion.load(tmp_path / "one.toml")
    for name in ("controller", "parameters", "robot", "timing", "kiks", *found):
        assert getattr(again, name) == getattr(champion, name)
    np.testing.assert_array_equal(again.world.arena.brightness, world.arena.brightness)
    assert (again.world.seed, len(again.world.robots)) == (12345, 2)
    sim, ports = again.simulation()
    assert sim.poses()[:, 0].tolist() == [60.0, 400.0]
    assert len(ports) == 2
    assert end_of(again) == end_of(champion)
    again.save(tmp_path / "two.toml")
    assert kiks.Champion.load(tmp_path / "two.toml").world is not None
    (tmp_path / "one.toml").rename(tmp_path / "other.toml")
    assert kiks.Champion.load(tmp_path / "other.toml").robot == robot


def test_steppers_evolve_and_their_champion_drives_them_again(tmp_path: Path) -> None:
    evolution = kiks.Evolution(small(robot="epuck"), "ga", seed=1, population=6, folder=tmp_path / "run")
    evolution.run(generations=2)
    champion = evolution.champion
    champion.save(tmp_path / "champion.toml")
    again = kiks.Champion.load(tmp_path / "champion.toml")
    sim, _ = again.simulation()
    assert sim.spec == kiks.RobotSpec.load("epuck")
    assert end_of(again) == end_of(champion)


def test_the_world_begins_where_the_exam_does() -> None:
    task = kiks.tasks.avoid()
    poses = task.exam.random_starts(EXAM_SEED, robots=1, radius_mm=27.5)[:: len(task.exam.arenas), 0]
    starts = np.array(task.project().arena.starts)
    assert starts.shape == (4, 3)
    turned = (starts[:, 2] - poses[:, 2] + 0.1) % (2 * np.pi) - 0.1
    np.testing.assert_allclose(np.column_stack([starts[:, :2], turned]), poses * [1, 1, 0], atol=1e-3)
    assert task.with_changes(exam=None).project().arena.walls == task.arenas_of(0)[0].walls


def test_robots_and_seed_may_be_others_than_those_of_the_world_or_of_the_default_box(tmp_path: Path) -> None:
    kiks.Champion(LINEAR, PARAMETERS).save(tmp_path / "champion.toml")
    champion = kiks.Champion.load(tmp_path / "champion.toml")
    assert champion.world is None
    sim, ports = champion.simulation()
    assert (sim.arena.name, len(ports), sim.seed) == (kiks.Arena.default().name, 1, 0)
    champion = kiks.Champion(LINEAR, PARAMETERS, world=Project(furnished(), seed=7))
    sim, ports = champion.simulation(robots=3, seed=8)
    assert (len(ports), sim.seed, sim.arena.name) == (3, 8, "furnished")
    sim, ports = champion.simulation(kiks.Arena.box(300, 300))
    assert (len(ports), sim.seed, sim.arena.width_mm) == (1, 0, 300)


def test_wrong_files_are_errors(tmp_path: Path) -> None:
    kiks.Champion(LINEAR, PARAMETERS).save(tmp_path / "one.toml")
    (tmp_path / "broken.kiks").write_text("kiks = 2\n")
    text = (tmp_path / "one.toml").read_text()
    for before, after, message in (
        ("champion = 1", "champion = 9", "champion must be 1, but it was 9. It is the version of the format"),
        ("champion = 1", "champion = ", "must be TOML in UTF-8"),
        ('kind = "linear"', 'kind = "linaer"', "Did you mean 'linear'"),
        ("parameters = [", "parameters = [\n    1.0,", "must be given 18 parameters, but got 19"),
        ("period_s = 0.1", "period_s = -1", "timing.period_s must be at least 0, but it was -1"),
        ("seed = 0", "sed = 3", "Did you mean 'seed'"),
        ('robot = "khepera"\n', "", "robot must be given, but it is missing"),
        ("fitness = ", "fitness = nan #", "fitness must be a finite number, but it was nan"),
        ("[controller]", "[measures.deep]\na = 1\n[controller]", "measures must be a table|measures.* must be"),
        ("seed = 0", 'world = "../one_world.kiks"', "world must lead to a file in"),
        ("seed = 0", 'world = "/etc/passwd"', "world must lead to a file in"),
        ("seed = 0", 'world = "none.kiks"', "none.kiks' must exist"),
        ("seed = 0", 'world = "broken.kiks"', "broken.kiks': kiks must be 1"),
        ("seed = 0", "world = 3", "world must be a text"),
    ):
        assert before in text
        (tmp_path / "one.toml").write_text(text.replace(before, after))
        with pytest.raises(kiks.KiksError, match=message):
            kiks.Champion.load(tmp_path / "one.toml")


def test_a_champion_whose_controller_has_changed_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "task.py").write_text(
        "import kiks\nGAIN = 2.0\n@kiks.controller(parameters=1)\n"
        "def own(sensors, memory, parameters, wheels):\n    wheels[0] = wheels[1] = GAIN * parameters[0]\n"
    )
    recipe = {"function": "task.py:own"}
    kiks.Champion(kiks.controllers.from_recipe(recipe, tmp_path), (1.0,)).save(tmp_path / "one.toml")
    kiks.Champion(LINEAR, PARAMETERS).save(tmp_path / "ready.toml")
    code = tmp_path / "one_controller.py"
    code.write_text("# The same, with a word.\n" + code.read_text())
    for name in ("one.toml", "ready.toml"):
        kiks.Champion.load(tmp_path / name)
    assert not caplog.messages
    code.write_text(code.read_text().replace("GAIN = 2.0", "GAIN = -2.00"))
    kiks.Champion.load(tmp_path / "one.toml")
    (message,) = caplog.messages
    assert message.startswith(f"The controller of '{tmp_path / 'one.toml'}', or what it imports, has changed")
