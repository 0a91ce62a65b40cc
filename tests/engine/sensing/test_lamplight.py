"""The light on the floor agrees with what sensors see, whatever lamps hang over."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kiks import Arena, RobotSpec, Simulation
from kiks.engine.sensing.lamplight import light_floor
from kiks.export.light import light_map, light_scale

KHEPERA = RobotSpec.load("khepera")


def light(cells: NDArray[np.uint8], *lamps: tuple[float, float, float, float], step_mm: float = 4.0) -> Any:
    """Return the light of lamps among cells of 4 mm, in a map with cells of another size; row 0 is that of y = 0."""
    scale = light_scale(KHEPERA)
    out = np.empty([round(side * 4 / step_mm) for side in cells.shape], np.float32)
    rows = np.array(lamps, np.float64).reshape(-1, 4)
    light_floor(cells, 4.0, rows, np.array(scale.strengths), scale.step_mm, scale.background_flux, out)
    return out


def hall(rows: int = 60, columns: int = 80) -> NDArray[np.uint8]:
    """Return a floor with some walls."""
    cells = np.zeros((rows, columns), np.uint8)
    cells[20:40, 38:41] = 255
    cells[50:, 10:14] = 1
    cells[5:9, 60:70] = 90
    return cells


def test_the_light_of_a_mirrored_or_turned_hall_is_mirrored_or_turned() -> None:
    cells = hall()
    seen = light(cells, (61.3, 118.2, 0.3, 1.0), (250.0, 30.0, 0.1, 1.0))
    assert 0.1 < (seen > 0.3).mean() < 0.9
    mirrored = light(np.ascontiguousarray(cells[:, ::-1]), (320 - 61.3, 118.2, 0.3, 1.0), (70.0, 30.0, 0.1, 1.0))
    np.testing.assert_allclose(mirrored[:, ::-1], seen, atol=1e-6)
    turned = light(np.ascontiguousarray(np.rot90(cells)), (118.2, 320 - 61.3, 0.3, 1.0), (30.0, 70.0, 0.1, 1.0))
    np.testing.assert_allclose(np.rot90(turned, -1), seen, atol=1e-6)


@pytest.mark.parametrize("lamp", [(300.0, 203.0), (300.0, 5.0), (-30.0, 200.0), (120.0, 120.0), (300.0, 410.0)])
def test_floor_is_lit_where_a_sensor_sees_the_lamp_that_may_hang_over_a_wall(lamp: tuple[float, float]) -> None:
    cells = Arena.box(600, 400).brightness.copy()
    cells[180:220, 290:310] = 255
    cells[100:104, 350:500] = 255
    arena = Arena(cells, 1.0, "over a wall")
    lamps = np.array([[*lamp, 1.0, 1.0]])
    seen, sim = light_map(arena, lamps, [KHEPERA]), Simulation(arena, seed=1)
    assert seen is not None
    sim.lamps = lamps
    parameters, compared = sim.world.kinds[0], {True: 0, False: 0}
    for place in range(400):
        x_mm, y_mm = 20 + place * 37 % 560, 20 + place * 53 % 360
        is_free = sim.world.free_space.wall_gap_mm(x_mm, y_mm, KHEPERA.body.radius_mm) > 2.0
        if not is_free or math.dist(lamp, (x_mm, y_mm)) < 50.0:
            continue
        heading = math.atan2(lamp[1] - y_mm, lamp[0] - x_mm)
        sim.place(1, x_mm, y_mm, heading)
        turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
        for sensor in (2, 3):  # they look 10 degrees aside
            mount = turn @ (parameters["mount_x_mm"][sensor], parameters["mount_y_mm"][sensor])
            row, column = seen.shape[0] - 1 - int((y_mm + mount[1]) / 2.5), int((x_mm + mount[0]) / 2.5)
            around, count = seen[row - 1 : row + 2, column - 1 : column + 2], sim.ambient(1, noise=False)[sensor]
            if around.min() > 0.3:
                compared[True] += 1
                assert count < 450, place
            elif around.max() == 0.0:
                compared[False] += 1
                assert count > 435, place
    assert min(compared.values()) > 5


def test_lamps_that_are_nowhere_or_off_give_no_light() -> None:
    places = (math.nan, 50.0, 1.0), (50.0, math.inf, 1.0), (1e12, 50.0, 1.0), (50.0, 50.0, math.nan)
    nowhere = [(*place, 1.0) for place in places]
    assert not light(hall(), *nowhere, (50.0, 50.0, 1.0, 0.0)).any()
    assert not light(hall()).any()
    alone = light(hall(), (50.0, 50.0, 1.0, 1.0))
    assert 0.99 < alone.max() <= 1.0
    assert np.array_equal(light(hall(), *nowhere, (50.0, 50.0, 1.0, 1.0)), alone)


def test_a_finer_map_shows_the_same_light() -> None:
    coarse, fine = (light(hall(), (61.3, 118.2, 1.0, 1.0), step_mm=step_mm) for step_mm in (4.0, 2.0))
    means = fine.reshape(60, 2, 80, 2).mean(axis=(1, 3))
    assert abs(means - coarse).mean() < 0.01
