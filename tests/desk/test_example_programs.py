"""The example programs do what they say."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kiks.desk.example_programs as programs
from kiks.model.arena import Arena
from kiks.script.runner import run_here
from kiks.sim.simulation import Simulation

FOLDER = Path(programs.__file__).parent
NAMES = sorted(path.stem for path in FOLDER.glob("[!_]*.py"))


def run(sim: Simulation, name: str) -> int:
    """Run an example to its end."""
    return run_here(sim, FOLDER / f"{name}.py", [], {})


def speeds(sim: Simulation) -> list[int]:
    sim.run(0.1)
    return sim.world.state.robots["speed_setpoint"][0, 0].tolist()


def test_all_are_tested() -> None:
    assert NAMES == ["avoid", "camera", "first_steps", "follow_wall", "square", "to_the_light"]
    for name in NAMES:
        assert (FOLDER / f"{name}.py").read_text().startswith('"""')


def test_first_steps(capsys: pytest.CaptureFixture[str]) -> None:
    sim = Simulation(seed=1)
    assert run(sim, "first_steps") == 0
    out = capsys.readouterr().out
    assert "Version of the robot: b," in out
    assert "from the left clockwise: n," in out
    assert speeds(sim) == [0, 0]
    assert sim.distances_mm()[0, 0] == pytest.approx(80, abs=10)


def test_avoid_touches_nothing() -> None:
    sim = Simulation(seed=1)
    assert run(sim, "avoid") == 0
    assert sim.contacts(1) == 0
    assert sim.travelled_mm(1) > 60 * 20
    assert speeds(sim) == [0, 0]


def test_follow_wall_keeps_its_distance() -> None:
    sim = Simulation(Arena.box(500, 500), seed=1)
    sim.record_paths(0.5)
    assert run(sim, "follow_wall") == 0
    assert sim.contacts(1) == 0
    path = sim.paths()[0, -75:]
    x_mm, y_mm = path[:, 1], path[:, 2]
    from_wall = np.minimum(np.minimum(x_mm, y_mm), np.minimum(500 - x_mm, 500 - y_mm)) - 10
    assert from_wall.max() < 27 + 40
    assert np.ptp(np.arctan2(y_mm - 250, x_mm - 250)) > 5
    assert speeds(sim) == [0, 0]


@pytest.mark.parametrize("heading_rad", [0.0, 2.0, 4.0])
def test_to_the_light(heading_rad: float) -> None:
    sim = Simulation(Arena.box(700, 700), seed=1)
    sim.add_lamp(450, 450, power_w=10)
    sim.place(1, 200, 200, heading_rad)
    sim.record_paths(0.1)
    assert run(sim, "to_the_light") == 0
    path = sim.paths()[0]
    away = np.hypot(path[:, 1] - 450, path[:, 2] - 450)
    assert away.min() < 60
    assert sim.contacts(1) == 0
    assert speeds(sim) == [0, 0]


def test_square_ends_where_it_began(capsys: pytest.CaptureFixture[str]) -> None:
    sim = Simulation(Arena.box(500, 500), seed=1)
    sim.place(1, 150, 300, 0.0)
    sim.record_paths(0.1)
    assert run(sim, "square") == 0
    assert capsys.readouterr().out.count("is done") == 4
    x_mm, y_mm, heading_rad = sim.pose(1)
    assert (x_mm, y_mm) == pytest.approx((150, 300), abs=12)
    assert math.cos(heading_rad) > 0.98
    path = sim.paths()[0]
    assert path[:, 1].max() == pytest.approx(250, abs=8)
    assert path[:, 2].min() == pytest.approx(200, abs=8)


def test_camera(capsys: pytest.CaptureFixture[str]) -> None:
    sim = Simulation(seed=1)
    assert run(sim, "camera") == 1
    assert "has no K213" in capsys.readouterr().err
    sim.fit(1, "k213")
    assert run(sim, "camera") == 0
    pictures = capsys.readouterr().out.splitlines()
    assert len(pictures) == 60
    assert {len(picture) for picture in pictures} == {64}
    assert len(set("".join(pictures))) > 3
