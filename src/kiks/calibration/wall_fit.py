"""The fit behind a calibration: finds the robot that explains the readings in front of a straight wall.

Unknowns: directions and gains of eight sensors, wheel base and pulse length. The start gap of each run is known. Its
start heading is not, because a hand does not put a robot down squarely.

Assumption: the simulator's expected readings are right except for these numbers. Odometry turns counters into poses.

Method: weighted least squares over all runs at once. A spin shows when the robot faces the wall a second time, which
gives wheel base over pulse length, and how each sensor responds to angle and gap. A drive along the wall shows the
forward direction, because a heading that is wrong by a degree changes the gap. A drive towards the wall from a marked
distance shows the pulse length. Each drive is one run with a turn before or after it, because sensors show a heading
well only while it changes. No reading depends on another sensor's numbers or another run's heading, so a Jacobian takes
seven predictions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from kiks.calibration.measurements import Array, CalibrationError, Run
from kiks.model.arena import Arena
from kiks.model.robot import SENSOR_COUNT, RobotSpec
from kiks.sim.simulation import Simulation

NOISE_COUNTS, NOISE_SHARE = 8.0, 0.05
"""Assumed uncertainty of a reading: a constant [counts], plus a share of the reading."""

PRIOR_DEG, PRIOR_LOG_GAIN, PRIOR_LOG_LENGTH = 15.0, 0.7, 0.05
"""Assumed deviation of a robot from its kind; it matters only where the measurements say nothing."""

GAP_MIN_MM = 0.02
"""Smallest predicted gap [mm]: odometry may be wrong, but no robot stands in a wall."""

HEADING_STEP_RAD, HEADING_BOUND_RAD = math.radians(5.0), math.radians(25.0)
"""Step of the search for a first guess of a heading, and largest error of that guess [rad]."""

FINE_SHARE = 0.125
"""Step of a fine search as a share of the coarse step; a fine search takes four steps to either side."""

SKEW_MAX_RAD = math.radians(20.0)
"""Largest heading error when a person puts the robot down to face the wall [rad]."""

REACH_RANGES = 1.1
"""Gap beyond which no response sees a wall, in ranges of the sensors."""

MARKED_MM, UNMARKED_MM = 0.01, 3.0
"""Assumed error of the start gap of a run [mm]: at a mark, and where the robot has driven to."""

_STEP = (0.3, 0.01, 0.001, 0.001, math.radians(0.3), 0.1)
"""Steps of the Jacobian: direction [deg], logs of gain, wheel base and pulse length, heading [rad], gap [mm]."""

_BASE, _PULSE = 2 * SENSOR_COUNT, 2 * SENSOR_COUNT + 1
_HEADINGS = 2 * SENSOR_COUNT + 2  # then a heading for each run, and last a shift of the gap for each


@dataclass(frozen=True)
class Fit:
    """The robot that explains the runs best.

    Attributes:
        spec: The robot.
        headings_rad: Heading at the start of each run; 0 faces the wall, left is positive.
        uncertainty: Standard deviations of the directions [deg] and of the logs of gains, wheel base and pulse length.
        misfit: Root mean square of the residuals, in units of the uncertainty of readings; about 1 is good.
        gap_errors_mm: For each run, the gap that the readings show minus the marked gap [mm].
    """

    spec: RobotSpec
    headings_rad: Array
    uncertainty: Array
    misfit: float
    gap_errors_mm: Array

    def end_heading_rad(self, index: int, run: Run) -> float:
        """Return the heading after a run [rad]."""
        body = self.spec.body
        return float(self.headings_rad[index] + run.turned_pulses() * body.pulse_mm / body.wheel_base_mm)


class WallModel:
    """Predicts the readings of a robot in front of a wall."""

    def __init__(self, spec: RobotSpec) -> None:
        self.radius_mm = spec.body.radius_mm
        self.sight_mm = REACH_RANGES * spec.proximity.range_mm
        reach_mm = 2.0 * (self.radius_mm + self.sight_mm)
        self.arena = Arena.box(math.ceil(reach_mm), math.ceil(reach_mm), wall_mm=0)

    def readings(self, spec: RobotSpec, gaps_mm: Array, headings_rad: Array) -> Array:
        """Return the expected counts at gaps to the wall [mm] and headings [rad], shape [pose, 8]."""
        sim = Simulation(self.arena, robot=spec)
        wall_mm, middle_mm = self.arena.width_mm - self.radius_mm, self.arena.height_mm / 2
        expected = np.empty((len(gaps_mm), SENSOR_COUNT))
        expected[:] = np.minimum(spec.proximity.baseline_counts, spec.proximity.maximum_counts)
        in_sight = gaps_mm < self.sight_mm
        poses = np.full((np.count_nonzero(in_sight), 3), middle_mm)
        poses[:, 0] = wall_mm - np.maximum(gaps_mm[in_sight], GAP_MIN_MM)
        poses[:, 2] = headings_rad[in_sight]
        expected[in_sight] = sim.proximity_at(1, poses)
        return expected


def odometry(run: Run, spec: RobotSpec, heading_rad: float) -> tuple[Array, Array]:
    """Return the gap [mm] and the heading [rad] at each reading of a run that began with a heading [rad]."""
    path_mm = np.vstack(([0.0, 0.0], run.pulses)) * spec.body.pulse_mm
    headings_rad = heading_rad + (path_mm[:, 1] - path_mm[:, 0]) / spec.body.wheel_base_mm
    steps_mm = np.diff(path_mm.mean(axis=1))
    nearer_mm = np.cumsum(steps_mm * np.cos((headings_rad[1:] + headings_rad[:-1]) / 2))
    return run.gap_mm - nearer_mm, headings_rad[1:]


def misfit_counts(model: WallModel, spec: RobotSpec, run: Run, heading_rad: float) -> float:
    """Return the sum of absolute residuals of a run that began with a heading [counts]."""
    return float(np.abs(model.readings(spec, *odometry(run, spec, heading_rad)) - run.counts).sum())


def guess_heading_rad(model: WallModel, spec: RobotSpec, run: Run) -> float:
    """Return the heading that explains a run best [rad], from a coarse search of all headings and a fine one."""

    def misfit(heading_rad: float) -> float:
        return misfit_counts(model, spec, run, heading_rad)

    coarse_rad = min(np.arange(-math.pi, math.pi, HEADING_STEP_RAD).tolist(), key=misfit)
    nearby_rad: list[float] = (coarse_rad + HEADING_STEP_RAD * FINE_SHARE * np.arange(-4, 5)).tolist()
    return min(nearby_rad, key=misfit)


def guess_pulse(base: RobotSpec, spec: RobotSpec, run: Run) -> RobotSpec:
    """Return `spec` with the pulse length that explains a run towards the wall best, and the wheel base in proportion.

    A fit alone does not find it. A pulse that is too short puts the wall out of sight, where readings do not change.
    And pulse and heading compensate each other along a curved valley, in which a fit converges slowly.
    """
    model, run = WallModel(base), run.thinned(3)

    def with_pulse(ratio: float) -> RobotSpec:
        pulse_mm = base.body.pulse_mm * ratio
        wheel_base_mm = spec.body.wheel_base_mm * pulse_mm / spec.body.pulse_mm
        return replace(spec, body=replace(spec.body, pulse_mm=pulse_mm, wheel_base_mm=wheel_base_mm))

    best = (1.0, 0.0)
    for share in (1.0, FINE_SHARE):
        ratios = best[0] + share * np.linspace(-2 * PRIOR_LOG_LENGTH, 2 * PRIOR_LOG_LENGTH, 41)
        headings_rad = best[1] + share * np.linspace(-SKEW_MAX_RAD, SKEW_MAX_RAD, 9)
        tried = product(ratios.tolist(), headings_rad.tolist())
        best = min(tried, key=lambda pair: misfit_counts(model, with_pulse(pair[0]), run, pair[1]))
    return with_pulse(best[0])


def fit_runs(base: RobotSpec, runs: Sequence[Run], guess: RobotSpec | None = None) -> Fit:
    """Find the robot that explains the runs best; constants that are not fitted are those of `base`.

    Args:
        base: The kind of robot.
        runs: The measured runs.
        guess: Start of the search; `base` if left out.

    Raises:
        CalibrationError: If no such robot explains them.
    """
    from scipy.optimize import least_squares
    from scipy.sparse import csr_array

    model = WallModel(base)
    measured = np.concatenate([run.counts for run in runs])
    # A reading at the limit counts like any other, because the prediction has the same limit.
    weights = 1.0 / (NOISE_COUNTS + NOISE_SHARE * measured)
    owners = np.repeat(np.arange(len(runs)), [len(run.counts) for run in runs])
    prior = np.full(_HEADINGS, PRIOR_DEG)
    prior[SENSOR_COUNT:_BASE] = PRIOR_LOG_GAIN
    prior[_BASE:] = PRIOR_LOG_LENGTH
    prior_mm = np.array([MARKED_MM if run.is_marked else UNMARKED_MM for run in runs])
    shifts = _HEADINGS + len(runs)

    def predict(unknowns: Array, farther_mm: float = 0.0) -> Array:
        spec = apply_unknowns(base, unknowns)
        tracks = [odometry(run, spec, unknowns[_HEADINGS + index]) for index, run in enumerate(runs)]
        gaps_mm, headings_rad = (np.concatenate(part) for part in zip(*tracks, strict=True))
        return model.readings(spec, gaps_mm + unknowns[shifts + owners] + farther_mm, headings_rad) * weights

    def residuals(unknowns: Array) -> Array:
        errors = predict(unknowns) - measured * weights
        return np.concatenate((errors.ravel(), unknowns[:_HEADINGS] / prior, unknowns[shifts:] / prior_mm))

    def jacobian(unknowns: Array) -> Any:
        now = predict(unknowns)
        matrix = np.zeros((*now.shape, len(unknowns)))

        def slope(indices: Any, step: float) -> Array:
            moved = unknowns.copy()
            moved[indices] += step
            change: Array = (predict(moved) - now) / step
            return change

        sensors = np.arange(SENSOR_COUNT)
        matrix[:, sensors, sensors] = slope(slice(0, SENSOR_COUNT), _STEP[0])
        matrix[:, sensors, SENSOR_COUNT + sensors] = slope(slice(SENSOR_COUNT, _BASE), _STEP[1])
        matrix[:, :, _BASE] = slope(_BASE, _STEP[2])
        matrix[:, :, _PULSE] = slope(_PULSE, _STEP[3])
        samples = np.arange(len(owners))
        matrix[samples, :, _HEADINGS + owners] = slope(slice(_HEADINGS, shifts), _STEP[4])
        matrix[samples, :, shifts + owners] = slope(slice(shifts, None), _STEP[5])
        priors = np.zeros((_HEADINGS + len(runs), len(unknowns)))
        priors[:_HEADINGS, :_HEADINGS] = np.diag(1.0 / prior)
        priors[_HEADINGS:, shifts:] = np.diag(1.0 / prior_mm)
        # Six numbers of a row are not zero, so the sparse solver is several times as fast.
        return csr_array(np.vstack((matrix.reshape(-1, len(unknowns)), priors)))

    guess = base if guess is None else guess
    headings = [guess_heading_rad(model, guess, run) for run in runs]
    start = np.concatenate((unknowns_of(base, guess), headings, np.zeros(len(runs))))
    reach = np.concatenate((5 * prior, np.full(len(runs), HEADING_BOUND_RAD), 5 * prior_mm))
    found = least_squares(
        residuals,
        start,
        jacobian,
        bounds=(start - reach, start + reach),
        x_scale=reach,
        loss="soft_l1",
        f_scale=2.0,
        xtol=1e-4,
        ftol=1e-4,
        max_nfev=40,
    )
    unknowns = found.x
    errors = (predict(unknowns) - measured * weights).reshape(len(owners), SENSOR_COUNT)
    misfit = float(np.sqrt(np.mean(errors[measured > NOISE_COUNTS] ** 2))) if (measured > NOISE_COUNTS).any() else 0.0
    covariance = np.linalg.pinv((found.jac.T @ found.jac).toarray(), hermitian=True) * max(misfit, 1.0) ** 2
    return Fit(
        spec=apply_unknowns(base, unknowns),
        headings_rad=unknowns[_HEADINGS:shifts],
        # Rounding may make a variance negative.
        uncertainty=np.sqrt(np.maximum(np.diag(covariance), 0.0))[:_HEADINGS],
        misfit=misfit,
        gap_errors_mm=_gap_errors_mm(errors, predict(unknowns, 0.5) - predict(unknowns), owners, 0.5),
    )


def _gap_errors_mm(errors: Array, changes: Array, owners: Any, step_mm: float) -> Array:
    """Return for each run the common change of its gaps that explains it best [mm]."""
    slopes = changes / step_mm
    weights = np.bincount(owners, (slopes**2).sum(axis=1))
    errors_mm: Array = -np.bincount(owners, (slopes * errors).sum(axis=1)) / np.maximum(weights, 1e-9)
    return errors_mm


def unknowns_of(base: RobotSpec, spec: RobotSpec) -> Array:
    """Return the unknowns that turn `base` into `spec`, without headings and shifts."""
    unknowns = np.zeros(_HEADINGS)
    unknowns[:SENSOR_COUNT] = np.subtract(spec.proximity.direction_deg, base.proximity.direction_deg)
    unknowns[SENSOR_COUNT:_BASE] = np.log(np.divide(spec.proximity.gain, base.proximity.gain))
    unknowns[_BASE] = math.log(spec.body.wheel_base_mm / base.body.wheel_base_mm)
    unknowns[_PULSE] = math.log(spec.body.pulse_mm / base.body.pulse_mm)
    return unknowns


def apply_unknowns(base: RobotSpec, unknowns: Array) -> RobotSpec:
    """Return `base` changed by the unknowns of the fit.

    Raises:
        CalibrationError: If wheel base or pulse length differ too much from those of `base`.
    """
    direction_deg = np.array(base.proximity.direction_deg) + unknowns[:SENSOR_COUNT]
    gain = np.array(base.proximity.gain) * np.exp(unknowns[SENSOR_COUNT:_BASE])
    proximity = replace(base.proximity, direction_deg=tuple(direction_deg.tolist()), gain=tuple(gain.tolist()))
    wheel_base_mm = base.body.wheel_base_mm * math.exp(unknowns[_BASE])
    pulse_mm = base.body.pulse_mm * math.exp(unknowns[_PULSE])
    if not 0.5 < wheel_base_mm / base.body.wheel_base_mm < 2 or not 0.5 < pulse_mm / base.body.pulse_mm < 2:
        raise CalibrationError(
            f"the measurements must come from a robot like {base.name!r}, but they ask for a wheel base of "
            f"{wheel_base_mm:.1f} mm and a pulse of {pulse_mm:.4f} mm. Name the right kind with --base."
        )
    body = replace(base.body, wheel_base_mm=wheel_base_mm, pulse_mm=pulse_mm)
    return replace(base, body=body, proximity=proximity)
