"""What sensors cost: a second of each one's readings against a second of proximity, and each response of proximity.

Run: python benchmarks/sensors.py [--json]. `sensors.SENSOR.ARENA_BEHAVIOUR` is the time of all that a sensor reads in a
simulated second, at its rate in `CASES`, over the time of 50 rounds of proximity with noise; they take turns, and the
figure is the median of the ratios. For proximity itself it is the number of rounds in the time of a fixed piece of
plain Python, measured in the same run. Calls are made from Python, as the simulation does.

`sensors.response_RESPONSE` is the time of a reading without noise, rays and all, over that with the thesis's networks,
for robots that stand 2 to 25 mm from a wall, many in one call; they take turns, too. `sensors.response_thesis_ns` is
that time itself [ns]. The arena is small: it stays in the cache, as the surroundings of one robot do.
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
from behaviours import Avoid, Follow

import kiks
from calibration import calibration_loops_per_s, report
from kiks.engine.parameters import pack
from kiks.engine.scene import Scene
from kiks.engine.sensing import ambient, camera, observe, proximity
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.engine.state import PIXEL_COUNT
from kiks.model.robot import SENSOR_COUNT, RobotSpec
from kiks.units import TICK_NS

ARENAS = Path(__file__).parent.parent / "examples" / "arenas"
RIDES = (("default", Follow), ("default", Avoid), ("office", Follow), ("office", Avoid))
MOMENTS, LOOPS_BETWEEN = 400, 5
TICK = 1000  # all moments are taken to be this tick

RESPONSES = ("thesis", "fast", "reflection")
"""Responses of the Khepera; the first is what the others are compared with."""

PLACES, NEAREST_MM, FARTHEST_MM = 1000, 2.0, 25.0
"""Robots in one call, and how far they are from a wall."""


def scene_of(sim: kiks.Simulation, spec: RobotSpec) -> Scene:
    """Return a scene of its own of a simulation's present state, with a robot of some kind."""
    networks = networks_for(spec.proximity.response)
    return Scene(sim.world.state.snapshot(), pack(spec), [sim.arena], networks, sim.lamps[None], [1])


@dataclass(frozen=True)
class Ride:
    """Moments of one robot's ride, each a scene of its own with a record of the state."""

    name: str
    scenes: list[Scene]

    @staticmethod
    def drive(arena: str, behaviour: type[Follow] | type[Avoid]) -> Ride:
        """Let a robot drive through an arena and remember it every few loops."""
        sim = kiks.Simulation(kiks.Arena.load(ARENAS / f"{arena}.toml"), seed=1)
        robot, program = kiks.Khepera(sim.port(1)), behaviour()
        scenes = []
        for _ in range(MOMENTS):
            for _ in range(LOOPS_BETWEEN):
                program.step(robot)
            sim.sync()
            scenes.append(scene_of(sim, sim.spec))
        return Ride(f"{arena}_{behaviour.__name__.lower()}", scenes)


def read_proximity(ride: Ride) -> None:
    out = np.zeros(SENSOR_COUNT)
    for scene in ride.scenes:
        proximity.read_proximity(scene.record, 0, TICK, TICK * TICK_NS, True, out)


def read_ambient(ride: Ride) -> None:
    out = np.zeros(SENSOR_COUNT)
    for scene in ride.scenes:
        ambient.read_ambient(scene.record, 0, TICK, TICK * TICK_NS, True, out)


def take_images(ride: Ride) -> None:
    out = np.zeros(PIXEL_COUNT, np.float64)
    for scene in ride.scenes:
        camera.take_image(scene.record, 0, TICK, TICK * TICK_NS, True, out)


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


def poses_by_walls(arena: kiks.Arena, radius_mm: float) -> Any:
    """Return poses of robots near walls, x, y [mm] and heading [rad], shape [pose, 3]."""
    rng = np.random.default_rng(1)
    found: list[tuple[float, float, float]] = []
    while len(found) < PLACES:
        x, y = rng.uniform(0, arena.width_mm), rng.uniform(0, arena.height_mm)
        if NEAREST_MM <= arena.clearance_at_mm(x, y) - radius_mm <= FARTHEST_MM:
            found.append((x, y, rng.uniform(-np.pi, np.pi)))
    return np.array(found)


def response_rows(repeats: int) -> list[tuple[str, float, str]]:
    """Return what a reading costs with each response."""
    sim = kiks.Simulation(kiks.Arena.box(300, 300, rounded_mm=100))
    poses, out = poses_by_walls(sim.arena, sim.spec.body.radius_mm), np.zeros((PLACES, SENSOR_COUNT))
    scenes = [scene_of(sim, RobotSpec.load("khepera", response=each)) for each in RESPONSES]

    def reading_ns(scene: Scene) -> float:
        start_s = time.perf_counter()
        observe.read_from(scene.record, 0, 0, 0, poses, out)
        return (time.perf_counter() - start_s) / out.size * 1e9

    reading_ns(scenes[0])  # compiles
    rounds = [[reading_ns(scene) for scene in scenes] for _ in range(repeats)]
    reference_ns, *others_ns = zip(*rounds, strict=True)
    rows = [(f"sensors.response_{RESPONSES[0]}_ns", statistics.median(reference_ns), "ns a reading")]
    for response, times_ns in zip(RESPONSES[1:], others_ns, strict=True):
        ratio = statistics.median(own / first for own, first in zip(times_ns, reference_ns, strict=True))
        rows.append((f"sensors.response_{response}", ratio, f"of {RESPONSES[0]}'s time"))
    return rows


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
    rows += response_rows(options.repeats)
    report(rows, as_json=options.json)


if __name__ == "__main__":
    main()
