"""Many episodes at once, one per world: the common part of single, vector and multi-agent environments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.batch.batch import Batch
from kiks.batch.initial_state import random_starts
from kiks.control.measure import Measure
from kiks.control.measures import contacts, path_mm
from kiks.control.senses import sense_of
from kiks.errors import ParameterError, counted, shown
from kiks.export.pictures import Picture
from kiks.learn.environments import find_environment
from kiks.learn.task import Task

PLACE_COUNT = 1000
"""Number of free places in an arena from which starts are drawn."""

CLEAR_MM = 5.0
"""Smallest gap between a start and anything else [mm]."""

SEED_LIMIT = 2**63 - 1

PICTURE_SIDE_PX = 480
"""Length of the longer side of a rendered picture [pixels]."""


def checked_action(action: ArrayLike, shape: tuple[int, ...], name: str = "the action") -> NDArray[Any]:
    """Return an action of a robot, or of several, as an array of the shape of its action space."""
    try:
        given = np.asarray(action)
    except (TypeError, ValueError, OverflowError):
        given = np.zeros(0)
    if given.shape != shape or given.dtype.kind not in "fiu":
        raise ParameterError(
            f"{name} must be numbers of the shape {shape}, the speeds of the left and the right wheel, but "
            f"{shown(action)} was given."
        )
    return given


class Episodes:
    """Worlds in which robots act step by step, with observations and rewards.

    An episode depends on the random generator with which it begins, which draws its arena too, not on its world's
    number: two worlds with equal generators and actions give the same episode, to the bit.

    Args:
        task: The environment: a task with a reward.
        worlds: Number of worlds.
        response: Response of the proximity sensors, if not that of the robot's file.
        threads: Number of threads; the number of cores if left out.

    Attributes:
        step_counts: Number of steps of each world's episode, int64 [world].
    """

    def __init__(self, task: Task, worlds: int = 1, *, response: str | None = None, threads: int | None = None) -> None:
        self.task, self.senses = task, task.controller.senses
        reward: Any = find_environment(task).reward
        self._reward: Measure = reward
        ends = () if task.until is None else (task.until,)
        self.batch = Batch(
            task.arenas,
            worlds,
            robot=task.sides[0].specs[0],
            robots=task.robots,
            senses=self.senses,
            timing=task.timings[0],
            response=response,
            threads=threads,
            measures=(self._reward, path_mm, contacts, *ends),
        )
        self._until_note = self._reward.note_count + 2 if ends else None
        self._body = self.batch.specs[0].body
        self._places = [self._free_places(arena) for arena in self.batch.arenas] if task.starts == "random" else []
        self._sensors = np.zeros((worlds, task.robots, task.controller.sensor_count))
        self._most = np.concatenate([np.full(each.size, each.most) for each in map(sense_of, self.senses)])
        self._scores = np.zeros((worlds, task.robots))
        self._rngs: dict[int, np.random.Generator] = {}
        self.step_counts = np.zeros(worlds, np.int64)

    def begin(self, worlds: ArrayLike, seeds: Sequence[int | None] | None = None) -> None:
        """Begin new episodes in some worlds; the first call must name all worlds.

        Args:
            worlds: Their numbers, int64 [world].
            seeds: Seed of the random generator of each of them, from which its arena, if there are several, its seed
                and its start are drawn; None where the generator continues, or begins at random.
        """
        chosen, arena_count = np.asarray(worlds, np.int64), len(self.batch.arenas)
        for world, seed in zip(chosen.tolist(), [None] * len(chosen) if seeds is None else seeds, strict=True):
            if seed is not None or world not in self._rngs:
                self._rngs[world] = np.random.default_rng(seed)
        rngs = [self._rngs[world] for world in chosen.tolist()]
        if arena_count > 1:
            self.batch.take_arenas(chosen, [int(rng.integers(arena_count)) for rng in rngs])
        drawn = np.array([rng.integers(SEED_LIMIT) for rng in rngs], np.int64)
        starts = None
        if self._places:
            pairs = zip(chosen.tolist(), rngs, strict=True)
            starts = np.array([self._draw_starts(world, rng) for world, rng in pairs])
        selected = None if len(chosen) == self.batch.world_count else chosen
        self._sensors = self.batch.reset(selected, seeds=drawn, starts=starts)
        self._scores[chosen], self.step_counts[chosen] = 0.0, 0

    def step(self, actions: NDArray[Any], ignored: NDArray[np.bool_] | None = None) -> NDArray[np.float64]:
        """Let all robots act, then read their sensors.

        Args:
            actions: Speeds of the left and right wheels as shares of the speed limit, [world, robot, 2], which
                `checked_action` has checked.
            ignored: Worlds whose actions do not count, bool [world]: their robots stand.

        Returns:
            Rewards, float64 [world, robot].
        """
        if ignored is not None:
            actions = np.where(ignored[:, None, None], 0, actions)
        if not (np.abs(actions) <= 1).all():
            raise ParameterError(
                f"actions must be from -1 to 1, but among them was {actions[~(np.abs(actions) <= 1)][0]}. Clip them, "
                "for example with gymnasium.wrappers.ClipAction."
            )
        self._sensors = self.batch.step(actions * self.task.speed_limit)
        self.step_counts += 1
        before, self._scores = self._scores, self.batch.notes[:, :, 0].copy()
        return self._scores - before

    def observations(self) -> NDArray[np.float32]:
        """Return the last readings as shares of the largest count, float32 [world, robot, sensor]."""
        return np.asarray(self._sensors / self._most, np.float32)

    def terminations(self) -> NDArray[np.bool_]:
        """Return whether a robot of each world has ended its episode, bool [world]."""
        if self._until_note is None:
            return np.zeros(self.batch.world_count, np.bool_)
        ended: NDArray[np.bool_] = np.any(self.batch.notes[:, :, self._until_note] > 0, axis=1)
        return ended

    def infos(self) -> dict[str, NDArray[np.float64]]:
        """Return time_s, path_mm and contacts since the episodes began, each float64 [world, robot]."""
        first = self._reward.note_count
        paths_mm, contact_counts = (self.batch.notes[:, :, first + k].copy() for k in range(2))
        times_s = np.repeat(self.batch.times_s[:, None], self.batch.robot_count, axis=1)
        return {"time_s": times_s, "path_mm": paths_mm, "contacts": contact_counts}

    def picture(self, world: int) -> NDArray[np.uint8]:
        """Return a world from above, uint8 [row, column, 3]."""
        batch = self.batch
        bodies: Any = batch.state.bodies[world]
        arena = batch.arenas[batch.arena_indices[world]]
        picture = Picture(arena, batch.lamps[world], bodies, batch.poses[world], batch.specs)
        return np.asarray(picture.image(longest_side=PICTURE_SIDE_PX))

    # ---- inside ----

    def _free_places(self, arena: Any) -> NDArray[np.float64]:
        return random_starts(arena, PLACE_COUNT, seed=0, radius_mm=self._body.radius_mm, clear_mm=CLEAR_MM)

    def _draw_starts(self, world: int, rng: np.random.Generator) -> list[list[float]]:
        """Return start poses of a world's robots that do not overlap."""
        places = self._places[self.batch.arena_indices[world]]
        distance_min_mm = 2 * self._body.radius_mm + self.task.apart_mm
        taken: list[list[float]] = []
        for _ in range(100 * self.batch.robot_count):
            pose = places[rng.integers(len(places))].tolist()
            if all(math.hypot(pose[0] - other[0], pose[1] - other[1]) >= distance_min_mm for other in taken):
                taken.append(pose)
                if len(taken) == self.batch.robot_count:
                    return taken
        raise ParameterError(
            f"the arena must have room for {counted(self.batch.robot_count, 'robot')}, but places for only "
            f"{len(taken)} were found. Take a larger one, or fewer robots."
        )
