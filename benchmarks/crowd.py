"""What a robot among many costs: the workload "arena" of Enki's kind, for 1, 10, 100 and 1000 robots.

Run: python benchmarks/crowd.py [--json]. A step is 0.05 s: five ticks, and before them one full reading of each robot's
eight proximity sensors by its default response, with noise, from which a Braitenberg controller sets its speeds. The
loop is compiled; everything else is what a simulation does.

The world is 1 m x 1 m with a border of 10 mm, four boxes and four fixed cylinders. Robots stand where a linear
congruential generator puts them. In one square metre there is no room for 1000 robots: for them the world is
repeated, five tiles by two, with their borders, and each tile gets its hundred from the same generator, one tile
after the other. So 1000 differ from 100 by what does not fit into the processor's caches, and by nothing else.

`crowd.steps_per_s_N` is the median of robot-steps a second; the numbers of robots take turns, and
`crowd.cost_N_over_1` is the median of what a robot-step costs among N over what it costs alone in the same round.
`crowd.wire_...` are the same for programs: each robot at the end of a line of 9600 baud in memory, one program that
sends `N` to all, reads all replies, sends `D` to all and reads those. A step is what that takes, some 60 ms.
`crowd.steps_1_over_calibration` compares with a fixed piece of plain Python.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from typing import Any

import numpy as np
from numba import njit

import kiks
from calibration import calibration_loops_per_s, report
from kiks.engine import step
from kiks.engine.scene import open_scene
from kiks.engine.sensing import proximity
from kiks.units import TICK_NS

COUNTS = (1, 10, 100, 1000)
TILE_MM, BORDER_MM, PER_TILE, TILES_ACROSS = 1000, 10, 100, 5
BOXES = ((300, 500, 20, 400), (700, 500, 20, 400), (500, 250, 300, 20), (500, 750, 300, 20))
"""Centre and size [mm]."""
POSTS, POST_RADIUS_MM = ((150, 150), (850, 150), (150, 850), (850, 850)), 30.0
TICKS_PER_STEP = 5
WARM_STEPS, STEPS, WIRE_STEPS = 200, 20_000, 2_000
"""Steps before anything is measured, and robot-steps of a measurement, compiled and by the wire."""

WEIGHTS = np.array([(4, 6, -6, -18, -6, -4, 0, 0), (-4, -6, -14, -8, 6, 4, 0, 0)], np.float64)
"""Of the left and of the right wheel [cm/s] for a full reading of each sensor."""

WIRE_WEIGHTS = WEIGHTS.tolist()


@njit(error_model="numpy", nogil=True)  # type: ignore[untyped-decorator, unused-ignore]
def drive(scene: Any, weights: Any, tick: int, step_count: int, out: Any) -> None:
    """Let all robots go their ways for some steps."""
    robots, kinds = open_scene(scene[0]).robots, open_scene(scene[0]).kinds
    for _ in range(step_count):
        for number in range(robots.shape[1]):
            proximity.read_proximity(scene, number, tick, tick * TICK_NS, True, out)
            robot = robots[0, number]
            for wheel in range(2):
                speed_cm_s = 8.0
                for sensor in range(8):
                    # Half of 1200, the full scale of Enki's sensors.
                    speed_cm_s += weights[wheel, sensor] * min(out[sensor] / 600.0, 1.0)
                robot.speed_setpoint[wheel] = np.int32(speed_cm_s * 0.1 / kinds[robot.kind].pulse_mm)
        step.advance(scene, tick, TICKS_PER_STEP)
        tick += TICKS_PER_STEP


def tile() -> np.ndarray:
    """Return the picture of one world, a pixel a millimetre."""
    picture = np.zeros((TILE_MM, TILE_MM), np.uint8)
    rows, columns = np.mgrid[:TILE_MM, :TILE_MM] + 0.5
    rows = TILE_MM - rows
    for x, y, wide, high in BOXES:
        picture[(abs(columns - x) < wide / 2) & (abs(rows - y) < high / 2)] = 255
    for x, y in POSTS:
        picture[(columns - x) ** 2 + (rows - y) ** 2 <= POST_RADIUS_MM**2] = 255
    inside = picture[BORDER_MM:-BORDER_MM, BORDER_MM:-BORDER_MM]
    return np.pad(inside, BORDER_MM, constant_values=255)


def start_poses(count: int) -> list[tuple[float, float, float]]:
    """Return poses of robots in one world [mm, rad]: the middle for one alone, else drawn."""
    if count == 1:
        return [(500.0, 500.0, 0.0)]
    state = 12345
    poses: list[tuple[float, float, float]] = []

    def draw() -> float:
        nonlocal state
        state = (6364136223846793005 * state + 1442695040888963407) % 2**64
        return (state >> 11) / 2.0**53

    while len(poses) < count:
        x, y, heading = 40.0 + 920.0 * draw(), 40.0 + 920.0 * draw(), 2.0 * math.pi * draw()
        gaps = [math.hypot(max(abs(x - u) - w / 2, 0.0), max(abs(y - v) - h / 2, 0.0)) - 30.0 for u, v, w, h in BOXES]
        gaps += [math.hypot(x - u, y - v) - POST_RADIUS_MM - 30.0 for u, v in POSTS]
        gaps += [math.hypot(x - u, y - v) - 56.0 for u, v, _ in poses]
        if min(gaps) >= 0.0:
            poses.append((x, y, heading))
    return poses


class Crowd:
    """Some robots on their ways.

    Args:
        count: How many.
    """

    def __init__(self, count: int) -> None:
        tiles = -(-count // PER_TILE)
        across = min(tiles, TILES_ACROSS)
        arena = kiks.Arena.from_array(np.tile(tile(), (-(-tiles // across), across)))
        self.sim = kiks.Simulation(arena, robots=count, seed=1)
        robots: Any = self.sim.world.state.robots[0]
        for index in range(count):
            x, y, heading = start_poses(min(count, PER_TILE))[index % PER_TILE]
            row, column = divmod(index // PER_TILE, across)
            robots["x_mm"][index], robots["y_mm"][index] = x + column * TILE_MM, y + row * TILE_MM
            robots["heading_rad"][index] = heading
        robots["trail"] = np.stack([robots["x_mm"], robots["y_mm"], robots["heading_rad"]], axis=-1)[:, None]
        self.count = count
        self.tick = 0
        self._out = np.zeros(8)
        self.run(1 if count == max(COUNTS) else WARM_STEPS)

    def run(self, step_count: int) -> None:
        """Do some steps."""
        drive(self.sim.world.scene, WEIGHTS, self.tick, step_count, self._out)
        self.tick += step_count * TICKS_PER_STEP

    def step_s(self) -> float:
        """Return what a step of one robot takes [s]."""
        step_count = max(STEPS // self.count, 1)
        start_s = time.perf_counter()
        self.run(step_count)
        return (time.perf_counter() - start_s) / step_count / self.count


class WireCrowd(Crowd):
    """The same robots at the ends of serial lines.

    Args:
        count: How many.
    """

    def __init__(self, count: int) -> None:
        super().__init__(count)
        self.sim.advance_to(self.tick * TICK_NS)
        self.sim.world.state.tick_count = self.tick
        self._ports = [self.sim.port(robot) for robot in range(1, count + 1)]

    def step_s(self) -> float:
        """Return what a step of one robot takes [s]."""
        step_count = max(WIRE_STEPS // self.count, 1)
        start_s = time.perf_counter()
        for _ in range(step_count):
            for port in self._ports:
                port.write(b"N\n")
            commands = [self._command(port.readline()) for port in self._ports]
            for port, command in zip(self._ports, commands, strict=True):
                port.write(command)
            for port in self._ports:
                port.readline()
        return (time.perf_counter() - start_s) / step_count / self.count

    @staticmethod
    def _command(reply: bytes) -> bytes:
        readings = [min(float(word) / 600.0, 1.0) for word in reply.split(b",")[1:]]
        speeds = (
            8.0 + sum(weight * reading for weight, reading in zip(row, readings, strict=True)) for row in WIRE_WEIGHTS
        )
        return b"D,%d,%d\n" % tuple(int(speed_cm_s * 1.25) for speed_cm_s in speeds)


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--repeats", type=int, default=15, help="measurements of each figure")
    options = arguments.parse_args()

    calibration = calibration_loops_per_s()
    rows: list[tuple[str, float, str]] = []
    for name, kind in (("", Crowd), ("wire_", WireCrowd)):
        crowds = [kind(count) for count in COUNTS]
        rounds = [[crowd.step_s() for crowd in crowds] for _ in range(options.repeats)]
        alone, *others = zip(*rounds, strict=True)
        for count, steps_s in zip(COUNTS, (alone, *others), strict=True):
            rows.append((f"crowd.{name}steps_per_s_{count}", 1.0 / statistics.median(steps_s), "1/s"))
        for count, steps_s in zip(COUNTS[1:], others, strict=True):
            ratio = statistics.median(own / first for own, first in zip(steps_s, alone, strict=True))
            rows.append((f"crowd.{name}cost_{count}_over_1", ratio, "of the cost of a robot alone"))
    rows.append(("crowd.steps_1_over_calibration", rows[0][1] / calibration, "steps a calibration loop"))
    report(rows, as_json=options.json)


if __name__ == "__main__":
    main()
