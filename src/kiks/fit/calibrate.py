"""Calibration: a robot collects samples in front of a white wall, and the fit finds its constants.

Each spin on the spot is a sweep of samples, whose angles follow from the counters. The fit finds directions and gains
of the sensors, and how much farther than once around the robot went in a turn, which gives the wheel base in pulses.
Directions come out up to a common angle, because no spin shows where ahead is. The last placement adds what is left:

* The robot drives to the wall and spins there. A robot whose sensors are known sees how wide the gap is, so the way
  between the mark and that gap, over the pulses, is the length of a pulse.
* It drives along the wall and back, and spins after each drive. The change of the gap shows the forward direction.

A last fit takes all spins together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from kiks.client.serial_robot import SerialRobot
from kiks.errors import LinkError, ParameterError, shown
from kiks.fit.measurements import (
    Array,
    CalibrationError,
    Subject,
    Track,
    deviation,
    halt,
    jitter,
    processing_ms,
    record,
    rest,
)
from kiks.fit.placements import Placements
from kiks.fit.robot_fit import DIRECTION, GAIN, Errors, Fit, check_base, fit_robot, predict
from kiks.fit.samples import MAXIMUM_COUNTS, Samples
from kiks.model.robot import SENSOR_COUNT, RobotSpec

FIELDS = (DIRECTION, GAIN)
"""What spins show of the sensors."""

AT_MARKS = Errors(8.0, 0.05, (1.0, 8.0, 1.0), (1e-2, math.inf, math.inf))
"""Marks are right on average, a hand puts the robot down a little askew, and wheel bases differ."""

ON_THE_WAY = Errors(8.0, 0.05, (3.0, 8.0, 0.2), (math.inf, math.inf, math.inf))
"""Nothing marks where the robot has driven to."""

KNOWN = Errors(8.0, 0.05, (1.0, 0.1, 1.0), (math.inf, math.inf, math.inf))
"""The heading is known there afterwards: from the gaps before and after the robot drove along the wall."""

SPIN_TURNS = 2.5
"""Turns of a spin: the robot faces the wall more than once, which shows the wheel base and averages readings."""

SPEED = 4
"""Wheel speed [`SPEED_MM_PER_S`]: slow, as a reading is up to 20 ms old."""

TURNS_DEG = np.arange(300.0, 430.0, 0.5)
"""What one turn may be by the counters and the wheel base of the robot's kind [deg]."""

ASKEW_DEG = np.arange(-24.0, 25.0, 4.0)
"""Headings at which a hand may put the robot down before the wall, and which sensors may be off [deg]."""

GAP_SHARES, FAINT_SHARE = (0.15, 0.45, 0.7, 0.95), 0.03
"""Gaps at which the robot spins, as shares of the gap at which the best sensor reads `FAINT_SHARE` of the maximum."""

ALONG_MM, ALONG_DEG = 100.0, 95.0
"""Length of the drive along the wall [mm], and its heading [deg]: a little away, as forward is not yet known."""

RUN_UP_MM = 500.0
"""Marked gap from which it drives towards the wall [mm]."""

FREE_SAMPLES, GAP_SAMPLES = 200, 100
"""Number of readings at rest: in the open, and before the spins at a mark."""

ATTEMPTS = 3
"""Most attempts at a placement."""

FRONT_DEG = 60.0
"""Sensors that look ahead look no farther aside."""

SEEN_SHARE, FAINT_SEEN_SHARE = 0.049, 0.0098
"""Smallest reading above the baseline that shows a wall, as a share of the largest reading: near the wall, and where
little is expected."""

GAP_ERROR_MAX_MM = 3.0
"""Largest error of a gap that agrees with the others [mm]."""

MISFIT_MAX = 6.0
"""Largest root mean square of the residuals for measurements of such a robot."""

Result = TypeVar("Result")
Say = Callable[[str], None]


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    Attributes:
        spec: The robot.
        fit: The fit of its sensors, with uncertainties.
        wheel_base_deviation_mm: Standard deviation of the wheel base [mm].
        pulse_deviation_mm: Standard deviation of the pulse length [mm].
        jitter_counts: Mean absolute deviation of each sensor in the open [counts].
    """

    spec: RobotSpec
    fit: Fit
    wheel_base_deviation_mm: float
    pulse_deviation_mm: float
    jitter_counts: Array

    def lines(self) -> list[str]:
        """Return the result as lines of text, each number with its uncertainty (one standard deviation)."""
        body, proximity, error = self.spec.body, self.spec.proximity, self.fit.deviations
        aside_deg = error[DIRECTION]
        lines = [
            f"wheel base    {body.wheel_base_mm:.3f} +- {self.wheel_base_deviation_mm:.3f} mm",
            f"pulse length  {body.pulse_mm:.6f} +- {self.pulse_deviation_mm:.6f} mm",
            f"processing    {self.spec.firmware.processing_ms:.2f} ms",
            f"misfit        {self.fit.misfit:.2f} (1: as good as the readings are steady)",
        ]
        for sensor in range(SENSOR_COUNT):
            gain = proximity.gain[sensor]
            lines.append(
                f"sensor {sensor}      looks to {proximity.direction_deg[sensor]:6.1f} +- {aside_deg[sensor]:.1f} "
                f"deg, gain {gain:.3f} +- {gain * error[GAIN][sensor]:.3f}, "
                f"baseline {proximity.baseline_counts[sensor]:.0f}, jitter {self.jitter_counts[sensor]:.1f} counts"
            )
        return lines


def calibrate(
    robot: SerialRobot,
    placements: Placements,
    base: RobotSpec,
    *,
    baud: int | None = None,
    gaps_mm: Sequence[float] | None = None,
    run_up_mm: float = RUN_UP_MM,
    say: Say = lambda text: None,
) -> Calibration:
    """Measure a robot; it stands still when this function returns or raises.

    Args:
        robot: The robot.
        placements: Puts the robot where a measurement needs it.
        base: The kind of robot, with the response 'reflection' or 'curve'; it gives all that is not measured.
        baud: Speed of its line [bit/s]; the usual one of its kind if left out.
        gaps_mm: Marked distances from wall to rim [mm], at least two; `default_gaps_mm` if left out.
        run_up_mm: Marked gap from which it drives towards the wall [mm].
        say: Called with a line of text about each step.

    Raises:
        CalibrationError: If a measurement shows something unexpected, or measurements contradict each other.
        LinkError: If the robot does not answer.
    """
    check_base(base, FIELDS)
    gaps = checked_gaps(gaps_mm, run_up_mm, base)
    subject = Subject(robot, base)
    subject.counters()
    say(f"A robot answers, and is measured as one of the kind {shown(base.name)}.")
    try:
        halt(subject)
        return _Session(subject, placements, base, baud or base.firmware.baud, say).measure(gaps, run_up_mm)
    finally:
        halt(subject)


def checked_gaps(gaps_mm: Sequence[float] | None, run_up_mm: float, base: RobotSpec) -> list[float]:
    """Return the gaps to spin at, nearest first [mm]."""
    range_mm = base.proximity.range_mm
    gaps = sorted(gaps_mm) if gaps_mm else default_gaps_mm(base)
    if len(set(gaps)) < 2 or not all(2 <= gap <= range_mm for gap in gaps):
        raise ParameterError(
            f"gaps_mm must be at least two different numbers from 2 to {range_mm:g} mm, the range of the sensors, "
            f"but they were {gaps}. Leave them out for good ones."
        )
    if not 3 * range_mm <= run_up_mm <= 2000:
        raise ParameterError(
            f"run_up_mm must be between {3 * range_mm:g} and 2000 mm, but it was {shown(run_up_mm)}. The longer, "
            "the better."
        )
    return gaps


def default_gaps_mm(base: RobotSpec) -> list[float]:
    """Return the gaps at which such a robot sees a wall well [mm], nearest first."""
    tried_mm = np.arange(1.0, base.proximity.range_mm)
    faint = FAINT_SHARE * base.proximity.maximum_counts
    seen_mm = float(tried_mm[facing_counts(base, tried_mm).max(axis=1) >= faint].max(initial=10.0))
    return [float(round(share * seen_mm)) for share in GAP_SHARES]


def facing_counts(spec: RobotSpec, gaps_mm: Sequence[float] | Array) -> Array:
    """Return the reading of each sensor above its baseline as it faces a wall [counts], shape [gaps, 8]."""
    sensors = np.arange(SENSOR_COUNT)
    angle_deg = np.tile(-np.array(spec.proximity.direction_deg), (len(gaps_mm), 1))
    counts = np.zeros((*angle_deg.shape, SENSOR_COUNT), np.int64)
    answers = predict(spec, Samples("wall", math.inf, np.array(gaps_mm, np.float64), angle_deg, counts))
    above: Array = answers[:, sensors, sensors] - spec.proximity.baseline_counts
    return above


def heading_deg(pulses: NDArray[Any], spec: RobotSpec) -> Array:
    """Return the heading of a robot by its counters, left and right [deg]; positive is to the left."""
    turned: Array = np.degrees((pulses[..., 1] - pulses[..., 0]) * spec.body.pulse_mm / spec.body.wheel_base_mm)
    return turned


def sweeps(spins: Sequence[tuple[float, Track]], spec: RobotSpec) -> Samples:
    """Return spins in front of a wall, each with its gap [mm], as one table; longer ones are cut to the shortest."""
    count = min(len(track.counts) for _, track in spins)
    angle_deg = np.array([heading_deg(track.path[1 : count + 1], spec) for _, track in spins])
    counts = np.array([track.counts[:count] for _, track in spins])
    return Samples("wall", math.inf, np.array([gap_mm for gap_mm, _ in spins]), angle_deg, counts)


def aligned(table: Samples, spec: RobotSpec) -> Samples:
    """Return sweeps turned to where their readings agree with a robot's, to a few degrees: a fit begins there."""
    errors = [
        np.abs(predict(spec, replace(table, angle_deg=table.angle_deg + turned_deg)) - table.counts).sum(axis=(1, 2))
        for turned_deg in ASKEW_DEG
    ]
    return replace(table, angle_deg=table.angle_deg + ASKEW_DEG[np.argmin(errors, axis=0)][:, None])


def one_turn_deg(table: Samples) -> float:
    """Return the angle of the table after which readings repeat [deg]: 360, if its angles are right."""

    def misfit(turn_deg: float) -> float:
        errors = []
        for angle_deg, counts in zip(np.abs(table.angle_deg - table.angle_deg[:, :1]), table.counts, strict=True):
            first = angle_deg + turn_deg <= angle_deg[-1]
            for sensor in counts.T:
                errors.append(np.abs(np.interp(angle_deg[first] + turn_deg, angle_deg, sensor) - sensor[first]).mean())
        return float(np.mean(errors))

    return float(min(TURNS_DEG, key=misfit))


@dataclass(frozen=True)
class Approach:
    """The last placement: a drive to the wall and two spins, then two drives along the wall, each with a spin after it.

    Attributes:
        mark_mm: Gap at the start [mm].
        legs: The movements of each of the three drives, one after the other: the drive itself and its spins.
    """

    mark_mm: float
    legs: list[list[Track]]

    @property
    def spins(self) -> list[Track]:
        """The four spins."""
        return [spin for leg in self.legs for spin in leg[1:]]

    def at_counters(self, gaps_mm: Array, spec: RobotSpec) -> Samples:
        """Return the spins at given gaps [mm], as if the robot had faced the wall when its counters were zero."""
        return sweeps(list(zip(gaps_mm.tolist(), self.spins, strict=True)), spec)

    def sweeps(self, spec: RobotSpec) -> Samples:
        """Return the spins with the gaps and the angles at which the robot sees itself."""
        tried_mm = np.arange(1.0, spec.proximity.range_mm)
        largest = facing_counts(spec, tried_mm) + spec.proximity.baseline_counts
        # A millimetre is near enough to begin with.
        gaps_mm = [tried_mm[np.abs(largest - spin.counts.max(axis=0)).sum(axis=1).argmin()] for spin in self.spins]
        table = aligned(self.at_counters(np.array(gaps_mm), spec), spec)
        return fit_robot([table], spec, (), ON_THE_WAY).rigs[0].moved(table)

    def pulse_and_heading(self, gaps_mm: Array, spec: RobotSpec) -> tuple[float, float]:
        """Return the pulse length [mm], and the heading at which the counters were zero [rad].

        A drive along the path v, a complex number of pulses by the counters alone, changes the gap by -Re(v w), where w
        is the pulse length, turned by that heading. So the gaps give w.

        Args:
            gaps_mm: Gaps of the spins [mm].
            spec: The robot; its wheel base is right in pulses.
        """
        gaps_mm = np.array([self.mark_mm, gaps_mm[:2].mean(), *gaps_mm[2:]])
        drives, start = [], np.zeros(2)
        for leg in self.legs:
            path = np.vstack([start, *(track.path for track in leg)])
            start = path[-1]
            headings_rad = np.radians(heading_deg((path[1:] + path[:-1]) / 2, spec))
            drives.append(np.diff(path.mean(axis=1)) @ np.exp(1j * headings_rad))
        drive = np.array(drives)
        (real, imaginary), *_ = np.linalg.lstsq(np.stack([drive.real, -drive.imag], axis=1), -np.diff(gaps_mm))
        return float(np.hypot(real, imaginary)), float(np.arctan2(imaginary, real))


class _Session:
    """One calibration in progress."""

    def __init__(self, robot: Subject, placements: Placements, base: RobotSpec, baud: int, say: Say) -> None:
        self.robot = robot
        self.placements = placements
        self.spec = base
        self.baud = baud
        self.say = say
        self.rests: list[Array] = []

    def measure(self, gaps: list[float], run_up_mm: float) -> Calibration:
        text = "Put the robot in the open: nothing within 300 mm, no lamp, no sun."
        jitter_counts = self._at(text, None, self._measure_in_the_open)
        spins: list[tuple[float, Track]] = []
        for index, gap_mm in enumerate(gaps):
            text = f"Put the robot before the wall, facing it, its rim at the {gap_mm:g} mm mark."
            spins += self._at(text, gap_mm, partial(self._measure_spins, is_nearest=index == 0))
        self.say("Fitting ...")
        self.spec = self._rough_fit(spins)
        text = f"Put the robot before the wall, facing it squarely, its rim at the {run_up_mm:g} mm mark."
        approach = self._at(text, run_up_mm, partial(self._measure_approach, near_mm=gaps[1]))
        self.say("Fitting ...")
        return self._result(spins, approach, jitter_counts)

    def _errors(self, errors: Errors) -> Errors:
        """Return errors for the converter of this robot; those above are for a Khepera's."""
        return errors._replace(counts=errors.counts * self.spec.proximity.maximum_counts / MAXIMUM_COUNTS)

    def _rough_fit(self, spins: Sequence[tuple[float, Track]]) -> RobotSpec:
        """Return the robot as the spins at the marks show it: its forward direction to some degrees only."""
        spec = _wider(self.spec, one_turn_deg(sweeps(spins, self.spec)) / 360.0)
        fit = fit_robot([aligned(sweeps(spins, spec), spec)], spec, FIELDS, self._errors(AT_MARKS))
        _check_fit(fit, [gap_mm for gap_mm, _ in spins])
        return _wider(fit.spec, 1.0 / (1.0 + _mean_turn_deg(fit)[0] / 360.0))

    def _result(self, spins: Sequence[tuple[float, Track]], approach: Approach, jitter_counts: Array) -> Calibration:
        """Return the robot as all spins show it together, those of the approach at headings that are known now."""
        seen = approach.sweeps(self.spec)
        pulse_mm, heading_rad = approach.pulse_and_heading(seen.gap_mm, self.spec)
        known = approach.at_counters(seen.gap_mm, self.spec)
        known = replace(known, angle_deg=known.angle_deg + math.degrees(heading_rad))
        fit = fit_robot(
            [aligned(sweeps(spins, self.spec), self.spec), known],
            self.spec,
            FIELDS,
            [self._errors(AT_MARKS), self._errors(KNOWN)],
        )
        turn_deg, turn_error_deg = _mean_turn_deg(fit)
        pulse_share = float(fit.rig_deviations[1].gap_mm.mean()) / approach.mark_mm
        body, proximity = fit.spec.body, fit.spec.proximity
        wheel_base_mm = body.wheel_base_mm / (1.0 + turn_deg / 360.0) * pulse_mm / body.pulse_mm
        noise = self._noise_factor(fit.spec)
        spec = replace(
            fit.spec,
            name=f"{self.spec.name} (calibrated)",
            body=replace(body, pulse_mm=pulse_mm, wheel_base_mm=wheel_base_mm),
            proximity=replace(
                proximity,
                noise_small=round(proximity.noise_small * noise, 4),
                noise_large=round(proximity.noise_large * noise, 4),
            ),
        )
        base_deviation_mm = wheel_base_mm * math.hypot(turn_error_deg / 360.0, pulse_share)
        return Calibration(_rounded(spec), fit, base_deviation_mm, pulse_mm * pulse_share, jitter_counts)

    def _at(self, instruction: str, marked_mm: float | None, measure: Callable[[float], tuple[Result, str]]) -> Result:
        """Have the robot placed and measure, again if a repetition is wanted; return the measurement."""
        for attempt in range(1, ATTEMPTS + 1):
            gap_mm = self.placements.place(instruction, marked_mm) or 0.0
            rest_count = len(self.rests)
            try:
                result, finding = measure(gap_mm)
            except (CalibrationError, LinkError) as error:
                halt(self.robot)
                if attempt == ATTEMPTS or not self.placements.wants_repeat(str(error), is_good=False):
                    raise
            else:
                if attempt == ATTEMPTS or not self.placements.wants_repeat(finding, is_good=True):
                    return result
            del self.rests[rest_count:]
        raise AssertionError("the last attempt returns or raises")

    def _measure_in_the_open(self, _: float) -> tuple[Array, str]:
        measured_ms = processing_ms(self.robot, self.baud)
        at_rest = rest(self.robot, FREE_SAMPLES)
        mean = at_rest.mean(axis=0)
        if mean.max() > self.spec.proximity.maximum_counts / 3:
            raise CalibrationError(
                f"the sensors must read little in the open, but sensor {int(mean.argmax())} reads "
                f"{mean.max():.0f} counts. Remove objects and lamps near the robot."
            )
        spread = deviation(at_rest)
        proximity = replace(
            self.spec.proximity,
            baseline_counts=tuple(mean.tolist()),
            jitter_counts=tuple(jitter(at_rest).round(1).tolist()),
        )
        firmware = replace(self.spec.firmware, processing_ms=min(round(measured_ms, 2), 1000.0))
        self.spec = replace(self.spec, proximity=proximity, firmware=firmware)
        baselines = ", ".join(f"{count:.0f}" for count in mean)
        noise = f"jitter {spread.mean():.1f} counts; a command takes {measured_ms:.2f} ms"
        return spread, f"Baselines {baselines}; {noise}."

    def _measure_spins(self, gap_mm: float, *, is_nearest: bool) -> tuple[list[tuple[float, Track]], str]:
        self.rests.append(rest(self.robot, GAP_SAMPLES))
        self.robot.zero()
        # In both directions, because readings are older than counters.
        spins = [(gap_mm, self._spin(turns)) for turns in (SPIN_TURNS, -SPIN_TURNS)]
        above = np.concatenate([track.counts for _, track in spins]).max(axis=0) - self.spec.proximity.baseline_counts
        most = self.spec.proximity.maximum_counts
        least = max(facing_counts(self.spec, [gap_mm]).max() / 2, FAINT_SEEN_SHARE * most)
        enough = min(least, SEEN_SHARE * most)
        if above.max() < enough:
            raise CalibrationError(
                f"some sensor must see the wall at {gap_mm:g} mm, but none reads more than {above.max():.0f} counts "
                "above its baseline. Is the wall white, upright and at the mark?"
            )
        if is_nearest and above.min() < SEEN_SHARE * most:
            raise CalibrationError(
                f"every sensor must see the wall at {gap_mm:g} mm as the robot spins, but sensor {int(above.argmin())} "
                f"reads no more than {above.min():.0f} counts above its baseline. Is it covered or broken?"
            )
        largest = ", ".join(f"{count:.0f}" for count in above)
        return spins, f"Largest readings at {gap_mm:g} mm, above the baseline: {largest}."

    def _measure_approach(self, mark_mm: float, *, near_mm: float) -> tuple[Approach, str]:
        """Drive to the wall, spin there, then drive along it and back.

        After two and a half turns the robot looks the other way, so it drives back without another turn.
        """
        ahead = np.abs(self.spec.proximity.direction_deg) < FRONT_DEG
        near = facing_counts(self.spec, [near_mm])[0, ahead].min() + np.array(self.spec.proximity.baseline_counts)

        def is_near(counts: Sequence[float]) -> bool:
            return bool((np.array(counts) >= near)[ahead].any())

        self.robot.zero()
        drive = self._drive(1.1 * mark_mm, is_near)
        if not is_near(drive.counts[-1].tolist()):
            front = ", ".join(f"{count:.0f}" for count in drive.counts[-1][ahead])
            raise CalibrationError(
                f"the wall must come into sight {mark_mm:g} mm ahead, but after {drive.path[-1, 0]:.0f} pulses the "
                f"front sensors read {front}. Put the robot at the mark, facing the wall squarely."
            )
        approach = Approach(mark_mm, [[drive, *(self._spin(turns) for turns in (SPIN_TURNS, -SPIN_TURNS))]])
        seen = approach.sweeps(self.spec)
        start_deg = float((seen.angle_deg - approach.at_counters(seen.gap_mm, self.spec).angle_deg).mean())
        # A robot that stood askew has come off the middle of the wall: it drives to the other side.
        along_deg = -math.copysign(ALONG_DEG, start_deg)
        for wanted_deg, turns in ((along_deg, SPIN_TURNS), (along_deg + 180.0, -SPIN_TURNS)):
            self._turn_to(wanted_deg - start_deg)
            approach.legs.append([self._drive(ALONG_MM), self._spin(turns)])
        return approach, f"The wall was near after {drive.path[-1].mean():.0f} pulses."

    def _drive(self, way_mm: float, is_done: Callable[[list[int]], bool] = lambda counts: False) -> Track:
        """Drive straight on."""
        return record(self.robot, SPEED, SPEED, way_mm / self.spec.body.pulse_mm, is_done)

    def _spin(self, turns: float) -> Track:
        """Turn on the spot; positive turns are to the left."""
        speed, body = round(math.copysign(SPEED, turns)), self.spec.body
        return record(self.robot, -speed, speed, abs(turns) * math.pi * body.wheel_base_mm / body.pulse_mm)

    def _turn_to(self, wanted_deg: float) -> None:
        """Turn the shorter way to a heading by the counters [deg]."""
        self._spin(math.remainder(wanted_deg - float(heading_deg(self.robot.counters(), self.spec)), 360.0) / 360.0)

    def _noise_factor(self, spec: RobotSpec) -> float:
        """Return the ratio of this robot's relative noise to that of its kind, at rest near the wall."""
        proximity = spec.proximity
        shares = []
        for at_rest in self.rests:
            mean = at_rest.mean(axis=0)
            usual_share = proximity.noise_small - (proximity.noise_small - proximity.noise_large) * mean / 1000
            usual_counts = mean * usual_share / (proximity.noise_exponent + 1)
            # Only readings far above the jitter, and below the limit of the converter, which cuts off noise.
            clear = (mean > 100 + 10 * proximity.jitter_counts[-1]) & (at_rest.max(axis=0) < proximity.maximum_counts)
            shares += (deviation(at_rest)[clear] / np.maximum(usual_counts[clear], 1e-9)).tolist()
        if not shares:
            return 1.0
        largest = 0.99 / proximity.noise_small if proximity.noise_small else 1.0
        return min(float(np.mean(shares)), largest)


def _wider(spec: RobotSpec, factor: float) -> RobotSpec:
    """Return a robot whose wheel base is larger by a factor."""
    return replace(spec, body=replace(spec.body, wheel_base_mm=spec.body.wheel_base_mm * factor))


def _mean_turn_deg(fit: Fit) -> tuple[float, float]:
    """Return by how much a turn was wider than the tables say, over all sweeps, and its standard deviation [deg]."""
    turn_deg = np.concatenate([rig.turn_deg for rig in fit.rigs])
    weights = np.concatenate([error.turn_deg for error in fit.rig_deviations]) ** -2.0
    return float(turn_deg @ weights / weights.sum()), float(weights.sum() ** -0.5)


def _check_fit(fit: Fit, marks_mm: Sequence[float]) -> None:
    """Raise a CalibrationError if measurements contradict each other."""
    gap_mm = fit.rigs[0].gap_mm
    worst = int(np.abs(gap_mm).argmax())
    error_mm, marked_mm = float(gap_mm[worst]), marks_mm[worst]
    if abs(error_mm) > GAP_ERROR_MAX_MM:
        raise CalibrationError(
            f"the measurements must agree with each other, but those at the {marked_mm:g} mm mark look like "
            f"{marked_mm + error_mm:.1f} mm compared with the others. Check the marks, measured from the wall to the "
            "robot's nearest rim, and that the wall is white all over; then start again."
        )
    if fit.misfit > MISFIT_MAX:
        raise CalibrationError(
            f"the measurements must be those of a robot before a white wall, but they miss by {fit.misfit:.1f} times "
            f"their noise. Is {shown(fit.spec.name)} the right --base, and was nothing else near the robot?"
        )


def _rounded(spec: RobotSpec) -> RobotSpec:
    """Return the robot with its measured numbers rounded for a file."""
    proximity, body = spec.proximity, spec.body
    digits = {"direction_deg": 2, "gain": 4, "baseline_counts": 1}
    changes: dict[str, Any] = {
        key: tuple(round(value, digit) for value in getattr(proximity, key)) for key, digit in digits.items()
    }
    body = replace(body, wheel_base_mm=round(body.wheel_base_mm, 3), pulse_mm=round(body.pulse_mm, 6))
    return replace(spec, body=body, proximity=replace(proximity, **changes))
