"""How well `kiks calibrate` finds the hidden parameters of simulated robots: the table of docs/howto/calibration.md.

    .venv/bin/python benchmarks/calibration_errors.py

Each robot differs from its kind in all that a calibration should find, by as much as real ones do: directions by up to
8 degrees, gains by a factor whose logarithm has the standard deviation 0.25, wheels by 3 %. The program sees nothing
but the wire. "By hand" puts it down up to 0.5 mm beside each mark and up to 8 degrees askew.
"""

from __future__ import annotations

import math
import os
import random
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from numpy.typing import NDArray

import kiks
from kiks.fit.calibrate import calibrate
from kiks.fit.placements import SimPlacements
from kiks.fit.robot_fit import predict
from kiks.fit.samples import Samples

SEEDS = range(8)


def hidden_robot(seed: int, base: kiks.RobotSpec) -> kiks.RobotSpec:
    """Return a robot unlike its kind in all that a calibration should find."""
    rng = random.Random(seed)
    proximity, body = base.proximity, base.body
    jitter, noise = rng.uniform(0.6, 1.6), rng.uniform(0.7, 1.4)
    return base.with_changes(
        proximity__direction_deg=tuple(angle + rng.uniform(-8, 8) for angle in proximity.direction_deg),
        proximity__gain=tuple(gain * math.exp(rng.gauss(0.0, 0.25)) for gain in proximity.gain),
        proximity__baseline_counts=tuple(rng.uniform(2, 40) for _ in proximity.baseline_counts),
        proximity__jitter_counts=tuple(jitter * count for count in proximity.jitter_counts),
        proximity__noise_small=noise * proximity.noise_small,
        proximity__noise_large=noise * proximity.noise_large,
        body__pulse_mm=body.pulse_mm * rng.uniform(0.97, 1.03),
        body__wheel_base_mm=body.wheel_base_mm * rng.uniform(0.97, 1.03),
        firmware__processing_ms=rng.uniform(0.5, 4.0),
    )


def half_distances_mm(spec: kiks.RobotSpec, hidden: kiks.RobotSpec) -> list[float]:
    """Return the gap [mm] at which each sensor of a robot reads half of what the hidden one's reads at the wall.

    Both stand so that the hidden one's sensor looks straight at it. For a Khepera the half is 512 counts.
    """
    gaps_mm = np.arange(0.5, spec.proximity.range_mm, 0.25)
    angle_deg = np.tile(-np.array(hidden.proximity.direction_deg), (len(gaps_mm), 1))
    wall = Samples("wall", math.inf, gaps_mm, angle_deg, np.zeros((*angle_deg.shape, 8), np.int64))
    readings, halves = (np.diagonal(predict(each, wall), axis1=1, axis2=2) for each in (spec, hidden))
    return [float(np.interp(-halves[0, i] / 2, -readings[:, i], gaps_mm)) for i in range(8)]


class ByHand(SimPlacements):
    """A careful person with ordinary eyes."""

    def __init__(self, sim: kiks.Simulation, seed: int) -> None:
        super().__init__(sim)
        self.rng = random.Random(1000 + seed)

    def place(self, instruction: str, gap_mm: float | None = None) -> float | None:
        """Put the robot about there and return the gap that it should have [mm]."""
        self.skew_rad = math.radians(self.rng.uniform(-8, 8))
        super().place(instruction, None if gap_mm is None else gap_mm + self.rng.uniform(-0.5, 0.5))
        return gap_mm


def errors(kind: str, seed: int, *, is_by_hand: bool) -> NDArray[np.float64]:
    """Return by how much a calibration is off, one column a sensor.

    The rows are direction [deg], half distance [mm], pulse length [%], wheel base [%] and processing time [ms].
    """
    base = kiks.RobotSpec.load(kind)
    hidden = hidden_robot(seed, base)
    sim = kiks.Simulation(robot=hidden, seed=seed)
    hand = ByHand(sim, seed) if is_by_hand else SimPlacements(sim)
    found = calibrate(kiks.Khepera(sim.port(1)), hand, base).spec
    single = [
        100 * (found.body.pulse_mm / hidden.body.pulse_mm - 1),
        100 * (found.body.wheel_base_mm / hidden.body.wheel_base_mm - 1),
        found.firmware.processing_ms - hidden.firmware.processing_ms,
    ]
    off = [
        np.subtract(found.proximity.direction_deg, hidden.proximity.direction_deg),
        np.subtract(half_distances_mm(found, hidden), half_distances_mm(hidden, hidden)),
        *(np.full(len(base.proximity.gain), value) for value in single),
    ]
    return np.abs(np.array(off))


def main() -> None:
    """Print the largest and the median error of each kind and way."""
    names = ("direction [deg]", "half distance [mm]", "pulse length [%]", "wheel base [%]", "processing time [ms]")
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for kind in ("khepera", "khepera_ii"):
            for is_by_hand in (False, True):
                jobs = [pool.submit(errors, kind, seed, is_by_hand=is_by_hand) for seed in SEEDS]
                off = np.concatenate([job.result() for job in jobs], axis=1)
                print(f"{kind}, {'by hand' if is_by_hand else 'at the marks'}: {len(SEEDS)} robots")
                for name, row in zip(names, off, strict=True):
                    print(f"  {name:22} largest {row.max():.3f}, median {np.median(row):.3f}", flush=True)


if __name__ == "__main__":
    main()
