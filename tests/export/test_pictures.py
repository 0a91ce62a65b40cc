"""Pictures of a run show what there is, where it is, and light where a sensor would see it."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import kiks
from kiks.errors import ParameterError
from kiks.export.caption import scale_bar
from kiks.export.light import light_map, light_scale
from kiks.export.pictures import Picture
from kiks.model.arena import Lamp, Pose
from kiks.sim.colours import robot_colour

FLOOR = (246, 243, 236)
SCALE = 2  # pixels a millimetre, in arenas of less than 600 mm


def world() -> kiks.Simulation:
    arena = replace(kiks.Arena.box(400, 300), starts=(Pose(100, 100, 0.0), Pose(300, 100, math.pi / 2)))
    sim = kiks.Simulation(arena, robots=2)
    sim.add_ball(100, 220)
    sim.add_cylinder(200, 220)
    sim.add_lamp(300, 220)
    return sim


def pixel(image, x_mm: float, y_mm: float) -> tuple[int, int, int]:
    return image.getpixel((round(x_mm * SCALE), image.height - 1 - round(y_mm * SCALE)))


def test_everything_is_where_it_is() -> None:
    image = Picture.of_simulation(world()).image()
    assert (image.size, pixel(image, 40, 30)) == ((800, 600), FLOOR)
    assert max(pixel(image, 4, 150)) < 200  # a wall
    red, _, blue = pixel(image, 100, 210)
    assert red > blue + 100  # the ball
    assert pixel(image, 211, 220)[0] < 200  # the cylinder
    assert pixel(image, 300, 220)[2] < 100  # the lamp
    assert pixel(image, 300, 280)[2] < FLOOR[2]  # its light
    assert min(pixel(image, 121, 100)) > 240  # noses: one points right, the other up
    assert min(pixel(image, 300, 121)) > 240
    for index, x_mm in enumerate((100, 300)):
        assert pixel(image, x_mm + 6, 106) == pytest.approx(robot_colour(index), abs=3)  # beside its number
        assert pixel(image, x_mm + 18.7, 118.7) == pytest.approx(robot_colour(index), abs=60)  # its ring


def test_stripes_stand_around_a_robot() -> None:
    robot = kiks.RobotSpec.load("khepera").with_changes(body__stripe_count=2)
    sim = kiks.Simulation(kiks.Arena.box(300, 300), robot=robot)
    sim.place(1, 150, 150, math.pi / 2)
    image, rim_mm = Picture.of_simulation(sim).image(), robot.body.radius_mm - 1.5

    def at(*angles: float) -> list[tuple[int, int, int]]:
        return [pixel(image, 150 - rim_mm * math.sin(angle), 150 + rim_mm * math.cos(angle)) for angle in angles]

    black, white = at(0.6, 0.6 + math.pi), at(0.6 + math.pi / 2, 0.6 - math.pi / 2)
    assert max(map(max, black)) < 30
    assert min(map(min, white)) > 230


def test_trails_show_where_everything_was(tmp_path: Path) -> None:
    sim = world()
    sim.lamps[:, 3] = 0
    before = pixel(Picture.of_simulation(sim).image(), 200, 190)
    with sim.record(tmp_path / "run.mcap"):
        sim.run(0.2)
        sim.place(1, 200, 100, 0.0)
        sim.move_body(2, 200, 160)
        sim.remove_body(1)
        sim.add_ball(200, 50, radius_mm=10)
        sim.run(0.2)
    recording = kiks.Recording(tmp_path / "run.mcap")
    image = Picture.of_recording(recording, recording.log.end_ns).image()
    assert before == FLOOR
    assert pixel(image, 200, 190) != FLOOR  # the cylinder's path
    assert pixel(image, 150, 100) != FLOOR  # the robot's
    assert pixel(image, 90, 110) != FLOOR  # where it began, faintly
    assert min(pixel(image, 90, 110)) > 180
    assert pixel(image, 100, 220) == FLOOR  # the ball that went


def test_a_scale_bar_has_a_round_length() -> None:
    for width_mm, text in ((99, "10 mm"), (300, "50 mm"), (1000, "200 mm"), (5000, "1 m"), (20_000, "2 m")):
        sign = scale_bar(width_mm, width_mm / 40)
        assert sign.text == text
        assert width_mm / 15 < sign.width_mm <= width_mm / 5


def test_a_picture_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    for name, words in (("no/such/folder/x.png", "a picture must go to a file"), ("x.nothing", "must end in .png")):
        with pytest.raises(ParameterError, match=words):
            Picture.of_simulation(world()).save(tmp_path / name)


KHEPERA = kiks.RobotSpec.load("khepera")


def lamps(*rows: tuple[float, float, float, float]) -> NDArray[np.float64]:
    return np.array(rows, np.float64).reshape(-1, 4)


@pytest.mark.parametrize("spec", [KHEPERA, KHEPERA.without_noise()], ids=["noisy", "without noise"])
@pytest.mark.parametrize("power_w", [1.0, 4.0])
def test_floor_is_lit_exactly_where_a_sensor_that_faces_the_lamp_reads_more_than_noise(power_w, spec) -> None:
    arena = replace(kiks.Arena.box(2000, 200), lamps=(Lamp(60, 100, power_w),))
    light = light_map(arena, lamps((60, 100, power_w, 1)), [spec])
    sim = kiks.Simulation(arena, robot=spec)
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
    arena = kiks.Arena.box(600, 400)
    brightness = arena.brightness.copy()
    brightness[100:300, 300:310] = 255
    arena = kiks.Arena(brightness, 1.0, "wall")
    light = light_map(arena, lamps((200, 200, 1, 1)), [KHEPERA])
    at = [light[light.shape[0] // 2, int(x_mm / 2.5)] for x_mm in (120, 280, 330, 400)]
    assert min(at[:2]) > 0.7
    assert at[2:] == [0, 0]
    assert light_map(arena, lamps((200, 200, 1, 0)), [KHEPERA]) is None
    assert light_map(arena, lamps(), [KHEPERA]) is None
    # That of two lamps in one place is that of a lamp twice as strong.
    one, two, both = (light_map(arena, lamps(*[(200, 200, w, 1)] * n), [KHEPERA]) for w, n in ((1, 1), (1, 2), (2, 1)))
    assert (two >= one).all()
    assert two.sum() > 1.2 * one.sum()
    np.testing.assert_allclose(two, both, atol=1e-6)


def test_picture_has_the_light_and_the_scale_is_a_short_table(tmp_path: Path) -> None:
    arena = replace(kiks.Arena.box(800, 400), lamps=(Lamp(400, 200),))
    picture = np.asarray(Picture.of_arena(arena).image().convert("RGB")).astype(int)
    middle, per_mm = picture.shape[0] // 2, picture.shape[1] / 800
    yellow = [picture[middle, int(x_mm * per_mm)] @ [1, 0, -1] for x_mm in (440, 550, 600, 670)]
    assert yellow[0] > yellow[1] > yellow[2] > yellow[3] == picture[middle, int(780 * per_mm)] @ [1, 0, -1]
    for spec in (KHEPERA, kiks.RobotSpec.load("khepera_ii"), KHEPERA.without_noise()):
        scale = light_scale(spec)
        assert (scale.strengths[0], scale.strengths[-1]) == (1, 0)
        assert len(scale.strengths) < 100
