"""How many robots a batch steps in a second, beside Kheperax in the same run.

Run: python benchmarks/batch.py [--json] [--kheperax FOLDER] [--quick]. A robot-step is one control step of 50 ms: all
eight sensors (56 rays, the response, noise), the controller, and five ticks of 10 ms with motors, motion and contact.

* `batch.full_steps_per_s_core`: the thesis's networks; a Braitenberg vehicle that keeps off walls, 512 worlds of a box
  of 1 m x 1 m with 30 walls in it; `batch.reflection_...` with the default response, `batch.fast_...` with the table.
* `batch.full_steps_per_s_all`: the same on all cores, in wall time; `batch.second_core_adds`: what a second one adds.
* `batch.link_...`: with the default response and the loop of 0.1 s over a line of 9600 baud, which is ten ticks.
* `batch.bodies10_...`: with ten balls in each world; `batch.swarmN_...`: N robots in a square of 1, 3 or 7 m
  (benchmarks/crowd.py).
* `batch.worlds_N_...`, `batch.arena_Nm_...`, `batch.bodies_N_...`: how it goes with their number, default response.
* `batch.megabytes_10000`: how much memory 10,000 worlds add, and what a further minute of runs adds to that.
* `batch.kheperax8_steps_per_s`: Kheperax with 8 lasers in its standard maze (benchmarks/kheperax_peer.py), 100 and
  1000 robots, the faster of the two; `batch.maze_full_...`: ours with the networks and a network controller of the same
  size in the same maze, 1.83 m wide, so that its robot is as large as a Khepera; `batch.full_over_kheperax8`: ratio.

Figures of one core are robot-steps in a second of the processor's time, medians, and peers take turns: on a computer
that others use, too, that is what repeats. `batch.calibration` is a fixed piece of plain Python in the same run.
Kheperax lives in an environment of its own, which is made in the folder if it is not there; without --kheperax it is
left out.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from crowd import IDEAL, crowd, vehicle
from PIL import Image, ImageDraw

import kiks
from calibration import calibration_loops_per_s, report
from kiks.batch.initial_state import random_starts
from kiks.model.arena_objects import Ball
from kiks.model.walls import Zone

PINS = (
    *("kheperax==0.2.0", "jax==0.4.30", "jaxlib==0.4.30", "qdax==0.4.0", "flax==0.8.5", "brax==0.10.5"),
    *("mujoco==3.2.0", "mujoco-mjx==3.2.0", "jumanji==1.0.1", "numpy==1.26.4", "scipy==1.13.1", "requests"),
)
"""Kheperax with the versions under which it is fastest on a processor (and works at all)."""

MAZE_MM = 27.5 / 0.015
"""Edge of Kheperax's unit square, if its robot, of the radius 0.015, is a Khepera [mm]."""

MAZE = (
    *((0.25, 0.25, 0.25, 0.75), (0.14, 0.45, 0.0, 0.65), (0.25, 0.75, 0.0, 0.8), (0.25, 0.75, 0.66, 0.875)),
    *((0.355, 0.0, 0.525, 0.185), (0.25, 0.5, 0.75, 0.215), (1.0, 0.25, 0.435, 0.55), (0.0, 0.8, 0.0, 1.0)),
)
"""Its walls inside (Kheperax 0.2.0, `maze_maps`, "standard")."""


ZONES = tuple(Zone(disc_mm=(100 * k, 100 * k), radius_mm=60, brightness=20 * k) for k in range(11))
"""Zones of a floor that robots read."""

vehicle_on_floor = kiks.controller(senses=("proximity", "floor"))(vehicle.function)


def box(size_mm: int, body_count: int = 0) -> kiks.Arena:
    """Return a square with thirty walls a square metre, and balls."""
    rng = np.random.default_rng(0)
    walls = np.zeros((size_mm, size_mm), np.uint8)
    for _ in range(30 * (size_mm * size_mm) // 1_000_000):
        x, y = rng.integers(40, size_mm - 40, 2)
        width, height = rng.integers(20, 90), rng.integers(4, 12)
        width, height = (height, width) if rng.random() < 0.5 else (width, height)
        walls[y : y + height, x : x + width] = 255
    plain = kiks.Arena.from_array(walls, name="box")
    places = random_starts(plain, 40 * body_count + 1, seed=2, clear_mm=10.0)[:, :2]
    balls: list[Ball] = []
    for x_mm, y_mm in places.tolist():
        if len(balls) < body_count and all(np.hypot(x_mm - b.x_mm, y_mm - b.y_mm) > 100 for b in balls):
            balls.append(Ball(x_mm, y_mm))
    return kiks.Arena(plain.brightness, plain.mm_per_cell, "box", balls=tuple(balls))


def maze() -> kiks.Arena:
    """Return Kheperax's maze, its walls 4 mm thick."""
    size = round(MAZE_MM)
    picture = Image.new("L", (size, size))
    draw = ImageDraw.Draw(picture)
    for x0, y0, x1, y1 in MAZE:
        draw.line([x0 * size, (1 - y0) * size, x1 * size, (1 - y1) * size], fill=255, width=4)
    return kiks.Arena.from_array(np.asarray(picture), name="kheperax")


def rate(batch: kiks.Batch, seconds: float, controller: Any = vehicle, parameters: Any = ()) -> Callable[[], float]:
    """Return what measures robot-steps in a second of the processor's time."""
    batch.run(controller, parameters, seconds=1.0)

    def measure() -> float:
        start_s = time.process_time()
        steps = batch.run(controller, parameters, seconds=seconds).step_counts.sum() * batch.robot_count
        return float(steps / (time.process_time() - start_s))

    return measure


def wall_rate(batch: kiks.Batch, seconds: float) -> float:
    """Return robot-steps in a second of real time."""
    start_s = time.perf_counter()
    steps = batch.run(vehicle, seconds=seconds).step_counts.sum()
    return float(steps / (time.perf_counter() - start_s))


def in_turns(repeats: int, measures: dict[str, Callable[[], float]]) -> dict[str, float]:
    """Return the medians of measurements that take turns."""
    found: dict[str, list[float]] = {name: [] for name in measures}
    for _ in range(repeats):
        for name, measure in measures.items():
            found[name].append(measure())
    return {name: statistics.median(values) for name, values in found.items()}


def worlds(arena: kiks.Arena, count: int, *, response: str | None = None, **options: Any) -> kiks.Batch:
    """Return worlds of one thread whose robots start somewhere."""
    starts = random_starts(arena, count, seed=1)[:, None, :]
    return kiks.Batch(
        arena, count, response=response, **{"timing": IDEAL, "threads": 1, "seed": 1, "starts": starts} | options
    )


def megabytes() -> float:
    """Return the largest memory that this process has had [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def kheperax_python(folder: Path) -> Path:
    """Return the Python of Kheperax's own environment, which is made in the folder if it is not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *PINS], check=True)
    return python


def kheperax(folder: Path) -> Callable[[int], float]:
    """Return what measures Kheperax with so many robots, in an environment of its own, on one core."""
    python = kheperax_python(folder)
    script = Path(__file__).with_name("kheperax_peer.py")

    def measure(count: int) -> float:
        command = ["taskset", "-c", "0", str(python), str(script), str(count)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        return float(json.loads(done.stdout.splitlines()[-1])["steps_per_cpu_s"])

    return measure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="the rates of one core alone, in less time")
    parser.add_argument("--kheperax", type=Path, metavar="FOLDER", help="environment of Kheperax; made if not there")
    arguments = parser.parse_args()
    repeats, seconds = (5, 10.0) if arguments.quick else (11, 20.0)
    arena, count = box(1000), 512
    rows: list[tuple[str, float, str]] = []

    before_mb = megabytes()
    large = worlds(arena, 10_000)
    large.run(vehicle, seconds=2.0)
    large_mb = megabytes() - before_mb

    found = in_turns(
        repeats,
        {
            "full": rate(worlds(arena, count, response="thesis"), seconds),
            "reflection": rate(worlds(arena, count), seconds),
            "fast": rate(worlds(arena, count, response="fast"), seconds),
            "floor": rate(worlds(replace(arena, zones=ZONES), count), seconds, vehicle_on_floor),
            "link": rate(worlds(arena, count, timing=kiks.Timing(0.1, 9600)), 2 * seconds),
            "bodies10": rate(worlds(box(1000, 10), 64), seconds / 2),
            "swarm10": crowd("10_1m"),
            "swarm100": crowd("100_3m"),
            "swarm1000": crowd("1000_7m"),
        },
    )
    rows += [(f"batch.{name}_steps_per_s_core", value, "robot-steps/CPU s") for name, value in found.items()]
    full = found["full"]
    rows += [
        (f"batch.{name}_over_full", found[name] / full, "times") for name in ("fast", "bodies10", "swarm10", "swarm100")
    ]
    rows.append(("batch.floor_over_reflection", found["floor"] / found["reflection"], "times"))
    rows.append(("batch.swarm1000_costs", found["swarm100"] / found["swarm1000"], "times a robot among 100"))

    if arguments.kheperax is not None:
        measure = kheperax(arguments.kheperax)
        field, brain = maze(), kiks.controllers.mlp(hidden=(8,))
        start = (0.15 * MAZE_MM, 0.15 * MAZE_MM, np.pi / 2)
        given = kiks.controllers.random_parameters(brain, 1000, seed=7)
        ours = rate(worlds(field, 1000, response="thesis", starts=start), 12.5, brain, given)
        found = in_turns(
            3, {"maze_full": ours, "kheperax8_100": lambda: measure(100), "kheperax8_1000": lambda: measure(1000)}
        )
        peer = max(found["kheperax8_100"], found["kheperax8_1000"])
        rows.append(("batch.kheperax8_steps_per_s", peer, "robot-steps/CPU s"))
        rows.append(("batch.maze_full_steps_per_s_core", found["maze_full"], "robot-steps/CPU s"))
        rows.append(("batch.full_over_kheperax8", found["maze_full"] / peer, "times"))

    if not arguments.quick:
        single = worlds(arena, 2 * count, response="thesis")
        double = worlds(arena, 2 * count, response="thesis", threads=2)
        every = worlds(arena, 2 * count, response="thesis", threads=None)
        found = in_turns(
            repeats,
            {
                "one": lambda: wall_rate(single, seconds),
                "two": lambda: wall_rate(double, seconds),
                "all": lambda: wall_rate(every, seconds),
            },
        )
        rows.append(("batch.full_steps_per_s_all", found["all"], "robot-steps/s"))
        rows.append(("batch.second_core_adds", found["two"] / found["one"] - 1.0, "cores"))
        growth = {f"worlds_{n}": rate(worlds(arena, n), max(64 * seconds / n, 2.0)) for n in (64, 1000, 10_000)}
        growth |= {f"arena_{n}m": rate(worlds(box(1000 * n), 64), seconds) for n in (1, 2, 4)}
        growth |= {f"bodies_{n}": rate(worlds(box(1000, n), 64), seconds / 4) for n in (1, 10, 30)}
        for name, value in in_turns(3, growth).items():
            rows.append((f"batch.{name}_steps_per_s_core", value, "robot-steps/CPU s"))
        rows.append(("batch.megabytes_10000", large_mb, "MB"))
        until_s, reached_mb = time.perf_counter() + 60, megabytes()
        while time.perf_counter() < until_s:
            large.run(vehicle, seconds=1.0)
        rows.append(("batch.megabytes_more", megabytes() - reached_mb, "MB"))
    calibration = calibration_loops_per_s()
    rows.append(("batch.calibration", calibration, "loops/s"))
    rows.append(("batch.full_over_calibration", full / calibration, "robot-steps/loop"))
    report(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
