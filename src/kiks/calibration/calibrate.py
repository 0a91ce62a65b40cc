"""Calibration: measures the constants of one robot over its line, in a few placements in front of a white wall."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from kiks.calibration.measurements import (
    SPIN_TURNS,
    Array,
    CalibrationError,
    Rest,
    Run,
    drive,
    halt,
    processing_ms,
    rest,
    spin,
)
from kiks.calibration.placements import Instruction, Place, Placements
from kiks.calibration.wall_fit import Fit, WallModel, fit_runs, guess_pulse
from kiks.client.khepera import Khepera
from kiks.engine.sensing.thesis_networks import NETWORK_RESPONSES
from kiks.errors import LinkError, ParameterError, shown
from kiks.model.robot import RESPONSES, SENSOR_COUNT, RobotSpec

GAP_SHARES, FAINT_SHARE = (0.15, 0.45, 0.7, 0.95), 0.03
"""Gaps at which the robot spins, as shares of the gap at which the best sensor reads `FAINT_SHARE` of the maximum."""

ALONG_GAP = 1
"""Index of the gap at which it drives along the wall: near enough to see it well, far enough not to touch it."""

ALONG_MM = 100.0
"""Length of the drive along the wall [mm]."""

RUN_UP_MM = 500.0
"""Marked gap from which it drives towards the wall [mm]."""

FREE_SAMPLES, GAP_SAMPLES = 200, 100
"""Number of readings at rest: in the open, and before each spin."""

ATTEMPTS = 3
"""Most attempts at a placement."""

FRONT = slice(1, 5)
"""The sensors that look ahead."""

NEAR_SHARE, TOUCHING_MM = 0.5, 2.0
"""The robot stops when a front sensor reads this share of the weakest one's count at a gap of `TOUCHING_MM`."""

SEEN_COUNTS, FAINT_COUNTS = 50.0, 10.0
"""Smallest reading above the baseline that shows a wall [counts]: near the wall, and where little is expected."""

GAP_ERROR_MAX_MM = 3.0
"""Largest gap error of a run that agrees with the others [mm]."""

MISFIT_MAX = 6.0
"""Largest root mean square of the residuals for measurements of such a robot."""

Result = TypeVar("Result")
Say = Callable[[str], None]


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    Attributes:
        spec: The robot.
        fit: The fit, with uncertainties.
        jitter_counts: Mean absolute deviation of each sensor in the open [counts].
    """

    spec: RobotSpec
    fit: Fit
    jitter_counts: tuple[float, ...]

    def lines(self) -> list[str]:
        """Return the result as lines of text, each number with its uncertainty (one standard deviation)."""
        body, proximity, error = self.spec.body, self.spec.proximity, self.fit.uncertainty
        base_mm, pulse_mm = error[2 * SENSOR_COUNT :] * (body.wheel_base_mm, body.pulse_mm)
        lines = [
            f"wheel base    {body.wheel_base_mm:.3f} +- {base_mm:.3f} mm",
            f"pulse length  {body.pulse_mm:.6f} +- {pulse_mm:.6f} mm",
            f"processing    {self.spec.firmware.processing_ms:.2f} ms",
            f"misfit        {self.fit.misfit:.2f} (1: as good as the readings are steady)",
        ]
        for sensor in range(SENSOR_COUNT):
            gain = proximity.gain[sensor]
            lines.append(
                f"sensor {sensor}      looks to {proximity.direction_deg[sensor]:6.1f} +- {error[sensor]:.1f} deg, "
                f"gain {gain:.3f} +- {gain * error[SENSOR_COUNT + sensor]:.3f}, "
                f"baseline {proximity.baseline_counts[sensor]:.0f}, jitter {self.jitter_counts[sensor]:.1f} counts"
            )
        return lines


def calibrate(
    robot: Khepera,
    placements: Placements,
    base: RobotSpec,
    *,
    baud: int = 9600,
    gaps_mm: Sequence[float] | None = None,
    run_up_mm: float = RUN_UP_MM,
    say: Say = lambda text: None,
) -> Calibration:
    """Measure a robot; it stands still when this function returns or raises.

    Args:
        robot: The robot.
        placements: Puts the robot where a measurement needs it.
        base: The kind of robot; it gives all constants that are not measured.
        baud: Speed of its line [bit/s].
        gaps_mm: Marked distances from wall to rim [mm], at least two; `default_gaps_mm` if left out.
        run_up_mm: Marked gap from which it drives towards the wall [mm].
        say: Called with a line of text about each step.

    Raises:
        CalibrationError: If a measurement shows something unexpected, or measurements contradict each other.
        LinkError: If the robot does not answer.
    """
    check_response(base)
    gaps = checked_gaps(gaps_mm, run_up_mm, base)
    bios, protocol = robot.version()
    say(f"A Khepera answers: BIOS {bios}, protocol {protocol}.")
    try:
        halt(robot)
        return _Session(robot, placements, base, baud, say).measure(gaps, run_up_mm)
    finally:
        halt(robot)


def check_response(base: RobotSpec) -> None:
    """Check that the simulated robot's sensors depend on what is measured."""
    if base.proximity.response in NETWORK_RESPONSES:
        others = [response for response in RESPONSES if response not in NETWORK_RESPONSES]
        raise ParameterError(
            f"the response of the --base must be one of {others}, but it was {shown(base.proximity.response)}, whose "
            "directions are those of the robot it was trained on. Calibrate with the response that a robot of ours has."
        )


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
    """Return the reading of each sensor above its baseline as it faces a wall [counts], shape [gap, 8]."""
    model, gaps = WallModel(spec), np.asarray(gaps_mm, np.float64)
    above = np.empty((len(gaps), SENSOR_COUNT))
    for sensor, (direction_deg, baseline) in enumerate(
        zip(spec.proximity.direction_deg, spec.proximity.baseline_counts, strict=True)
    ):
        headings_rad = np.full(len(gaps), -math.radians(direction_deg))
        above[:, sensor] = model.readings(spec, gaps, headings_rad)[:, sensor] - baseline
    return above


class _Session:
    """One calibration in progress."""

    def __init__(self, robot: Khepera, placements: Placements, base: RobotSpec, baud: int, say: Say) -> None:
        self.robot = robot
        self.placements = placements
        self.spec = base
        self.baud = baud
        self.say = say
        self.rests: list[Rest] = []

    def measure(self, gaps: list[float], run_up_mm: float) -> Calibration:
        jitter = self._at(
            Instruction(Place.FREE, "Put the robot in the open: nothing within 300 mm, no lamp, no sun."),
            self._measure_in_the_open,
        )
        runs: list[Run] = []
        for index, gap_mm in enumerate(gaps):
            text = f"Put the robot before the wall, facing it, its rim at the {gap_mm:g} mm mark."
            measure = partial(
                self._measure_before_the_wall, before=tuple(runs), is_along=index == ALONG_GAP, is_nearest=index == 0
            )
            runs += self._at(Instruction(Place.WALL, text, gap_mm), measure)
        text = f"Put the robot before the wall, facing it squarely, its rim at the {run_up_mm:g} mm mark."
        runs.append(self._at(Instruction(Place.WALL, text, run_up_mm), self._measure_run_up))
        self.say("Fitting ...")
        guess = fit_runs(self.spec, [run.thinned(2) for run in runs[:-1]]).spec
        fit = fit_runs(self.spec, runs, guess_pulse(self.spec, guess, runs[-1]))
        _check_fit(fit, runs)
        spec = fit.spec
        noise = {key: round(getattr(spec.proximity, key) * self._noise_factor(fit.spec), 4) for key in _NOISE}
        spec = replace(spec, name=f"{self.spec.name} (calibrated)", proximity=replace(spec.proximity, **noise))
        return Calibration(_rounded(spec), fit, jitter)

    def _at(self, instruction: Instruction, measure: Callable[[float], tuple[Result, str]]) -> Result:
        """Have the robot placed and measure, again if a repetition is wanted; return the measurement."""
        for attempt in range(1, ATTEMPTS + 1):
            gap_mm = self.placements.place(instruction)
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

    def _measure_in_the_open(self, _: float) -> tuple[tuple[float, ...], str]:
        measured_ms = processing_ms(self.robot, self.baud)
        at_rest = rest(self.robot, FREE_SAMPLES)
        mean = at_rest.counts.mean(axis=0)
        if mean.max() > self.spec.proximity.maximum_counts / 3:
            raise CalibrationError(
                f"the sensors must read little in the open, but sensor {int(mean.argmax())} reads "
                f"{mean.max():.0f} counts. Remove objects and lamps near the robot."
            )
        jitter, deviation = at_rest.jitter(), at_rest.deviation()
        proximity = replace(
            self.spec.proximity, baseline_counts=tuple(mean.tolist()), jitter_counts=tuple(jitter.round(1).tolist())
        )
        firmware = replace(self.spec.firmware, processing_ms=min(round(measured_ms, 2), 1000.0))
        self.spec = replace(self.spec, proximity=proximity, firmware=firmware)
        baselines = ", ".join(f"{count:.0f}" for count in mean)
        noise = f"jitter {deviation.mean():.1f} counts; a command takes {measured_ms:.2f} ms"
        return tuple(deviation.tolist()), f"Baselines {baselines}; {noise}."

    def _measure_before_the_wall(
        self, gap_mm: float, *, before: tuple[Run, ...], is_along: bool, is_nearest: bool
    ) -> tuple[list[Run], str]:
        self.rests.append(rest(self.robot, GAP_SAMPLES))
        # In both directions, because readings are older than counters.
        left = spin(self.robot, self.spec, gap_mm, SPIN_TURNS)
        right = spin(self.robot, self.spec, gap_mm, -SPIN_TURNS)
        runs = [left, replace(right, is_marked=False)]
        above = np.concatenate([run.counts for run in runs]).max(axis=0) - np.array(self.spec.proximity.baseline_counts)
        enough = min(max(facing_counts(self.spec, [gap_mm]).max() / 2, FAINT_COUNTS), SEEN_COUNTS)
        if above.max() < enough:
            raise CalibrationError(
                f"some sensor must see the wall at {gap_mm:g} mm, but none reads more than {above.max():.0f} counts "
                "above its baseline. Is the wall white, upright and at the mark?"
            )
        if is_nearest and above.min() < SEEN_COUNTS:
            raise CalibrationError(
                f"every sensor must see the wall at {gap_mm:g} mm as the robot spins, but sensor {int(above.argmin())} "
                f"reads no more than {above.min():.0f} counts above its baseline. Is it covered or broken?"
            )
        if is_along:
            runs = self._drive_along(gap_mm, before, runs)
        largest = ", ".join(f"{count:.0f}" for count in above)
        return runs, f"Largest readings at {gap_mm:g} mm, above the baseline: {largest}."

    def _drive_along(self, gap_mm: float, before: tuple[Run, ...], runs: list[Run]) -> list[Run]:
        """Drive along the wall and back, first with the left and then with the right side to it.

        A first fit of the runs so far gives the heading from which it turns. Each drive is one run with the turn before
        it, and the first one with the last spin, too: the readings during a turn give the heading, and the counters
        give the path from there.

        Returns:
            The runs at this gap, with the drives.
        """
        fit = fit_runs(self.spec, [run.thinned(3) for run in (*before, *runs)])
        body = fit.spec.body
        heading_rad = fit.end_heading_rad(len(before) + len(runs) - 1, runs[-1])
        drives = []
        for side_rad in (-math.pi / 2, math.pi / 2):
            turn_rad = math.remainder(side_rad - heading_rad, 2 * math.pi)
            turn = spin(self.robot, fit.spec, gap_mm, turn_rad / (2 * math.pi))
            heading_rad += turn.turned_pulses() * body.pulse_mm / body.wheel_base_mm
            drives.append(turn.then(drive(self.robot, fit.spec, gap_mm, ALONG_MM)))
            drive(self.robot, fit.spec, gap_mm, -ALONG_MM)
        return [*runs[:-1], runs[-1].then(drives[0]), replace(drives[1], is_marked=False)]

    def _measure_run_up(self, gap_mm: float) -> tuple[Run, str]:
        touching = facing_counts(self.spec, [TOUCHING_MM])[0, FRONT].min()
        near = NEAR_SHARE * touching + np.array(self.spec.proximity.baseline_counts[FRONT])

        def is_near(counts: Sequence[float]) -> bool:
            return bool((np.array(counts[FRONT]) >= near).any())

        run = drive(self.robot, self.spec, gap_mm, 1.1 * gap_mm, is_near)
        if not is_near(run.counts[-1].tolist()):
            front = ", ".join(f"{count:.0f}" for count in run.counts[-1][FRONT])
            raise CalibrationError(
                f"the wall must come into sight {gap_mm:g} mm ahead, but after {run.end_pulses[0]} pulses the front "
                f"sensors read {front}. Put the robot at the mark, facing the wall squarely."
            )
        finding = f"The wall was near after {sum(run.end_pulses) / 2:.0f} pulses."
        # A heading that is a few degrees off shortens the path as a longer pulse does: a spin gives the heading.
        return run.then(spin(self.robot, self.spec, gap_mm, SPIN_TURNS)), finding

    def _noise_factor(self, spec: RobotSpec) -> float:
        """Return the ratio of this robot's relative noise to that of its kind, at rest near the wall."""
        proximity = spec.proximity
        shares = []
        for at_rest in self.rests:
            mean = at_rest.counts.mean(axis=0)
            usual_share = proximity.noise_small - (proximity.noise_small - proximity.noise_large) * mean / 1000
            usual_counts = mean * usual_share / (proximity.noise_exponent + 1)
            # Only readings far above the jitter, and below the limit of the converter, which cuts off noise.
            clear = (mean > 100 + 10 * proximity.jitter_counts[-1]) & (
                at_rest.counts.max(axis=0) < proximity.maximum_counts
            )
            shares += (at_rest.deviation()[clear] / np.maximum(usual_counts[clear], 1e-9)).tolist()
        if not shares:
            return 1.0
        largest = 0.99 / proximity.noise_small if proximity.noise_small else 1.0
        return min(float(np.mean(shares)), largest)


_NOISE = ("noise_small", "noise_large")


def _check_fit(fit: Fit, runs: Sequence[Run]) -> None:
    """Raise a CalibrationError if measurements contradict each other."""
    worst = int(np.abs(fit.gap_errors_mm).argmax())
    error_mm, marked_mm = float(fit.gap_errors_mm[worst]), runs[worst].gap_mm
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
