"""Readings of KiKS 2.2.0 that students recorded (kiks-behaviour.md 3.1.1): a cross-check, as its robot was another."""

from __future__ import annotations

import numpy as np
import pytest
from tools.sensors.models import MAXIMUM_COUNTS

from kiks.engine.parameters import pack
from kiks.engine.sensing.responses import respond_all
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.model.robot import RobotSpec

# Seven inverted lengths [mm], the leftmost first, and the reading; several readings of one pattern are a mean.
PATTERNS = np.array(
    [
        (0, 41, 40, 0, 0, 0, 0, 454),
        (0, 0, 0, 0, 16, 0, 0, 5),
        (0, 0, 0, 0, 0, 39, 41, 324),
        (0, 0, 16, 0, 0, 0, 0, 81),
        (0, 0, 0, 48, 47, 47, 45, 836),
        (0, 0, 0, 0, 27, 0, 0, 11),
        (45, 47, 48, 0, 0, 0, 0, 801),
        (0, 0, 27, 0, 0, 0, 0, 192),
        (41, 0, 0, 0, 0, 0, 0, 51),
        (0, 0, 0, 0, 39, 34, 0, 204),
        (41, 40, 0, 0, 0, 0, 0, 282),
        (0, 34, 39, 0, 0, 0, 0, 422),
        (0, 0, 0, 39, 39, 0, 0, 459),
        (0, 0, 39, 39, 0, 0, 0, 455),
        (0, 0, 0, 0, 39, 39, 0, 211),
        (0, 0, 34, 39, 0, 0, 0, 372),
        (0, 29, 33, 0, 0, 0, 0, 307),
        (0, 0, 0, 0, 0, 39, 35, 276),
        (0, 0, 0, 0, 0, 31, 33, 161),
        (0, 33, 0, 0, 0, 0, 0, 20),
        (0, 0, 0, 0, 0, 35, 0, 10),
        (0, 0, 0, 0, 0, 0, 34, 43),
        (29, 0, 0, 0, 0, 0, 0, 6),
        (0, 0, 0, 10, 0, 0, 0, 28),
        (0, 0, 10, 0, 0, 0, 0, 63),
    ],
    np.float64,
)
INVERTED_MM = np.repeat(PATTERNS[:, None, :7], 8, axis=1)


@pytest.mark.parametrize("response", ["thesis", "reflection"])
def test_what_was_large_there_is_large_here(response):
    """Each ray is taken to meet its surface squarely, as the patterns do not tell."""
    robot, counts = RobotSpec.load("khepera", response=response), np.empty((len(PATTERNS), 8))
    cosines = np.where(INVERTED_MM > 0.0, 1.0, 0.0)
    respond_all(networks_for(response), pack(robot), 50.0 - INVERTED_MM, cosines, counts)
    means = counts.mean(axis=1)
    assert np.corrcoef(means, PATTERNS[:, 7])[0, 1] >= 0.8
    assert means[PATTERNS[:, 7] > 800].min() > 0.9 * MAXIMUM_COUNTS
