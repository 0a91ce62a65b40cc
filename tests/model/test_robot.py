"""Robots are data files: ours are complete, and what is wrong in a user's own is named."""

import re
from functools import partial
from importlib import resources
from pathlib import Path

import pytest
from tests.model.refusals import refused

import kiks
from kiks.model.robot import ColourCamera, GroundSensors, RobotSpec, robot_toml

OURS = (resources.files("kiks.model") / "robots" / "khepera.toml").read_text(encoding="utf-8")


def changed(tmp_path: Path, before: str, after: str) -> str:
    assert before in OURS
    path = tmp_path / "mine.toml"
    path.write_text(OURS.replace(before, after), encoding="utf-8")
    return str(path)


def test_ours_differ_where_the_robots_do() -> None:
    first, second = RobotSpec.load("khepera"), RobotSpec.load("khepera_ii")
    assert (first.body.diameter_mm, second.body.diameter_mm) == (55.0, 70.0)
    assert first.body.wheel_base_mm == second.body.wheel_base_mm == 53.0
    assert (first.proximity.maximum_counts, second.proximity.maximum_counts) == (1023, 1020)
    assert (first.motor, first.reset) == (second.motor, second.reset)


@pytest.mark.slow
def test_a_robot_of_ones_own_drives(tmp_path: Path) -> None:
    path = changed(tmp_path, "pulse_mm = 0.08 ", "pulse_mm = 0.12 ")
    floor = kiks.Arena.box(800, 800)
    far, near = kiks.Simulation(floor, robot=path), kiks.Simulation(floor)
    for sim in (far, near):
        kiks.Khepera(sim.port(1)).set_speed(5, 5)
        sim.run(5)
    assert far.travelled_mm(1) == pytest.approx(1.5 * near.travelled_mm(1))


def test_a_file_may_have_a_colour_camera_and_ground_sensors(tmp_path: Path) -> None:
    khepera = RobotSpec.load("khepera")
    assert not re.search(r"\[colour_camera|\[ground", robot_toml(khepera))
    path = tmp_path / "mine.toml"
    path.write_text(robot_toml(khepera) + "[colour_camera]\nheight_mm = 40\n[ground]\nleft_mm = [1, 2, 3, 4, 5]\n")
    mine = RobotSpec.load(path)
    assert (mine.colour_camera, mine.ground) == (ColourCamera(height_mm=40), GroundSensors(left_mm=(1, 2, 3, 4, 5)))
    path.write_text(robot_toml(mine))
    assert RobotSpec.load(path) == mine
    for words, changes in (
        ("ground.left_mm must have at most 5 items", {"ground__left_mm": (0.0,) * 6}),
        ("colour_camera.field_of_view_deg must be at most 150", {"colour_camera__field_of_view_deg": 170}),
    ):
        refused(words, partial(mine.with_changes, **changes))


def test_an_error_names_the_wrong_parameter(tmp_path: Path) -> None:
    for before, after, words in (
        ("diameter_mm = 55.0", "diametre_mm = 55.0", "Did you mean 'diameter_mm'"),
        ("diameter_mm = 55.0", "", "body.diameter_mm must be given, but it is missing. Compare it with 'khepera.toml'"),
        ("diameter_mm = 55.0", "diameter_mm = 5", "body.diameter_mm must be at least 10, but it was 5"),
        ("[motor]", "[motors]", "Did you mean 'motor'"),
        ("baud = 9600", "baud = true", "firmware.baud must be a whole number, but it was True"),
        ("profile_acceleration = 64", "profile_acceleration = 0", "reset.profile_acceleration must be at "),
        ('name = "Khepera"', 'name = ""', "name must have at least 1 character, but it was ''. Write: name = "),
        (
            "slip_ratio_min = 0.10",
            "slip_ratio_min = 0.5",
            "body.slip_ratio_min must be at most slip_ratio_max, but it was 0.5",
        ),
        (
            "mount_angle_deg = [",
            "mount_angle_deg = [1e308, ",
            "proximity.mount_angle_deg[0] must be at most 360, but it was 1e+308",
        ),
    ):
        line = refused(re.escape(words), RobotSpec.load, changed(tmp_path, before, after))
        assert "must" in line
        assert "mine.toml" in line
    khepera, khepera_ii = RobotSpec.load("khepera"), RobotSpec.load("khepera_ii")
    for robot, key, value, words in (
        (khepera_ii, "curve.distance_mm", (10.0, 10.0), "a list that rises"),
        (khepera_ii, "curve.counts", (1200.0, 1300.0, 10.0, 5.0), "one for each distance, falling"),
        (khepera, "proximity.jitter_counts", (), "have at least 1 item"),
        (khepera, "proximity.jitter_counts", (3.0, 1.0), "be a list in which none is below the one before"),
        (khepera, "proximity.noise_down", 1.5, "be at most 1"),
        (khepera, "ambient.lamp_counts", (50.0, 70.0, 60.0), "a list that rises to dark_counts"),
        (khepera, "ambient.lamp_counts", (50.0, 460.0), "a list that rises to dark_counts"),
        (khepera, "ambient.background_counts", 460.0, "above lamp_counts, up to dark_counts"),
        (khepera, "ambient.background_counts", 50.0, "above lamp_counts, up to dark_counts"),
        (khepera, "body.wall_friction", -1, "be at least 0"),
    ):
        words = rf"{key} must .*{words}.*, but it was {re.escape(repr(value))}"
        refused(words, partial(robot.with_changes, **{key.replace(".", "__"): value}))
    for words, changes in (
        (r"must have known keys only.*Did you mean 'wall_friction'", {"body__wall_fricton": 0.1}),
        ("must be named 'section__key'", {"speed": 1}),
    ):
        refused(words, partial(khepera.with_changes, **changes))
