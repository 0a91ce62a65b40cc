"""Fit a robot to samples: the robot that would have read what the real one read, and how each sweep was off.

Need: some of a robot's numbers (`Field`), such as the directions of its sensors, from sweeps at several gaps from walls
and round posts.

Assumption: the poses of the tables are nearly right. How each sweep differed (`Rig`) is found together with the
robot; else its errors, which are larger than the sensors' noise, would be taken for properties of the sensors.

Method: robust least squares (soft L1), all tables at once. No reading depends on another sensor's or another sweep's
numbers, so a Jacobian takes one prediction for each kind of number. Weak priors hold what the samples do not show; the
mean errors of an object's sweeps are held at 0 where they would only stand for another robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from kiks.engine.parameters import RAY_COUNT, pack, ray_offsets_deg
from kiks.engine.sensing.responses import respond_all
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.errors import ParameterError, shown
from kiks.fit.samples import Fan, Floats, Samples, active_counts, is_active, meet
from kiks.model.robot import SENSOR_COUNT, RobotSpec


class Field(NamedTuple):
    """Numbers of a robot that a fit may change.

    Attributes:
        section: Where they stand in the robot's file.
        key: Their name there.
        is_log: Whether their logarithms are fitted.
        step: Change at which slopes are measured, in the number's unit or of its logarithm.
        room: How far from the start a fit looks.
        spread: How far a sensor is taken to differ from the mean of all; None if nothing is known.
    """

    section: str
    key: str
    is_log: bool
    step: float
    room: float
    spread: float | None = None


PLACE = Field("proximity", "mount_angle_deg", False, 0.05, 30.0)
DIRECTION = Field("proximity", "direction_deg", False, 0.05, 30.0)
REFLECTION = (
    PLACE,
    DIRECTION,
    Field("reflection", "light", True, 1e-4, 3.0, 1.0),
    Field("reflection", "threshold", False, 1e-4, 0.29, 0.5),
    Field("reflection", "lobe_deg", True, 1e-4, 1.5, 0.2),
    Field("reflection", "behind_mm", True, 1e-4, 2.0),
    Field("reflection", "faint", True, 1e-3, 2.0),
    Field("reflection", "bright", True, 1e-3, 2.0),
)
"""All that makes up the response 'reflection'."""

GAIN = Field("proximity", "gain", True, 1e-4, 3.0, 1.0)

ASIDE_DEG = 5.0
"""How far a sensor is taken to look aside from its place."""


@dataclass(frozen=True, eq=False)
class Rig:
    """How each sweep differed from what its table says.

    Args:
        gap_mm: How much wider the gap was [mm], shape [gaps].
        angle_deg: How much larger the angle was in the middle of the sweep [deg], shape [gaps].
        turn_deg: How much farther than once around the robot went in one turn of the table [deg], shape [gaps].
    """

    gap_mm: Floats
    angle_deg: Floats
    turn_deg: Floats

    def moved(self, samples: Samples) -> Samples:
        """Return the samples with the poses at which they were really taken."""
        turns = (samples.angle_deg - samples.angle_deg.mean(axis=1, keepdims=True)) / 360.0
        angle_deg = samples.angle_deg + self.angle_deg[:, None] + self.turn_deg[:, None] * turns
        return replace(samples, gap_mm=samples.gap_mm + self.gap_mm, angle_deg=angle_deg)


class Errors(NamedTuple):
    """How far readings and poses are taken to be off, one standard deviation.

    Attributes:
        counts: Of a reading, for one that is small [counts].
        share: What is added to that, as a share of the reading.
        sweep: Of a sweep's gap [mm], angle [deg] and turn [deg].
        mean: Of the mean over an object's sweeps, as shares of `sweep`.
    """

    counts: float
    share: float
    sweep: tuple[float, float, float]
    mean: tuple[float, float, float]


LABORATORY = Errors(30.0, 0.0, (1.0, 1.0, 3.0), (1e-3, 1e-3, 1e-3))
"""Errors of the Khepera samples: a reading is about so far from a smooth curve along the angle (their README)."""

_SIDE_DEG = 100.0  # cells farther from a sensor's axis are left out: it sees nothing there
_RIG_STEPS = (1e-3, 0.01, 0.02)
_RIG_ROOM = 5.0  # standard deviations


@dataclass(frozen=True)
class Fit:
    """The result of a fit.

    Attributes:
        spec: The robot.
        rigs: For each table, how its sweeps differed.
        deviations: Standard deviation of each number of a field, or of its logarithm.
        rig_deviations: The same of the rigs.
        misfit: Root mean square of what readings are off, in units of what they are taken to be off; about 1 is good.
    """

    spec: RobotSpec
    rigs: tuple[Rig, ...]
    deviations: dict[Field, Floats]
    rig_deviations: tuple[Rig, ...]
    misfit: float


def predict(spec: RobotSpec, samples: Samples) -> Floats:
    """Return what a robot whose response has the directions of its file expects to read before a white object.

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
    length_mm, cosine = (part.reshape(-1, SENSOR_COUNT, RAY_COUNT) for part in meet(samples, fan, spec.body.radius_mm))
    counts = np.empty(samples.counts.shape)
    respond_all(networks_for(), pack(spec), length_mm, cosine, counts.reshape(-1, SENSOR_COUNT))
    return np.minimum(counts + proximity.baseline_counts, proximity.maximum_counts)


def check_base(base: RobotSpec, fields: Sequence[Field]) -> None:
    """Check that the response of the robot that a fit begins with depends on what is fitted."""
    is_reflection = any(field.section == "reflection" for field in fields)
    usable = ("reflection",) if is_reflection else ("reflection", "curve")
    if base.proximity.response not in usable:
        raise ParameterError(
            f"the robot to begin with must have the response {' or '.join(map(repr, usable))}, but {shown(base.name)} "
            f"has {shown(base.proximity.response)}. Begin with the file of such a robot."
        )


def fit_robot(
    tables: Sequence[Samples],
    base: RobotSpec,
    fields: Sequence[Field] = REFLECTION,
    errors: Errors | Sequence[Errors] = LABORATORY,
    *,
    steps: int = 40,
) -> Fit:
    """Return the robot, like `base` otherwise, that explains the samples best.

    Args:
        tables: Samples of white objects.
        base: Where the search begins.
        fields: The numbers that are looked for; none if the robot is known and only the rigs are not.
        errors: How far the samples are taken to be off: those of all tables, or of each.
        steps: Most steps of the search.

    Example:
        fit_robot([load_samples("wall.sam")], RobotSpec.load("khepera")).spec
    """
    each = [errors] * len(tables) if isinstance(errors, Errors) else errors
    return _Search(tables, base, fields, each).run(steps)


def find_rigs(tables: Sequence[Samples], spec: RobotSpec) -> tuple[Rig, ...]:
    """Return how the sweeps of tables differed, seen by a robot that is known."""
    return fit_robot(tables, spec, (), steps=20).rigs


def active_pairs(spec: RobotSpec, tables: Sequence[Samples]) -> tuple[Floats, Floats]:
    """Return what a robot expects for the active samples and what was measured [counts], both of shape [samples]."""
    most = spec.proximity.maximum_counts
    active = [(predict(spec, table), table.counts, is_active(table.counts, most)) for table in tables]
    answers, readings = zip(*((answer[tells], counts[tells]) for answer, counts, tells in active), strict=True)
    return np.concatenate(answers), np.concatenate(readings).astype(np.float64)


def _values(spec: RobotSpec, field: Field) -> Floats:
    """Return the unknowns of a field, shape [8], or [1] if all sensors share the number."""
    values = np.atleast_1d(np.array(getattr(getattr(spec, field.section), field.key), np.float64))
    return np.log(values) if field.is_log else values


class _Group(NamedTuple):
    """Unknowns of one kind: how many, step and room of each, and which of them each chosen reading depends on."""

    size: int
    step: float
    room: float | Floats
    owner: Any


class _Search:
    """One least-squares problem: those of a robot's numbers that are free, and three unknowns of each sweep."""

    def __init__(
        self, tables: Sequence[Samples], base: RobotSpec, fields: Sequence[Field], errors: Sequence[Errors]
    ) -> None:
        check_base(base, fields)
        most = base.proximity.maximum_counts
        if not any(is_active(table.counts, most).any() for table in tables):
            low, high = active_counts(most)
            raise ParameterError(
                f"the samples must hold readings between {low:.0f} and {high:.0f}, but there are none. Measure nearer "
                "to the object."
            )
        self.tables, self.base, self.fields = tables, base, fields
        self.gap_counts = [len(table.gap_mm) for table in tables]
        sweeps = sum(self.gap_counts)
        looks = np.radians(base.proximity.direction_deg)
        side = np.cos(np.radians(_SIDE_DEG))
        chosen = [np.cos(-np.radians(table.angle_deg)[:, :, None] - looks) > side for table in tables]
        self.chosen = np.concatenate([near.ravel() for near in chosen])
        self.measured = self._pick([table.counts.astype(np.float64) for table in tables])
        self.small = self._of_each([error.counts for error in errors])
        self.error = self.small + self._of_each([error.share for error in errors]) * self.measured
        self.sweep_errors = np.repeat([error.sweep for error in errors], self.gap_counts, axis=0).T
        self.mean_errors = np.array([error.mean for error in errors]).T
        sensor = self._pick([np.broadcast_to(np.arange(SENSOR_COUNT), table.counts.shape) for table in tables])
        first = np.cumsum([0, *self.gap_counts[:-1]])
        sweep = self._pick(
            [
                np.broadcast_to((start + np.arange(len(table.gap_mm)))[:, None, None], table.counts.shape)
                for start, table in zip(first, tables, strict=True)
            ]
        )
        values = [_values(base, field) for field in fields]
        self.groups = [
            _Group(len(value), field.step, field.room, sensor if len(value) == SENSOR_COUNT else 0)
            for value, field in zip(values, fields, strict=True)
        ] + [
            _Group(sweeps, step, _RIG_ROOM * error, sweep)
            for step, error in zip(_RIG_STEPS, self.sweep_errors, strict=True)
        ]
        self.ends = np.cumsum([group.size for group in self.groups])
        self.start = np.concatenate([*values, np.zeros(len(_RIG_STEPS) * sweeps)])
        # What each sweep counts in the mean of its object: as much as it has to tell.
        active = np.bincount(sweep[is_active(self.measured, most)], minlength=sweeps)
        owned = np.repeat(np.eye(len(tables)), self.gap_counts, axis=1) * active
        self.share = owned / np.maximum(owned.sum(axis=1, keepdims=True), 1)
        # The priors are linear.
        zero = self._priors(np.zeros(len(self.start)))
        self.prior_slopes = np.stack([self._priors(unit) - zero for unit in np.eye(len(self.start))], axis=1)

    def _pick(self, parts: list[Any]) -> Any:
        return np.concatenate([part.ravel() for part in parts])[self.chosen]

    def _of_each(self, values: list[float]) -> Any:
        """Return for each chosen reading the value of its table."""
        return self._pick(
            [np.full(table.counts.shape, value) for value, table in zip(values, self.tables, strict=True)]
        )

    def run(self, steps: int) -> Fit:
        from scipy.optimize import least_squares

        room = np.concatenate([np.full(group.size, group.room) for group in self.groups])
        found = least_squares(
            self._residuals,
            self.start,
            self._slopes,
            bounds=(self.start - room, self.start + room),
            x_scale=room,
            loss="soft_l1",
            xtol=1e-6,
            ftol=1e-6,
            max_nfev=steps,
            tr_options={"atol": 1e-10, "btol": 1e-10, "maxiter": 2000},
        )
        misses = self._misses(found.x)[self.measured > self.small]
        misfit = float(np.sqrt(np.mean(misses**2)))
        covariance = np.linalg.pinv((found.jac.T @ found.jac).toarray(), hermitian=True) * max(misfit, 1.0) ** 2
        # Rounding may make a variance negative.
        deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return Fit(
            spec=self._robot_of(found.x),
            rigs=self._rigs_of(found.x),
            deviations=dict(zip(self.fields, self._parts(deviations), strict=False)),
            rig_deviations=self._rigs_of(deviations),
            misfit=misfit,
        )

    def _parts(self, unknowns: Floats) -> list[Floats]:
        """Return the unknowns of each group: first the fields, then gaps, angles and turns."""
        return np.split(unknowns, self.ends[:-1])

    def _robot_of(self, unknowns: Floats) -> RobotSpec:
        changes: dict[str, dict[str, Any]] = {}
        for field, part in zip(self.fields, self._parts(unknowns), strict=False):
            values = (np.exp(part) if field.is_log else part).tolist()
            changes.setdefault(field.section, {})[field.key] = tuple(values) if len(values) > 1 else values[0]
        parts: dict[str, Any] = {
            section: replace(getattr(self.base, section), **values) for section, values in changes.items()
        }
        return replace(self.base, **parts)

    def _rigs_of(self, unknowns: Floats) -> tuple[Rig, ...]:
        errors = np.array(self._parts(unknowns)[len(self.fields) :])
        return tuple(Rig(*part) for part in np.split(errors, np.cumsum(self.gap_counts)[:-1], axis=1))

    def _misses(self, unknowns: Floats) -> Floats:
        """Return by how much more the robot of the unknowns would read, in units of what a reading is off by."""
        spec, rigs = self._robot_of(unknowns), self._rigs_of(unknowns)
        counts = self._pick([predict(spec, rig.moved(table)) for rig, table in zip(rigs, self.tables, strict=True)])
        misses: Floats = (counts - self.measured) / self.error
        return misses

    def _priors(self, unknowns: Floats) -> Floats:
        parts = self._parts(unknowns)
        of_field = dict(zip(self.fields, parts, strict=False))
        errors = np.array(parts[len(self.fields) :]) / self.sweep_errors
        priors = [(part - part.mean()) / field.spread for field, part in of_field.items() if field.spread is not None]
        if PLACE in of_field and DIRECTION in of_field:
            priors.append((of_field[PLACE] - of_field[DIRECTION]) / ASIDE_DEG)
        means = errors @ self.share.T / self.mean_errors
        return np.concatenate([*priors, errors.ravel(), means.ravel()])

    def _residuals(self, unknowns: Floats) -> Floats:
        return np.concatenate([self._misses(unknowns), self._priors(unknowns)])

    def _slopes(self, unknowns: Floats) -> Any:
        """Return how the residuals grow with the unknowns."""
        from scipy.sparse import csr_array

        now = self._misses(unknowns)
        matrix = np.zeros((len(now) + len(self.prior_slopes), len(unknowns)))
        matrix[len(now) :] = self.prior_slopes
        rows = np.arange(len(now))
        for end, group in zip(self.ends, self.groups, strict=True):
            # All unknowns of the group at once: each reading depends on one of them.
            moved = unknowns.copy()
            moved[end - group.size : end] += group.step
            matrix[rows, end - group.size + group.owner] = (self._misses(moved) - now) / group.step
        return csr_array(matrix)
