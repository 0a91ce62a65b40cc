"""What sensors cost: a second of each one's readings against a second of proximity, for robots at work.

Run: python benchmarks/sensors.py [--json]. `sensors.SENSOR.ARENA_BEHAVIOUR` is the time of all that a sensor reads in a
simulated second, at its rate in `CASES`, over the time of 50 rounds of proximity with noise; they take turns, and the
figure is the median of the ratios. For proximity itself it is the number of rounds in the time of a fixed piece of
plain Python, measured in the same run. Calls are made from Python, as the simulation does.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from calibration import calibration_loops_per_s, report

import kiks
from kiks.demos.avoid import Avoid
from kiks.demos.follow import Follow
from kiks.engine import ambient, camera, proximity
from kiks.engine.parameters import pack
from kiks.engine.state import PIXEL_COUNT
from kiks.model.robot import SENSOR_COUNT
from kiks.units import TICK_NS

ARENAS = Path(__file__).parent.parent / "examples" / "arenas"
RIDES = (("default", Follow), ("default", Avoid), ("office", Follow), ("office", Avoid))
MOMENTS, LOOPS_BETWEEN = 400, 5
TICK = 1000  # all moments are taken to be this tick


@dataclass(frozen=True)
class Ride:
    """Moments of one robot's ride: its records of the state side by side, as if each were a robot of its own."""

    name: str
    robots: Any
    kinds: Any
    sight: Any
    lamps: Any

    @staticmethod
    def drive(arena: str, behaviour: type[Follow] | type[Avoid]) -> Ride:
        """Let a robot drive through an arena and remember it every few loops."""
        sim = kiks.Simulation(kiks.Arena.load(ARENAS / f"{arena}.toml"), seed=1)
        robot, program = kiks.Khepera(sim.port(1)), behaviour()
        moments = []
        for _ in range(MOMENTS):
            for _ in range(LOOPS_BETWEEN):
                program.step(robot)
            sim.sync()
            moments.append(sim.state.robots[0, 0].copy())
        kinds = np.repeat(pack(sim.spec), MOMENTS)
        name = f"{arena}_{behaviour.__name__.lower()}"
        return Ride(name, np.array(moments).reshape(1, -1), kinds, sim.sight, sim.lamps)


def read_proximity(ride: Ride) -> None:
    out = np.zeros(SENSOR_COUNT, np.int64)
    for k in range(MOMENTS):
        proximity.read_proximity(ride.robots, ride.kinds, ride.sight, TICK, TICK * TICK_NS, 1, k, True, out)


def read_ambient(ride: Ride) -> None:
    out = np.zeros(SENSOR_COUNT, np.int64)
    for k in range(MOMENTS):
        ambient.read_ambient(ride.robots, ride.kinds, ride.sight, ride.lamps, TICK, TICK * TICK_NS, 1, k, True, out)


def take_images(ride: Ride) -> None:
    out = np.zeros(PIXEL_COUNT, np.float64)
    for k in range(MOMENTS):
        camera.take_image(ride.robots, ride.sight, TICK, TICK * TICK_NS, 1, k, True, out)


@dataclass(frozen=True)
class Case:
    """A sensor: what it is called, how often a robot reads it, and what reads it once at each moment of a ride."""

    name: str
    rate_hz: float
    read: Callable[[Ride], None]


CASES = (
    Case("proximity", 50, read_proximity),
    Case("ambient", 50, read_ambient),
    Case("camera", 20, take_images),
)
"""The first is what the others are compared with."""


def readings_s(case: Case, ride: Ride) -> float:
    """Return the time of one reading [s]."""
    start_s = time.perf_counter()
    case.read(ride)
    return (time.perf_counter() - start_s) / MOMENTS


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--repeats", type=int, default=51, help="measurements of each figure")
    options = arguments.parse_args()

    calibration = calibration_loops_per_s()
    rows: list[tuple[str, float, str]] = []
    for arena, behaviour in RIDES:
        ride = Ride.drive(arena, behaviour)
        for case in CASES:
            case.read(ride)
        rounds = [[readings_s(case, ride) for case in CASES] for _ in range(options.repeats)]
        reference_s, *others_s = zip(*rounds, strict=True)
        rate = 1 / statistics.median(reference_s)
        rows.append((f"sensors.{CASES[0].name}.{ride.name}", rate / calibration, "rounds a calibration loop"))
        for case, times_s in zip(CASES[1:], others_s, strict=True):
            share = case.rate_hz / CASES[0].rate_hz
            ratio = share * statistics.median(own / first for own, first in zip(times_s, reference_s, strict=True))
            rows.append((f"sensors.{case.name}.{ride.name}", ratio, f"of {CASES[0].name}'s time"))
    report(rows, as_json=options.json)


if __name__ == "__main__":
    main()
