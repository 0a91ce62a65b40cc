"""The light on the floor: it is drawn where a sensor would see it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kiks.export.light import light_map, light_scale
from kiks.export.pictures import Picture
from kiks.model.arena import Arena, Lamp
from kiks.model.robot import RobotSpec
from kiks.sim.simulation import Simulation

KHEPERA = RobotSpec.load("khepera")


def lamps(*rows: tuple[float, float, float, float]) -> NDArray[np.float64]:
    return np.array(rows, np.float64).reshape(-1, 4)


@pytest.mark.parametrize("spec", [KHEPERA, KHEPERA.without_noise()], ids=["noisy", "without noise"])
@pytest.mark.parametrize("power_w", [1.0, 4.0])
def test_floor_is_lit_exactly_where_a_sensor_that_faces_the_lamp_reads_more_than_noise(power_w, spec) -> None:
    arena = replace(Arena.box(2000, 200), lamps=(Lamp(60, 100, power_w),))
    light = light_map(arena, lamps((60, 100, power_w, 1)), spec)
    sim = Simulation(arena, robot=spec)
    row, cell_mm = light.shape[0] // 2, 2000 / light.shape[1]
    strengths = {}
    for x_mm in range(150, 1900, 30):
        sim.place(1, x_mm, 100, np.pi + np.radians(10))  # a front sensor looks 10 degrees aside
        parameters = sim.world.kinds[0]
        reading = min(sim.ambient(1))
        strengths[x_mm] = light[row, int((x_mm - 27) / cell_mm)]
        signal = (parameters["dark_counts"] - reading) / max(parameters["dark_noise_counts"], 1)
        if not 0.8 < signal < 1.3:
            assert (strengths[x_mm] > 0) == (signal > 1), (x_mm, reading)
    assert [*strengths.values()] == sorted(strengths.values(), reverse=True)


def test_walls_cast_shadows_lamps_that_are_off_none() -> None:
    arena = Arena.box(600, 400)
    brightness = arena.brightness.copy()
    brightness[100:300, 300:310] = 255
    arena = Arena(brightness, 1.0, "wall")
    light = light_map(arena, lamps((200, 200, 1, 1)), KHEPERA)
    at = [light[light.shape[0] // 2, int(x_mm / 2.5)] for x_mm in (120, 280, 330, 400)]
    assert min(at[:2]) > 0.7
    assert at[2:] == [0, 0]
    assert light_map(arena, lamps((200, 200, 1, 0)), KHEPERA) is None
    assert light_map(arena, lamps(), KHEPERA) is None


def test_light_of_two_lamps_adds_up() -> None:
    arena = Arena.box(1000, 400)
    lamp, strong = (300, 200, 1, 1), (300, 200, 2, 1)
    one, two, both = (light_map(arena, lamps(*rows), KHEPERA) for rows in ([lamp], [lamp] * 2, [strong]))
    assert (two >= one).all()
    assert two.sum() > 1.2 * one.sum()
    np.testing.assert_allclose(two, both, atol=1e-6)


def test_picture_has_the_light_and_the_scale_is_a_short_table(tmp_path: Path) -> None:
    arena = replace(Arena.box(800, 400), lamps=(Lamp(400, 200),))
    picture = np.asarray(Picture.of_arena(arena).image().convert("RGB")).astype(int)
    middle, per_mm = picture.shape[0] // 2, picture.shape[1] / 800
    yellow = [picture[middle, int(x_mm * per_mm)] @ [1, 0, -1] for x_mm in (440, 550, 600, 670)]
    assert yellow[0] > yellow[1] > yellow[2] > yellow[3] == picture[middle, int(780 * per_mm)] @ [1, 0, -1]
    for spec in (KHEPERA, RobotSpec.load("khepera_ii"), KHEPERA.without_noise()):
        scale = light_scale(spec)
        assert (scale.strengths[0], scale.strengths[-1]) == (1, 0)
        assert len(scale.strengths) < 100
