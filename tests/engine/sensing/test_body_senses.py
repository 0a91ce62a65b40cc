"""Ground sensors, accelerometer and microphones: what they say where the answer is known, and what must not matter."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kiks
from kiks.control.senses import SENSES
from kiks.engine.sensing import accelerometer, microphones
from kiks.engine.sensing.floor import GROUND_COUNTS, GROUND_NOISE_COUNTS
from kiks.model.arena import Arena, Cylinder, Pose, Zone
from kiks.model.robot import GroundSensors, RobotSpec

KHEPERA = RobotSpec.load("khepera")
STEPPER = KHEPERA.with_changes(motor__steps_per_s_max=2000.0)  # keeps its speed without a regulator
G = accelerometer.GRAVITY_COUNTS


def world(*starts: tuple[float, float, float], robot: Any = "khepera", **things: Any) -> kiks.Simulation:
    arena = replace(Arena.box(1000, 800), starts=tuple(Pose(*each) for each in starts), **things)
    return kiks.Simulation(arena, seed=6, robot=robot, robots=len(starts))


def read(sim: kiks.Simulation, name: str, robot: int = 1, *, is_noisy: bool = False, time_ns: int | None = None) -> Any:
    sim.world.tick_to(sim.world.now_ns)
    ticks, now_ns = int(sim.world.state.tick_count), sim.world.now_ns if time_ns is None else time_ns
    return SENSES[name].look(sim.world.scene, robot - 1, ticks, now_ns, is_noisy=is_noisy)


def drive(sim: kiks.Simulation, left: int, right: int) -> None:
    """Set the speeds of robot 1 [steps/s]."""
    sim.world.state.robots[0, 0]["speed_setpoint"] = left, right


# ---- ground ----


def test_each_ground_sensor_sees_its_own_place() -> None:
    places = GroundSensors()
    for dark in range(5):
        zone = Zone(disc_mm=(500.0 - places.left_mm[dark], 400.0 + places.ahead_mm[dark]), radius_mm=4, brightness=0)
        sim = world((500.0, 400.0, math.pi / 2), zones=(zone,))
        assert [value < 400 for value in read(sim, "ground")] == [k == dark for k in range(5)]
    assert (read(world((500.0, 400.0, 0.3)), "ground") == GROUND_COUNTS).all()


def test_a_file_says_where_they_look() -> None:
    robot = RobotSpec(**(vars(KHEPERA) | {"ground": GroundSensors(left_mm=(0.0, 0.0, 0.0, 0.0, 0.0))}))
    zone = Zone(box_mm=((0.0, 395.0), (1000.0, 405.0)), brightness=0)
    assert (read(world((500.0, 400.0, 0.0), robot=robot, zones=(zone,)), "ground") < 10).all()


def test_noise_of_the_ground_is_small_and_fair() -> None:
    sim = world((500.0, 400.0, 0.0), zones=(Zone(box_mm=((0.0, 0.0), (1000.0, 800.0)), brightness=51),))
    found = np.array([read(sim, "ground", is_noisy=True, time_ns=k) for k in range(0, 20_000, 10)])
    assert np.abs(found - 200.0).max() <= GROUND_NOISE_COUNTS + 0.5
    assert found.mean() == pytest.approx(200.0, abs=0.1)
    assert np.abs(np.corrcoef(found.T) - np.eye(5)).max() < 0.1


# ---- accelerometer ----


def test_a_robot_that_stands_or_drives_steadily_feels_gravity_alone() -> None:
    sim = world((300.0, 400.0, 0.4), robot=STEPPER)
    assert read(sim, "accelerometer").tolist() == [0.0, 0.0, G]
    drive(sim, 1000, 1000)
    sim.run(2.0)
    np.testing.assert_allclose(read(sim, "accelerometer"), [0.0, 0.0, G], atol=1e-4)


def test_it_is_the_change_of_the_speed_in_the_robots_frame() -> None:
    sim = world((300.0, 400.0, 0.9))
    robot: Any = sim.world.state.robots[0, 0]
    ahead, left = np.array((math.cos(0.9), math.sin(0.9))), np.array((-math.sin(0.9), math.cos(0.9)))
    # 1 mm in the tick before the last, 1.5 mm ahead and 0.2 mm to the left in the last one.
    places = [np.array((300.0, 400.0)) + way for way in (0 * ahead, 1.0 * ahead, 2.5 * ahead + 0.2 * left)]
    robot["x_mm"], robot["y_mm"] = places[2]
    robot["trail"][0][:2], robot["trail"][1][:2] = places[1], places[0]
    per_mm = G / 9806.65 / 0.01**2
    np.testing.assert_allclose(read(sim, "accelerometer"), [-0.2 * per_mm, 0.5 * per_mm, G])


def test_a_turn_is_an_acceleration_towards_its_middle() -> None:
    sim = world((500.0, 400.0, 0.0), robot=STEPPER)
    drive(sim, 1000, 2000)
    sim.run(1.0)
    speed, turn = 1500 * 0.08, 1000 * 0.08 / KHEPERA.body.wheel_base_mm  # [mm/s], [rad/s]
    right, ahead, up = read(sim, "accelerometer")
    assert right == pytest.approx(-speed * turn / 9806.65 * G, rel=0.03)
    assert abs(ahead) < 0.03 * abs(right)
    assert up == G


def test_a_wall_is_a_shock_backwards() -> None:
    sim = world((900.0, 400.0, 0.0), robot=STEPPER)
    drive(sim, 1000, 1000)
    found = []
    for _ in range(100):
        sim.run(0.01)
        found.append(read(sim, "accelerometer")[1])
    # It starts at once, from 0 to 80 mm/s in a tick, and 62 mm later it stops as suddenly, but for its slip.
    shock = 80.0 / 0.01 / 9806.65 * G
    assert max(found[:5]) == pytest.approx(shock)
    assert found[30] == pytest.approx(0.0, abs=1.0)
    assert -1.05 * shock < min(found) < -0.5 * shock
    assert np.argmin(found) == pytest.approx(62.0 / 0.8, abs=2)


def test_a_robot_that_is_put_elsewhere_feels_nothing() -> None:
    sim = world((300.0, 400.0, 0.0))
    sim.port(1).write(b"D,10,10\n")
    sim.run(1.0)
    sim.place(1, 700.0, 300.0, 1.0)
    assert read(sim, "accelerometer").tolist() == [0.0, 0.0, G]


def test_noise_of_the_accelerometer_and_its_range() -> None:
    sim = world((300.0, 400.0, 0.0))
    found = np.array([read(sim, "accelerometer", is_noisy=True, time_ns=k) for k in range(0, 20_000, 10)])
    assert np.abs(found - (0.0, 0.0, G)).max() <= accelerometer.NOISE_COUNTS
    assert np.abs(found.mean(axis=0) - (0.0, 0.0, G)).max() < 0.5
    sim.world.state.robots[0, 0]["x_mm"] += 40.0
    assert read(sim, "accelerometer", is_noisy=True)[1] == accelerometer.COUNTS_MAX


# ---- microphones ----

QUIET = (microphones.QUIET + microphones.NOISY) / 2


def speak(sim: kiks.Simulation, robot: int, loudness: float, ends_ns: int = 10**9) -> None:
    sim.world.state.robots[0, robot - 1]["loudness"] = loudness
    sim.world.state.robots[0, robot - 1]["sound_ends_ns"] = ends_ns


def test_a_quiet_room_has_small_amplitudes() -> None:
    sim = world((300.0, 400.0, 0.0))
    found = np.array([read(sim, "microphones", is_noisy=True, time_ns=k) for k in range(0, 20_000, 10)])
    assert (found.min(), found.max()) == (microphones.QUIET, microphones.NOISY)
    assert read(sim, "microphones").tolist() == [QUIET] * 3
    assert len({*read(world((300.0, 400.0, 0.0), robot=KHEPERA.without_noise()), "microphones", is_noisy=True)}) == 1


def test_a_sound_is_as_loud_as_said_where_a_microphone_faces_it_and_falls_with_the_distance() -> None:
    # The left microphone, 30 mm from the middle, faces the speaker.
    for apart_mm in (100.0, 200.0, 300.0):
        sim = world((300.0, 300.0, 0.0), (300.0, 330.0 + apart_mm, 0.0))
        speak(sim, 2, 800.0)
        right, left, behind = read(sim, "microphones") - QUIET
        assert left == pytest.approx(800.0 * 100.0 / apart_mm)
        assert right < behind < left
        assert right == pytest.approx(800.0 * 100.0 / (apart_mm + 60.0) * (1.0 - microphones.SHADOW))


def test_a_mirrored_world_swaps_the_microphones_at_the_sides() -> None:
    found = []
    for side in (1.0, -1.0):
        sim = world((400.0, 400.0, 0.0), (500.0, 400.0 + 130.0 * side, 0.0), (350.0, 400.0 - 250.0 * side, 0.0))
        speak(sim, 2, 500.0)
        speak(sim, 3, 900.0)
        found.append(read(sim, "microphones"))
    np.testing.assert_allclose(found[0], found[1][[1, 0, 2]])


def test_a_sound_ends_and_its_own_speaker_is_heard_on_all_sides() -> None:
    sim = world((300.0, 300.0, 0.7), (600.0, 300.0, 0.0))
    speak(sim, 1, 300.0, ends_ns=500_000_000)
    right, left, behind = read(sim, "microphones") - QUIET
    assert right == pytest.approx(left) == pytest.approx(behind)
    assert right > 500.0
    assert (read(sim, "microphones", 2) > QUIET + 50.0).all()
    sim.run(0.5)
    assert read(sim, "microphones").tolist() == read(sim, "microphones", 2).tolist() == [QUIET] * 3
    speak(sim, 1, 1e5)
    assert (read(sim, "microphones") == microphones.COUNTS_MAX).all()


def test_sounds_add_by_their_squares() -> None:
    one, other, both = (world((300.0, 300.0, 0.0), (500.0, 300.0, 0.0), (300.0, 500.0, 0.0)) for _ in range(3))
    for sim, robots in ((one, (2,)), (other, (3,)), (both, (2, 3))):
        for robot in robots:
            speak(sim, robot, 600.0)
    parts = [read(sim, "microphones") - QUIET for sim in (one, other, both)]
    np.testing.assert_allclose(parts[2], np.hypot(parts[0], parts[1]))


def test_things_do_not_matter_to_sounds() -> None:
    sims = [world((300.0, 300.0, 0.0), (600.0, 300.0, 0.0), cylinders=each) for each in ((), (Cylinder(450.0, 300.0),))]
    for sim in sims:
        speak(sim, 2, 600.0)
    assert read(sims[0], "microphones").tolist() == read(sims[1], "microphones").tolist()
