"""The e-puck's proximity sensors against what four sources and a real robot say of a white wall ahead."""

import numpy as np
import pytest

from kiks.fit.calibrate import facing_counts
from kiks.model.robot import RobotSpec

# epuck-protocol.md 6.2, the four formulas and tables in their ranges, and 8, a run of a real robot whose ways are about
# 0.57 mm a row: gap [mm] and counts of each.
SOURCES = {
    "Webots": ([10, 15, 20, 30, 40, 50, 60, 70], [1466, 601, 384, 235, 158, 120, 104, 67]),
    "Enki": ([0, 5, 10, 15, 20, 30], [2966, 2746, 1666, 1011, 613, 226]),
    "Player": ([20, 30, 40, 50, 60, 70], [924, 358, 281, 204, 126, 49]),
    "ROS": ([15, 20, 30, 40, 50, 60, 70], [1111, 625, 278, 156, 100, 69, 51]),
    "a real robot": (
        [0, 2.9, 5.7, 8.6, 11.4, 14.3, 17.2, 20, 25.7],
        [3495, 3516, 3205, 2061, 1146, 884, 605, 490, 268],
    ),
}


def expected(gaps_mm: list[float]) -> np.ndarray:
    """Return what the two sensors at the front read at gaps from the wall, without baseline, in the mean."""
    return facing_counts(RobotSpec.load("epuck"), gaps_mm)[:, [0, 7]].mean(axis=1)


@pytest.mark.parametrize("source", SOURCES)
def test_the_response_is_as_near_to_each_source_as_they_are_to_each_other(source: str) -> None:
    gaps_mm, counts = SOURCES[source]
    ratio = np.log(expected(gaps_mm) / np.array(counts))
    assert np.abs(ratio).max() < np.log(3.5)
    assert np.abs(ratio).mean() < np.log(2.2)


def test_it_is_nearest_to_the_real_robot() -> None:
    errors = {
        name: np.abs(np.log(expected(gaps) / np.array(counts))).mean() for name, (gaps, counts) in SOURCES.items()
    }
    assert min(errors, key=errors.__getitem__) == "a real robot"
    assert errors["a real robot"] < np.log(1.15)


def test_it_falls_with_the_distance_and_ends_in_contact_at_the_most() -> None:
    counts = facing_counts(RobotSpec.load("epuck"), list(np.arange(0.0, 100.0, 2.0)))
    assert (np.diff(counts, axis=0) <= 0).all()
    assert (counts[0] > 2900).all()
    assert (counts[-1] < 15).all()
