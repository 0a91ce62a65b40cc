"""What a robot among many costs: a control step in company, in a square with nothing but a border.

Run: python benchmarks/crowd.py [--json]. A step is 0.05 s: a reading of the eight proximity sensors by the default
response, with noise, a Braitenberg vehicle that keeps off what is near, and five ticks with motors, motion, contact and
collisions. `CROWDS` says how many robots share how large a square. Each case is a batch on one core, in as many worlds
as its bunches take; the robots stand where the seed puts them.

`crowd.steps_per_s_N_Sm` is the median of robot-steps in a second of the processor's time, for N robots in a square of S
metres; the cases take turns, and `crowd.cost_N_Sm_over_1` is the median of what a robot-step costs there over what it
costs alone in the same round.
`crowd.wire_...` are the same for programs in one square metre: each robot at the end of a line of 9600 baud in memory,
one program that sends `N` to all, reads all replies, sends `D` to all and reads those. A step is what that takes, some
60 ms. `crowd.steps_1_over_calibration` compares with a fixed piece of plain Python.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import kiks
from calibration import calibration_loops_per_s, report

CROWDS = {"1_1m": (1, 1), "10_1m": (10, 1), "100_1m": (100, 1), "100_3m": (100, 3), "1000_7m": (1000, 7)}
"""Robots in a world, and the edge of its square [m]."""

LEAST_ROBOTS = 64
"""As many worlds as have so many robots."""

STEPS, WIRE_STEPS = 40_000, 2_000
"""Robot-steps of a measurement, compiled and by the wire."""

WIRE_COUNTS, WIRE_REPEATS = (1, 100), 5

IDEAL = kiks.Timing(0.05, None)
"""The robots sense and act at once."""


@kiks.controller
def vehicle(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Drive, and turn away from what is near."""
    left = sensors[0] * 4 + sensors[1] * 6 - sensors[2] * 6 - sensors[3] * 18 - sensors[4] * 6 - sensors[5] * 4
    right = -sensors[0] * 4 - sensors[1] * 6 - sensors[2] * 14 - sensors[3] * 8 + sensors[4] * 6 + sensors[5] * 4
    wheels[0] = 8.0 + left / 200.0
    wheels[1] = 8.0 + right / 200.0


def crowd(name: str) -> Callable[[], float]:
    """Return what measures robot-steps in a second of the processor's time, for a case of `CROWDS`."""
    robots, edge_m = CROWDS[name]
    worlds, box = -(-LEAST_ROBOTS // robots), kiks.Arena.box(1000 * edge_m, 1000 * edge_m)
    batch = kiks.Batch(box, worlds, robots=robots, timing=IDEAL, threads=1, seed=1)
    seconds = STEPS / (worlds * robots) * IDEAL.period_s
    batch.run(vehicle, seconds=seconds)

    def measure() -> float:
        start_s = time.process_time()
        steps = batch.run(vehicle, seconds=seconds).step_counts.sum() * robots
        return float(steps / (time.process_time() - start_s))

    return measure


class WireCrowd:
    """Robots of a square metre at the ends of serial lines.

    Args:
        count: How many.
    """

    def __init__(self, count: int) -> None:
        self._sim = kiks.Simulation(kiks.Arena.box(1000, 1000), robots=count, seed=1)
        self._ports = [self._sim.port(robot) for robot in range(1, count + 1)]

    def steps_per_s(self) -> float:
        """Return robot-steps in a second of the processor's time."""
        step_count = max(WIRE_STEPS // len(self._ports), 1)
        start_s = time.process_time()
        for _ in range(step_count):
            for port in self._ports:
                port.write(b"N\n")
            commands = [self._command(port.readline()) for port in self._ports]
            for port, command in zip(self._ports, commands, strict=True):
                port.write(command)
            for port in self._ports:
                port.readline()
        return step_count * len(self._ports) / (time.process_time() - start_s)

    @staticmethod
    def _command(reply: bytes) -> bytes:
        sensors, wheels = [float(word) for word in reply.split(b",")[1:]], [0.0, 0.0]
        vehicle.function(sensors, (), (), wheels)
        return b"D,%d,%d\n" % tuple(map(int, wheels))


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--repeats", type=int, default=15, help="measurements of each figure")
    options = arguments.parse_args()

    calibration = calibration_loops_per_s()
    rows: list[tuple[str, float, str]] = []
    measures = {name: crowd(name) for name in CROWDS}
    rounds = [{name: measure() for name, measure in measures.items()} for _ in range(options.repeats)]
    first, *others = CROWDS
    for name in CROWDS:
        rows.append((f"crowd.steps_per_s_{name}", statistics.median(each[name] for each in rounds), "steps/CPU s"))
    for name in others:
        ratio = statistics.median(each[first] / each[name] for each in rounds)
        rows.append((f"crowd.cost_{name}_over_1", ratio, "of the cost of a robot alone"))
    wires = [WireCrowd(count) for count in WIRE_COUNTS]
    wired_rounds = zip(*([wire.steps_per_s() for wire in wires] for _ in range(WIRE_REPEATS)), strict=True)
    wired = [statistics.median(rates) for rates in wired_rounds]
    for count, rate in zip(WIRE_COUNTS, wired, strict=True):
        rows.append((f"crowd.wire_steps_per_s_{count}", rate, "steps/CPU s"))
    rows.append(("crowd.wire_cost_100_over_1", wired[0] / wired[1], "of the cost of a robot alone"))
    rows.append(("crowd.steps_1_over_calibration", rows[0][1] / calibration, "steps a calibration loop"))
    report(rows, as_json=options.json)


if __name__ == "__main__":
    main()
