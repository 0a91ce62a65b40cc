"""Fits: a made-up robot on a made-up rig is found again; the square test undoes a wrong track and wrong wheels."""

import math
from dataclasses import replace

import numpy as np
import pytest

from kiks import ParameterError, RobotSpec
from kiks.fit.robot_fit import Rig, find_rigs, fit_robot, predict
from kiks.fit.samples import Samples
from kiks.fit.umbmark import square_test

GAPS_MM = np.arange(5.0, 41.0, 4.0)
ANGLES_DEG = np.tile(np.arange(0.0, 360.0, 8.0), (len(GAPS_MM), 1))
BASE = RobotSpec.load("khepera")


def robot(rng):
    """A robot whose sensors are not those of its kind."""
    proximity, reflection = BASE.proximity, BASE.reflection
    return BASE.with_changes(
        proximity__mount_angle_deg=tuple(proximity.mount_angle_deg + rng.uniform(-4, 4, 8)),
        proximity__direction_deg=tuple(proximity.direction_deg + rng.uniform(-4, 4, 8)),
        reflection__light=tuple(reflection.light * rng.uniform(0.8, 1.25, 8)),
        reflection__threshold=tuple(reflection.threshold + rng.uniform(-0.05, 0.05, 8)),
    )


def rig(rng):
    errors = rng.normal(0.0, (0.4, 0.8, 1.5), (len(GAPS_MM), 3)).T
    return Rig(*(errors - errors.mean(axis=1, keepdims=True)))


def samples(spec, name, radius_mm, true_rig, rng):
    empty = Samples(name, radius_mm, GAPS_MM, ANGLES_DEG, np.zeros((*ANGLES_DEG.shape, 8), np.int64))
    counts = predict(spec, true_rig.moved(empty)) + rng.normal(0.0, 10.0, empty.counts.shape)
    return replace(empty, counts=np.clip(np.rint(counts), 0, 1023).astype(np.int64))


@pytest.fixture(scope="module")
def made_up():
    rng = np.random.default_rng(3)
    spec, rigs = robot(rng), (rig(rng), rig(rng))
    tables = [samples(spec, "wall", math.inf, rigs[0], rng), samples(spec, "post", 20.0, rigs[1], rng)]
    return spec, rigs, tables


@pytest.mark.slow
def test_a_robot_and_its_rig_are_found(made_up):
    spec, rigs, tables = made_up
    found = fit_robot(tables, BASE)
    assert np.subtract(found.spec.proximity.direction_deg, spec.proximity.direction_deg) == pytest.approx(0, abs=2.5)
    for table, before, after in zip(tables, rigs, found.rigs, strict=True):
        saw = ((table.counts > 20) & (table.counts < 1000)).any(axis=(1, 2))
        assert np.sqrt(np.mean((before.gap_mm - after.gap_mm)[saw] ** 2)) < 0.25
        assert np.sqrt(np.mean((before.angle_deg - after.angle_deg)[saw] ** 2)) < 0.5
        answers = predict(found.spec, after.moved(table))
        truth = predict(spec, before.moved(table))
        assert np.abs(answers - truth).mean() < 3.0


def test_the_rig_of_a_known_robot_is_found(made_up):
    spec, rigs, tables = made_up
    for before, after in zip(rigs, find_rigs(tables, spec), strict=True):
        assert np.abs(before.gap_mm - after.gap_mm)[:5].max() < 0.2
        assert np.abs(before.angle_deg - after.angle_deg)[:5].max() < 0.5


def test_a_rig_moves_poses_and_nothing_else():
    table = Samples("wall", math.inf, GAPS_MM, ANGLES_DEG, np.zeros((*ANGLES_DEG.shape, 8), np.int64))
    ones = np.ones(len(GAPS_MM))
    moved = Rig(0.5 * ones, 2.0 * ones, 3.6 * ones).moved(table)
    assert moved.gap_mm.tolist() == (GAPS_MM + 0.5).tolist()
    assert moved.angle_deg[0, [0, 22, 44]].tolist() == pytest.approx([2.0 - 1.76, 176 + 2.0, 352 + 2.0 + 1.76])
    assert moved.counts is table.counts


def test_what_cannot_be_fitted_is_said():
    empty = Samples("wall", math.inf, GAPS_MM, ANGLES_DEG, np.zeros((*ANGLES_DEG.shape, 8), np.int64))
    thesis, far, one = RobotSpec.load("khepera", response="thesis"), [[-1e6, 0.0]], [[1.0, 1.0]]
    for ask, words in (
        (lambda: fit_robot([empty], BASE), "readings between 20 and 1000, but there are none"),
        (lambda: fit_robot([empty], thesis), "must have the response 'reflection', but 'Khepera' has 'thesis'"),
        (
            lambda: square_test(np.empty((0, 2)), one, side_mm=500.0, track_mm=53.0),
            "clockwise_mm must have the end of one",
        ),
        (
            lambda: square_test(far, far, side_mm=500.0, track_mm=53.0),
            "must lie nearer to the start of squares of 500 mm",
        ),
    ):
        with pytest.raises(ParameterError, match=words):
            ask()


def end_of_square(turn: int, *, side_mm: float, believed_mm: float, track_mm: float, ratio: float) -> list[float]:
    """Return where a robot ends that drives by its wheels' ways: arcs, added up in small steps."""
    factors = 2 / (ratio + 1), 2 * ratio / (ratio + 1)
    x, y, heading = 0.0, 0.0, 0.0
    corner_mm = turn * 0.25 * math.pi * believed_mm
    for left_mm, right_mm in 4 * [(side_mm, side_mm), (-corner_mm, corner_mm)]:
        for _ in range(1000):
            left, right = (way * factor / 1000 for way, factor in zip((left_mm, right_mm), factors, strict=True))
            turned = (right - left) / track_mm
            x += 0.5 * (left + right) * math.cos(heading + 0.5 * turned)
            y += 0.5 * (left + right) * math.sin(heading + 0.5 * turned)
            heading += turned
    return [x, y]


@pytest.mark.parametrize("track_mm", [52.5, 53.0, 53.6])
@pytest.mark.parametrize("ratio", [0.997, 1.0, 1.002])
def test_it_finds_track_and_ratio(track_mm: float, ratio: float) -> None:
    robot = {"side_mm": 500.0, "believed_mm": 53.0, "track_mm": track_mm, "ratio": ratio}
    test = square_test([end_of_square(-1, **robot)], [end_of_square(1, **robot)], side_mm=500.0, track_mm=53.0)
    assert test.track_mm == pytest.approx(track_mm, rel=1.5e-3)
    assert test.ratio - 1 == pytest.approx(ratio - 1, rel=0.06, abs=1e-6)
    assert test.right / test.left == pytest.approx(test.ratio)
    assert test.left + test.right == pytest.approx(2.0)


def test_it_gives_the_published_constants_of_a_larger_robot() -> None:
    # The clusters of a LabMate follow from the constants that Borenstein and Feng found, in squares of 4 m.
    test = square_test([[63.0, 63.0]], [[230.0, -209.0]], side_mm=4000.0, track_mm=340.0)
    assert test.ratio == pytest.approx(1.00084, abs=5e-5)
    assert test.track_mm == pytest.approx(336.17, rel=4e-4)
    assert test.error_mm == pytest.approx(311.0, abs=0.5)
