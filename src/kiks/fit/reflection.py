"""Fit the response 'reflection' to samples: the robot that would have read what the real one read, and its rig.

Need: places, directions, light, thresholds and lobes of eight sensors, and four constants that they share
(`kiks.model.robot.Reflection`), from sweeps at several gaps from walls and round posts.

Assumption: the poses of the tables are nearly right. How each sweep differed (`Rig`) is found together with the
robot; else its errors, which are larger than the sensors' noise, would be taken for properties of the sensors.

Method: robust least squares (soft L1), all tables at once. No reading depends on another sensor's or another sweep's
numbers, so a Jacobian takes twelve predictions. Weak priors hold what the samples do not show; the mean errors of an
object's sweeps are held at 0, as they would only stand for another robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kiks.engine.parameters import RAY_COUNT, pack, ray_offsets_deg
from kiks.engine.sensing.responses import respond_all
from kiks.errors import ParameterError
from kiks.fit.samples import Fan, Floats, Samples, is_active, meet
from kiks.model.robot import SENSOR_COUNT, RobotSpec


@dataclass(frozen=True, eq=False)
class Rig:
    """How each sweep differed from what its table says.

    Args:
        gap_mm: How much wider the gap was [mm], shape [gaps].
        angle_deg: How much larger the angle was half way round [deg], shape [gaps].
        turn_deg: How much farther than once around the robot went [deg], shape [gaps].
    """

    gap_mm: Floats
    angle_deg: Floats
    turn_deg: Floats

    @classmethod
    def exact(cls, gap_count: int) -> Rig:
        """Return the rig whose tables are right."""
        return cls(*np.zeros((3, gap_count)))

    def moved(self, samples: Samples) -> Samples:
        """Return the samples with the poses at which they were really taken."""
        # The angle grows by about one turn from the first column of a sweep to the last.
        share = samples.angle_deg / 360.0 - 0.5
        angle_deg = samples.angle_deg + self.angle_deg[:, None] + self.turn_deg[:, None] * share
        return replace(samples, gap_mm=samples.gap_mm + self.gap_mm, angle_deg=angle_deg)


ERROR_COUNTS = 30.0
"""About what a reading is off from a smooth curve along the angle (README of the samples) [counts]."""

GAP_ERROR_MM, ANGLE_ERROR_DEG, TURN_ERROR_DEG = 1.0, 1.0, 3.0
"""How far sweeps are taken to differ from their tables."""

ASIDE_DEG, PRIOR_LOG_LIGHT, PRIOR_LOG_LOBE, PRIOR_THRESHOLD = 5.0, 1.0, 0.2, 0.5
"""How far a sensor is taken to look aside from its place, and to differ from the mean of all."""

_SIDE_DEG = 100.0  # cells farther from a sensor's axis are left out: they tell nothing
_SENSOR_STEPS = {"place_deg": 0.05, "direction_deg": 0.05, "log_light": 1e-4, "threshold": 1e-4, "log_lobe": 1e-4}
_SHARED_STEPS = {"log_behind": 1e-4, "log_faint": 1e-3, "log_bright": 1e-3}
_RIG_STEPS = {"gap_mm": 1e-3, "angle_deg": 0.01, "turn_deg": 0.02}
_RIG_PRIORS = (GAP_ERROR_MM, ANGLE_ERROR_DEG, TURN_ERROR_DEG)
_CENTRE = 1e-3  # how far the mean error of an object's sweeps may be from 0, in standard deviations
_ROOM = np.array([30.0, 30.0, 3.0, 0.29, 1.5])  # of a sensor's numbers around the start
_SHARED_ROOM = np.array([2.0, 2.0, 2.0])


@dataclass(frozen=True)
class ReflectionFit:
    """The result of a fit.

    Attributes:
        spec: The robot.
        rigs: For each table, how its sweeps differed.
    """

    spec: RobotSpec
    rigs: tuple[Rig, ...]


def predict(spec: RobotSpec, samples: Samples) -> Floats:
    """Return what a robot with the response 'reflection' expects to read before a white object.

    Returns:
        Counts, shape [gaps, angles, 8].
    """
    proximity = spec.proximity
    fan = Fan.spread(
        proximity.mount_angle_deg,
        proximity.mount_radius_mm,
        proximity.direction_deg,
        range_mm=proximity.range_mm,
        offsets_deg=ray_offsets_deg(proximity.field_of_view_deg),
    )
    length_mm, cosine = (part.reshape(-1, SENSOR_COUNT, RAY_COUNT) for part in meet(samples, fan))
    counts = np.empty(samples.counts.shape)
    respond_all(pack(spec), length_mm, cosine, counts.reshape(-1, SENSOR_COUNT))
    return np.minimum(counts + proximity.baseline_counts, proximity.maximum_counts)


def fit_reflection(tables: Sequence[Samples], base: RobotSpec, *, steps: int = 40) -> ReflectionFit:
    """Return the robot, like `base` otherwise, that explains the samples best.

    Args:
        tables: Samples of white objects.
        base: Where the search begins; a robot with the response 'reflection'.
        steps: Most steps of the search.
    """
    return _Search(tables, base).run(steps, is_robot_free=True)


def find_rigs(tables: Sequence[Samples], spec: RobotSpec, *, steps: int = 20) -> tuple[Rig, ...]:
    """Return how the sweeps of tables differed, seen by a robot that is known."""
    return _Search(tables, spec).run(steps, is_robot_free=False).rigs


def active_pairs(spec: RobotSpec, tables: Sequence[Samples]) -> tuple[Floats, Floats]:
    """Return what a robot expects for the active samples and what was measured [counts], both of shape [samples]."""
    active = [(predict(spec, table), table.counts, is_active(table.counts)) for table in tables]
    answers, readings = zip(*((answer[tells], counts[tells]) for answer, counts, tells in active), strict=True)
    return np.concatenate(answers), np.concatenate(readings).astype(np.float64)


class _Search:
    """One least-squares problem: five unknowns of each sensor, three that all share, three of each sweep."""

    def __init__(self, tables: Sequence[Samples], base: RobotSpec) -> None:
        if base.reflection is None or base.proximity.response != "reflection":
            raise ParameterError(
                f"the robot to begin with must have the response 'reflection', but {base.name!r} has "
                f"{base.proximity.response!r}. Begin with 'khepera'."
            )
        if not any(is_active(table.counts).any() for table in tables):
            raise ParameterError(
                "the samples must hold readings between 20 and 1000, but there are none. Measure nearer to the object."
            )
        self.tables, self.base = tables, base
        self.gap_counts = [len(table.gap_mm) for table in tables]
        self.sweeps = sum(self.gap_counts)
        self.shared = len(_SENSOR_STEPS) * SENSOR_COUNT
        self.rig = self.shared + len(_SHARED_STEPS)
        self.size = self.rig + len(_RIG_STEPS) * self.sweeps
        looks = np.radians(base.proximity.direction_deg)
        side = np.cos(np.radians(_SIDE_DEG))
        chosen = [np.cos(-np.radians(table.angle_deg)[:, :, None] - looks) > side for table in tables]
        self.chosen = np.concatenate([near.ravel() for near in chosen])
        self.measured = self._pick([table.counts.astype(np.float64) for table in tables])
        self.sensor = self._pick(
            [np.broadcast_to(np.arange(SENSOR_COUNT), table.counts.shape) for table in tables]
        ).astype(np.int64)
        first = np.cumsum([0, *self.gap_counts[:-1]])
        self.sweep = self._pick(
            [
                np.broadcast_to((start + np.arange(len(table.gap_mm)))[:, None, None], table.counts.shape)
                for start, table in zip(first, tables, strict=True)
            ]
        ).astype(np.int64)
        # What each sweep counts in the mean of its object: as much as it has to tell.
        active = np.bincount(self.sweep[is_active(self.measured)], minlength=self.sweeps)
        owned = np.repeat(np.eye(len(tables)), self.gap_counts, axis=1) * active
        self.share = owned / np.maximum(owned.sum(axis=1, keepdims=True), 1)
        # The priors are linear.
        zero = self._priors(np.zeros(self.size))
        self.prior_slopes = np.stack([self._priors(unit) - zero for unit in np.eye(self.size)], axis=1)

    def _pick(self, parts: list[Any]) -> Floats:
        picked: Floats = np.concatenate([part.ravel() for part in parts])[self.chosen]
        return picked

    def run(self, steps: int, *, is_robot_free: bool) -> ReflectionFit:
        from scipy.optimize import least_squares

        start = self._unknowns_of(self.base)
        room = np.concatenate(
            [np.repeat(_ROOM, SENSOR_COUNT), _SHARED_ROOM, np.repeat(5 * np.array(_RIG_PRIORS), self.sweeps)]
        )
        fixed = 0 if is_robot_free else self.rig

        def widened(free: Floats) -> Floats:
            return np.concatenate([start[:fixed], free])

        found = least_squares(
            lambda free: self._residuals(widened(free)),
            start[fixed:],
            lambda free: self._slopes(widened(free), fixed),
            bounds=((start - room)[fixed:], (start + room)[fixed:]),
            x_scale=room[fixed:],
            loss="soft_l1",
            xtol=1e-6,
            ftol=1e-6,
            max_nfev=steps,
            tr_options={"atol": 1e-10, "btol": 1e-10, "maxiter": 2000},
        )
        unknowns = widened(found.x)
        return ReflectionFit(self._robot_of(unknowns), tuple(self._rigs_of(unknowns)))

    def _unknowns_of(self, spec: RobotSpec) -> Floats:
        proximity, reflection = spec.proximity, spec.reflection
        assert reflection is not None
        sensors = [
            proximity.mount_angle_deg,
            proximity.direction_deg,
            np.log(reflection.light),
            reflection.threshold,
            np.log(reflection.lobe_deg),
        ]
        shared = np.log([reflection.behind_mm, reflection.faint, reflection.bright])
        return np.concatenate([*sensors, shared, np.zeros(len(_RIG_STEPS) * self.sweeps)])

    def _robot_of(self, unknowns: Floats) -> RobotSpec:
        place, direction, light, threshold, lobe = unknowns[: self.shared].reshape(-1, SENSOR_COUNT)
        behind_mm, faint, bright = np.exp(unknowns[self.shared : self.rig]).tolist()
        assert self.base.reflection is not None
        reflection = replace(
            self.base.reflection,
            behind_mm=behind_mm,
            light=tuple(np.exp(light).tolist()),
            threshold=tuple(threshold.tolist()),
            lobe_deg=tuple(np.exp(lobe).tolist()),
            faint=faint,
            bright=bright,
        )
        proximity = replace(
            self.base.proximity, mount_angle_deg=tuple(place.tolist()), direction_deg=tuple(direction.tolist())
        )
        return replace(self.base, proximity=proximity, reflection=reflection)

    def _rigs_of(self, unknowns: Floats) -> list[Rig]:
        parts = np.split(unknowns[self.rig :].reshape(len(_RIG_STEPS), -1), np.cumsum(self.gap_counts)[:-1], axis=1)
        return [Rig(*part) for part in parts]

    def _misses(self, unknowns: Floats) -> Floats:
        """Return by how much more the robot of the unknowns would read, in units of what a reading is off by."""
        spec = self._robot_of(unknowns)
        rigs = self._rigs_of(unknowns)
        counts = self._pick([predict(spec, rig.moved(table)) for rig, table in zip(rigs, self.tables, strict=True)])
        return (counts - self.measured) / ERROR_COUNTS

    def _priors(self, unknowns: Floats) -> Floats:
        place, direction, light, threshold, lobe = unknowns[: self.shared].reshape(-1, SENSOR_COUNT)
        errors = unknowns[self.rig :].reshape(len(_RIG_STEPS), -1) / np.array(_RIG_PRIORS)[:, None]
        parts = [
            (place - direction) / ASIDE_DEG,
            (light - light.mean()) / PRIOR_LOG_LIGHT,
            (threshold - threshold.mean()) / PRIOR_THRESHOLD,
            (lobe - lobe.mean()) / PRIOR_LOG_LOBE,
            errors.ravel(),
            (errors @ self.share.T).ravel() / _CENTRE,
        ]
        return np.concatenate(parts)

    def _residuals(self, unknowns: Floats) -> Floats:
        return np.concatenate([self._misses(unknowns), self._priors(unknowns)])

    def _slopes(self, unknowns: Floats, fixed: int) -> Any:
        """Return how the residuals grow with the unknowns after the first few, which are fixed."""
        from scipy.sparse import csr_array

        now = self._misses(unknowns)
        rows = np.arange(len(now))
        matrix = np.zeros((len(now) + len(self.prior_slopes), self.size))
        matrix[len(now) :] = self.prior_slopes

        def slope(first: int, count: int, step: float) -> Floats:
            moved = unknowns.copy()
            moved[first : first + count] += step
            return (self._misses(moved) - now) / step

        first = 0
        groups = (
            (_SENSOR_STEPS, SENSOR_COUNT, self.sensor),
            (_SHARED_STEPS, 1, 0),
            (_RIG_STEPS, self.sweeps, self.sweep),
        )
        for steps, count, owner in groups:
            for step in steps.values():
                if first >= fixed:
                    matrix[rows, first + owner] = slope(first, count, step)
                first += count
        return csr_array(matrix[:, fixed:])
