"""The floor below a robot: its mean brightness in a spot, its noise, and what must not matter."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kiks
from kiks.control.senses import SENSES
from kiks.engine.sensing.floor import COUNTS, NOISE_COUNTS, read_floor
from kiks.engine.sensing.floor_spots import BLOCK, SPOT_MM, plains_of
from kiks.firmware.turret import Turret
from kiks.model.arena import Arena, Zone
from kiks.units import TICK_NS

ANGLES = np.linspace(0.0, 2 * math.pi, 97)[:-1]


def world(floor: Any, mm_per_pixel: float = 1.0) -> kiks.Simulation:
    plain = Arena.from_array(np.zeros(floor.shape, np.uint8), mm_per_pixel=mm_per_pixel)
    return kiks.Simulation(replace(plain, floor=floor), seed=5)


def expected(sim: kiks.Simulation, x_mm: float, y_mm: float, **place: float) -> float:
    """Return the reading at a place, free of noise."""
    sim.place(1, x_mm, y_mm, place.get("heading", 0.0))
    given = place.get("ahead", 0.0), place.get("left", 0.0), 0
    return float(read_floor(sim.world.scene, 0, 0, 0, False, *given))


def slow_mean(floor: Any, cell_mm: float, x_mm: float, y_mm: float) -> float:
    """Return the mean brightness of the points of a disc, 60 rings of 96 points."""
    radii = SPOT_MM * np.sqrt((np.arange(60) + 0.5) / 60)
    x, y = (x_mm + np.outer(radii, np.cos(ANGLES))) / cell_mm, (y_mm + np.outer(radii, np.sin(ANGLES))) / cell_mm
    return float(floor[np.floor(y).astype(int), np.floor(x).astype(int)].mean())


@pytest.mark.parametrize("cell_mm", [0.25, 0.5, 1.0])
def test_the_reading_is_the_mean_of_a_spot(cell_mm: float) -> None:
    side, rng = round(120 / cell_mm), np.random.default_rng(1)
    # Patches of 4 mm, some of them within the spot.
    floor = np.kron(rng.integers(0, 256, (30, 30), np.uint8), np.ones((side // 30, side // 30), np.uint8))
    sim = world(floor, cell_mm)
    for x_mm, y_mm in rng.uniform(35, 85, (40, 2)).tolist():
        mean = slow_mean(floor, cell_mm, x_mm, y_mm) * COUNTS / 255
        assert expected(sim, x_mm, y_mm) == pytest.approx(mean, abs=0.02 * COUNTS)


@pytest.mark.parametrize("cell_mm", [0.4, 0.7, 1.0])
def test_a_spot_on_a_plain_sees_one_brightness(cell_mm: float) -> None:
    rng = np.random.default_rng(6)
    floor = np.kron(rng.integers(0, 3, (5, 6), np.uint8), np.ones((25, 25), np.uint8))
    plains = plains_of(floor, cell_mm)
    wide = np.pad(floor, 40, mode="edge")
    for row, column in np.ndindex(plains.shape):
        # A spot whose middle is in this block sees none but these.
        reach = 40 - math.floor(SPOT_MM / cell_mm + 1)
        j, i = BLOCK * row, BLOCK * column
        seen = wide[j + reach : j + 80 + BLOCK - reach, i + reach : i + 80 + BLOCK - reach]
        assert plains[row, column] == (floor[j, i] if (seen == floor[j, i]).all() else -1)
    assert (plains >= 0).mean() > 0.1
    assert (plains < 0).mean() > 0.2


def test_a_floor_of_one_brightness_reads_the_same_everywhere() -> None:
    for brightness in (0, 77, 255):
        sim = world(np.full((150, 150), brightness, np.uint8))
        found = {expected(sim, *place) for place in np.random.default_rng(2).uniform(30, 120, (50, 2)).tolist()}
        assert found == {brightness * (COUNTS / 255)}
    assert expected(kiks.Simulation(Arena.box(150, 150)), 70.3, 81.2) == COUNTS


def test_a_world_turned_by_a_quarter_reads_the_same() -> None:
    floor = np.random.default_rng(3).integers(0, 256, (160, 160), np.uint8)
    # Row 0 is at the bottom, so that rot90 turns clockwise.
    sim, turned = world(floor), world(np.ascontiguousarray(np.rot90(floor, -1)))
    for x_mm, y_mm in (np.random.default_rng(4).integers(35 * 8, 125 * 8, (30, 2)) / 8).tolist():
        assert expected(sim, x_mm, y_mm) == expected(turned, 160 - y_mm, x_mm)
        here = expected(sim, x_mm, y_mm, heading=0.3, ahead=12.0, left=5.0)
        there = expected(turned, 160 - y_mm, x_mm, heading=0.3 + math.pi / 2, ahead=12.0, left=5.0)
        assert here == pytest.approx(there, abs=1.0)


def test_an_edge_is_crossed_evenly() -> None:
    floor = np.zeros((120, 120), np.uint8)
    floor[:, 60:] = 255
    sim = world(floor)
    found = np.array([expected(sim, 55 + 0.1 * k, 60.3) for k in range(100)])
    assert (np.diff(found) >= 0).all()
    assert np.diff(found).max() < 0.035 * COUNTS
    assert (found[0], found[-1]) == (0, COUNTS)
    assert expected(sim, 60.0, 60.0) == pytest.approx(COUNTS / 2)


def test_noise_is_fair_and_the_robots_own() -> None:
    sim = world(np.full((400, 400), 128, np.uint8))
    scene = sim.world.scene
    times_ns = range(0, 20_000, 10)
    found = np.array([[read_floor(scene, 0, 0, each, True, 0.0, 0.0, index) for index in (0, 1)] for each in times_ns])
    middle = 128 * COUNTS / 255
    assert np.abs(found - middle).max() <= NOISE_COUNTS + 0.5
    assert found.mean() == pytest.approx(middle, abs=0.5)
    assert abs(np.corrcoef(found.T)[0, 1]) < 0.1
    quiet = kiks.Simulation(sim.arena, robot=kiks.RobotSpec.load("khepera").without_noise())
    assert len({read_floor(quiet.world.scene, 0, 0, k, True, 0.0, 0.0, 0) for k in range(100)}) == 1


def test_a_sense_sees_the_same_place_at_the_end_of_a_tick() -> None:
    floor = np.random.default_rng(7).integers(0, 256, (300, 300), np.uint8)
    sim = world(floor)
    sim.place(1, 150.3, 141.7, 0.7)
    sim.fit(1, "floor")
    kiks.Khepera(sim.port(1)).set_speed(5, 9)
    sense, scene = SENSES["floor"], sim.world.scene
    found = set()
    for _ in range(40):
        sim.run(0.01)
        sim.world.tick_to(sim.world.now_ns)
        ticks = int(sim.world.state.tick_count)
        for time_ns in (ticks * TICK_NS, ticks * TICK_NS - 3_000_000):
            there = read_floor(scene, 0, ticks, time_ns, False, 0.0, 0.0, 0)
            assert sense.look(scene, 0, ticks, time_ns, is_noisy=False)[0] == there
            found.add(there)
    assert len(found) > 40


class Lines(Turret):
    """Two floor sensors of a user's own, ahead of the wheels."""

    number, name = 24, "Lines"

    def read(self) -> tuple[int, ...]:
        """R: left and right."""
        return self.site.floor(15.0, 8.0, 1), self.site.floor(15.0, -8.0, 2)

    orders = {"R": (0, read)}  # noqa: RUF012


def test_a_turret_of_a_users_own_looks_where_it_likes() -> None:
    arena = replace(Arena.box(300, 300), zones=(Zone(box_mm=((0, 155), (300, 300))),))
    sim = kiks.Simulation(arena, seed=1)
    sim.place(1, 150, 150, 0.0)
    sim.fit(1, Lines())
    left, right = kiks.Khepera(sim.port(1)).turret(24, "R")
    assert left < 2 * NOISE_COUNTS
    assert right > COUNTS - 2 * NOISE_COUNTS


def test_a_recording_with_it_replays(tmp_path: Any) -> None:
    from kiks.recording.replay import check_recording

    arena = replace(Arena.box(400, 400), zones=(Zone(disc_mm=(200, 200), radius_mm=80, brightness=40),))
    sim = kiks.Simulation(arena, seed=3)
    sim.fit(1, "floor")
    robot = kiks.Khepera(sim.port(1))
    with sim.record(tmp_path / "floor.mcap"):
        while sim.time_s < 3.0:
            (brightness,) = robot.turret(31, "F")
            robot.set_speed(*((4, -4 + brightness % 7) if brightness < 512 else (10, 10)))
    again = check_recording(kiks.Recording(tmp_path / "floor.mcap").log).sim
    assert (again.arena.zones, again.state_hash()) == (arena.zones, sim.state_hash())
    assert [turret.name for turret in again.turrets(1)] == ["Floor sensor"]
