"""Seeds that are derived from the seed of an evolution."""

from __future__ import annotations

import numpy as np

ALGORITHM, WORLDS, TRIALS, BASELINES = range(4)
"""Purposes of seeds: the algorithm, the worlds of a generation, the trials of rivals, baselines."""

TWO_SIDES = 10
"""Added to the purposes ALGORITHM and WORLDS if two sides evolve."""

TOURNAMENT, SQUARE, FINALS = 12, 13, 20
"""Purposes of seeds: the worlds of the master tournament, the order of its starts, the worlds of the finals."""


def seed_for(seed: int, purpose: int, number: int = 0) -> int:
    """Return a seed that is derived from that of an evolution.

    Args:
        seed: Seed of the evolution.
        purpose: What it is for.
        number: Number of the seed for that purpose.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(purpose, number))
    return int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(2))
