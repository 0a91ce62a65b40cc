"""The response 'reflection': light that comes back from walls, posts and corners, however their cells lie.

Tolerances are what was found, rounded up, where geometry says that two readings are the same: a surface in a raster is
half a cell off, and where a sensor answers at all its reading falls by up to 100 counts a millimetre.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.at_length import share

import kiks
from kiks.fit.robot_fit import predict
from kiks.fit.samples import Samples
from kiks.model.arena import PAD, Arena
from kiks.model.raster import unpack_faces
from kiks.model.robot import SENSOR_COUNT, RobotSpec

pytestmark = pytest.mark.slow

KHEPERA = RobotSpec.load("khepera")
RADIUS_MM = KHEPERA.body.radius_mm
BASELINE = KHEPERA.proximity.baseline_counts[0]
SIDE_MM, MIDDLE_MM = 400.0, 200.0

Inside = Callable[[Any, Any], Any]
"""Says of places, seen from the middle of an arena [mm], whether they are wall."""


def arena_of(inside: Inside, cell_mm: float, *, brightness: int = 255) -> Arena:
    x_mm = (np.arange(int(SIDE_MM / cell_mm)) + 0.5) * cell_mm - MIDDLE_MM
    wall = np.broadcast_to(inside(x_mm[None, :], x_mm[:, None]), (len(x_mm), len(x_mm)))
    return Arena(wall.astype(np.uint8) * brightness, cell_mm, "drawn")


def world(inside: Inside, cell_mm: float = 0.25, *, brightness: int = 255) -> kiks.Simulation:
    return kiks.Simulation(arena_of(inside, cell_mm, brightness=brightness))


def disc(radius_mm: float, x_mm: float = 0.0, y_mm: float = 0.0) -> Inside:
    return lambda x, y: np.hypot(x - x_mm, y - y_mm) <= radius_mm


def half_plane(normal_rad: float = 0.0, from_mm: float = 0.0) -> Inside:
    return lambda x, y: x * math.cos(normal_rad) + y * math.sin(normal_rad) >= from_mm


def read(sim: kiks.Simulation, x_mm: Any, y_mm: Any, heading_rad: Any) -> np.ndarray:
    """Return what the robot expects at places seen from the middle of the arena, shape [place, 8]."""
    poses = np.broadcast_arrays(np.atleast_1d(x_mm) + MIDDLE_MM, y_mm + MIDDLE_MM, heading_rad)
    return sim.proximity_at(1, np.stack(poses, axis=1))


def facing(sensor: int) -> float:
    """Return the heading of a robot one of whose sensors looks in the direction of the x axis [rad]."""
    return -math.radians(KHEPERA.proximity.direction_deg[sensor])


def random_world(rng: np.random.Generator, *, brightness: int = 255) -> kiks.Simulation:
    """Return a robot among posts and boxes."""
    picture = np.zeros((700, 700), np.uint8)
    rows, columns = np.mgrid[:700, :700]
    for _ in range(rng.integers(3, 9)):
        i, j, size = (int(v) for v in rng.integers((0, 0, 2), (700, 700, 60)))
        if rng.integers(2):
            picture[i : i + size, j : j + int(rng.integers(1, 80))] = brightness
        else:
            picture[(rows - i) ** 2 + (columns - j) ** 2 <= size**2] = brightness
    return kiks.Simulation(Arena(picture, float(rng.choice((0.5, 1.0))), "random"), seed=int(rng.integers(1000)))


def free_poses(sim: kiks.Simulation, rng: np.random.Generator, count: int, gap_mm: float) -> list[tuple[float, ...]]:
    """Return random poses, x, y [mm] and heading [rad], at least so far from walls; fewer where there is no room."""
    found = []
    for _ in range(40 * count):
        x, y = rng.uniform(0, sim.arena.width_mm), rng.uniform(0, sim.arena.height_mm)
        if len(found) < count and sim.arena.clearance_at_mm(x, y) > RADIUS_MM + gap_mm:
            found.append((x, y, rng.uniform(-math.pi, math.pi)))
    return found


def test_nothing_within_60_mm_is_nothing_and_no_reading_leaves_the_converters_range() -> None:
    rng, checked = np.random.default_rng(1), 0
    readings, noisy = [], []
    for _ in range(8):
        sim = random_world(rng)
        for pose in free_poses(sim, rng, 40, 60.0):
            sim.place(1, *pose)
            assert sim.proximity(1) == [BASELINE] * 8
            for _ in range(5):
                sim.run(0.02)
                assert max(sim.proximity(1, noise=True)) <= 20
            checked += 1
        for pose in free_poses(sim, rng, 45, 0.1):
            sim.place(1, *pose)
            sim.run(0.02)
            readings.append(sim.proximity(1))
            noisy.append(sim.proximity(1, noise=True))
    assert checked > 150
    for counts in (np.array(readings), np.array(noisy)):
        assert 0 <= counts.min() < 20
        assert counts.max() == 1023
        assert ((counts > 100) & (counts < 900)).sum() > 50


@pytest.mark.parametrize("cell_mm", [0.25, 1.0])
def test_straight_towards_a_wall_a_reading_rises_to_saturation(cell_mm):
    sim = world(half_plane(), cell_mm)
    gaps_mm = np.arange(70.0, 0.0, -0.1)
    for sensor in range(SENSOR_COUNT):
        counts = read(sim, -RADIUS_MM - gaps_mm, 0.13, facing(sensor))[:, sensor]
        assert np.diff(counts).min() >= 0
        assert np.diff(counts).max() < 20  # a tenth of a millimetre
        assert counts[0] == BASELINE
        assert np.all(counts[gaps_mm < 5] == 1023)
        # As far as the real ones: they are at half between 18 and 28 mm (README of the Khepera samples).
        assert 17 < gaps_mm[np.argmax(counts > 511)] < 29


def test_a_brighter_surface_never_reads_less():
    for seed in range(share(1, 4)):
        worlds = [random_world(np.random.default_rng(seed), brightness=shade) for shade in (1, 40, 100, 180, 255)]
        poses = free_poses(worlds[0], np.random.default_rng(seed), 100, 0.5)
        rows = np.array([sim.proximity_at(1, np.array(poses)) for sim in worlds])
        assert np.diff(rows, axis=0).min() >= 0
        assert (rows[-1] - rows[0]).max() > 200


def beside_walls(cell_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Return distances of sensors from a wall that they face [mm], and what each reads, shape [8, distances]."""
    sim, away_mm = world(half_plane(), cell_mm), np.arange(1.5, 60.0, 0.25)
    counts = np.full((SENSOR_COUNT, len(away_mm)), 1023.0)
    for sensor in range(SENSOR_COUNT):
        place = math.radians(KHEPERA.proximity.mount_angle_deg[sensor]) + facing(sensor)
        ahead_mm = KHEPERA.proximity.mount_radius_mm[sensor] * math.cos(place)
        is_free = away_mm + ahead_mm > RADIUS_MM + 0.1
        counts[sensor, is_free] = read(sim, -away_mm[is_free] - ahead_mm, 0.0, facing(sensor))[:, sensor]
    return away_mm, counts


@pytest.mark.parametrize("cell_mm", [0.25, 1.0])
def test_posts_and_corners_are_less_than_a_wall_that_is_as_near(cell_mm):
    """Seen from a sensor. What a robot with its sensors inside a surface would read is not asked."""
    rng = np.random.default_rng(6)
    away_mm, by_wall = beside_walls(cell_mm)
    mounts_rad = np.radians(KHEPERA.proximity.mount_angle_deg)
    things: list[tuple[Inside, Callable[[Any, Any], Any]]] = [
        (lambda x, y: (x >= 0) & (y >= 0), lambda x, y: np.hypot(np.maximum(-x, 0.0), np.maximum(-y, 0.0))),
    ]
    for radius_mm in (2.0, 3.0, 6.0, 12.0):
        things.append((disc(radius_mm), lambda x, y, radius_mm=radius_mm: np.hypot(x, y) - radius_mm))
    for inside, distance in things:
        poses = rng.uniform((-70, -70, -math.pi), (70, 70, math.pi), (share(600, 2500), 3))
        x, y, heading = poses[distance(*poses.T[:2]) > RADIUS_MM + 1.5 * cell_mm].T
        counts = read(world(inside, cell_mm), x, y, heading)
        angles = mounts_rad + heading[:, None]
        away = distance(26.5 * np.cos(angles) + x[:, None], 26.5 * np.sin(angles) + y[:, None])
        most = np.stack([np.interp(away[:, k], away_mm, by_wall[k]) for k in range(SENSOR_COUNT)], axis=1)
        assert np.all(counts >= BASELINE)
        assert np.all(counts <= most + 15.0)
        assert np.sum((counts > 20) & (counts < 1000)) > 20


def test_readings_are_those_of_geometry_however_cells_lie():
    """Shifted by parts of a cell and turned by any angle, against rays that meet a circle or a line exactly."""
    for radius_mm, cell_mm, largest, usual in (
        (12.0, 1.0, 125.0, 33.0),
        (12.0, 0.25, 30.0, 9.0),
        (27.0, 1.0, 80.0, 17.0),
        (27.0, 0.25, 20.0, 4.5),
        (math.inf, 1.0, 36.0, 9.0),
        (math.inf, 0.25, 8.0, 2.0),
    ):
        rng = np.random.default_rng(7)
        gaps_mm, angles_deg = np.array([4.0, 8.0, 12.0, 16.0, 20.0, 25.0]), np.arange(0.0, 360.0, 15.0)
        shape = (len(gaps_mm), len(angles_deg))
        samples = Samples("object", radius_mm, gaps_mm, np.broadcast_to(angles_deg, shape), np.zeros((*shape, 8), int))
        exact = predict(KHEPERA, samples).reshape(-1, 8)
        is_wall, behind_mm = math.isinf(radius_mm), 0.0 if math.isinf(radius_mm) else radius_mm
        away_mm, angles = np.repeat(behind_mm + RADIUS_MM + gaps_mm, len(angles_deg)), np.tile(angles_deg, len(gaps_mm))
        active, errors = (exact > 20) & (exact < 1000), []
        assert active.sum() > 40
        for _ in range(share(3, 5)):
            (x, y), turn = rng.uniform(-cell_mm, cell_mm, 2), rng.uniform(-math.pi, math.pi)
            ahead, aside = math.cos(turn), math.sin(turn)
            sim = world(half_plane(turn, x * ahead + y * aside) if is_wall else disc(radius_mm, x, y), cell_mm)
            error = read(sim, x - away_mm * ahead, y - away_mm * aside, turn + np.radians(angles)) - exact
            assert np.abs(error).max() < largest
            errors.append(error[active])
        assert np.sqrt(np.mean(np.array(errors) ** 2)) < usual


def normals(arena: Arena) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles of cells that have a normal, seen from the middle of the arena [mm], and these."""
    row, column = np.nonzero(arena.faces)
    places = (np.stack([column, row], axis=1) - PAD + 0.5) * arena.mm_per_cell - MIDDLE_MM
    inner = np.abs(places).max(axis=1) < MIDDLE_MM - 20.0  # beyond the edge of the arena is wall, too
    return places[inner], unpack_faces(arena.faces)[row[inner], column[inner], :2]


@pytest.mark.parametrize("cell_mm", [0.25, 1.0])
def test_normals_of_a_disc_point_to_its_middle(cell_mm):
    for radius_mm in (6.0, 12.0, 27.0):
        places, inward = normals(arena_of(disc(radius_mm, 0.3 * cell_mm, -0.2 * cell_mm), cell_mm))
        assert len(places) > 4 * radius_mm / cell_mm
        assert np.hypot(*inward.T) == pytest.approx(1.0, abs=1e-3)
        inward = inward / np.hypot(*inward.T)[:, None]
        towards = np.array([0.3, -0.2]) * cell_mm - places
        cosine = np.sum(inward * towards, axis=1) / np.hypot(*towards.T)
        assert np.degrees(np.arccos(np.minimum(cosine, 1.0))).max() < (5.0 if cell_mm == 1.0 else 1.5)


@pytest.mark.parametrize("cell_mm", [0.25, 1.0])
def test_normals_of_an_upright_wall_are_exact_on_both_sides(cell_mm):
    """From one cell thick on, to 0.7 degrees."""
    for thickness in (1, 3, 40):
        arena = arena_of(lambda x, y, end=thickness * cell_mm: (x > 0) & (x < end), cell_mm)
        places, inward = normals(arena)
        inner = np.abs(places[:, 1]) < MIDDLE_MM - 40.0
        left, right = inner & (places[:, 0] < 0), inner & (places[:, 0] >= 0)
        assert left.sum() == right.sum() > 100
        for side, ahead in ((left, 1.0), (right, -1.0)):
            assert inward[side] == pytest.approx(np.tile((ahead, 0.0), (side.sum(), 1)), abs=0.012)


def test_every_cell_by_a_wall_has_a_normal_into_it():
    rng = np.random.default_rng(8)
    for _ in range(4):
        arena = random_world(rng).arena
        touches = (arena.clearance > 0) & (arena.clearance < 1.2 * arena.mm_per_cell)
        faces = unpack_faces(arena.faces)
        length = np.hypot(faces[..., 0], faces[..., 1])
        assert np.mean(length[touches] > 0) > 0.999  # the middle of a gap of a cell has none
        assert length[length > 0] == pytest.approx(1.0, abs=1e-3)
        row, column = np.nonzero(touches & (length > 0))
        x, y, _ = faces[row, column].T
        # Two cells on it is wall, or nearer to one.
        ahead = arena.clearance[np.rint(row + 2 * y).astype(int), np.rint(column + 2 * x).astype(int)]
        assert np.mean(ahead < arena.clearance[row, column]) > 0.99
