"""Random rooms: every place within a robot's reach, the same for the same seed."""

import hashlib
from functools import partial

import numpy as np
import pytest
from tests.at_length import share
from tests.model.refusals import refused

from kiks.model.arena import PAD, Arena
from kiks.model.room import GAP_MM, draw_room

WITH_ROOM_MM = 27.5 + 20


@pytest.mark.parametrize("seed", range(share(2, 4)))
def test_a_robot_reaches_every_place_of_a_room(seed: int) -> None:
    from scipy.ndimage import label

    narrow = {"width_mm": 700, "height_mm": 600, "walls": 2, "pillars": 2}
    for sizes in ({}, {"walls": 6, "pillars": 0, "lamps": 2}, narrow):
        arena = Arena.room(**sizes, seed=seed)
        wanted = {"walls": 4, "pillars": 3, "lamps": 1} | sizes
        assert [wall.disc_mm is None for wall in arena.walls] == [True] * wanted["walls"] + [False] * wanted["pillars"]
        free = arena.clearance[PAD:-PAD, PAD:-PAD] >= WITH_ROOM_MM
        parts, count = label(free)
        # Corners of the floor that only the edge of a robot fits in are no places.
        assert count == 1 or np.bincount(parts[free])[1:].max() > 0.999 * free.sum()
        assert len(arena.lamps) == wanted["lamps"]
        assert all(free[int(lamp.y_mm), int(lamp.x_mm)] for lamp in arena.lamps)


def test_free_standing_things_are_as_far_apart_as_promised() -> None:
    arena = Arena.room(walls=0, pillars=6, seed=5)
    discs = [(*wall.disc_mm, wall.radius_mm) for wall in arena.walls if wall.disc_mm and wall.radius_mm]
    for number, (x_mm, y_mm, radius_mm) in enumerate(discs):
        for other_x_mm, other_y_mm, other_mm in discs[:number]:
            assert np.hypot(x_mm - other_x_mm, y_mm - other_y_mm) >= GAP_MM + radius_mm + other_mm


def test_a_seed_always_gives_the_same_room() -> None:
    digests = [hashlib.sha256(repr(draw_room(1100, 900, 4, 3, 1, seed)).encode()).hexdigest() for seed in range(30)]
    assert len(set(digests)) == 30
    assert digests[3][:16] == "5cebfcfc44d13d6c"


def test_what_cannot_be_drawn_is_told() -> None:
    for wrong, words in (
        ({"walls": 9, "width_mm": 500, "height_mm": 500}, "rooms of 500 x 500 mm were full before they had 9 walls"),
        ({"width_mm": 300}, "width_mm must be a whole number from 500 to 3000"),
        ({"lamps": -1}, "lamps must be a whole number from 0 to 20"),
        ({"seed": -1}, "seed must be a whole number"),
    ):
        refused(words, partial(Arena.room, **wrong))
