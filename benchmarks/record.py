"""What a recording costs, and how fast any second of a long one is reached.

Run: python benchmarks/record.py [--json]. `record.slowdown_percent` compares the demo `follow` at full acceleration
with and without a recording, in turn in one process; each figure is a median. `record.seek_s` is the longest of twenty
jumps in a recording of an hour, `record.seek_100_s` in one of 100 robots in a square of 3 m, of which ten are asked in
turn; the first jump makes the tables of its walls.
`record.film_pictures_per_s` is the pictures of 1280 x 720 of an MP4 per second of processor time: those that one core
makes, with drawing and encoding.
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from pathlib import Path
from statistics import median

from behaviours import Follow

import kiks
from calibration import calibration_loops_per_s, report
from kiks.export.film import save_film

ARENA = Path(__file__).parent.parent / "examples" / "arenas" / "office.toml"
SECONDS, ROUNDS, HOUR_S, JUMPS = 300.0, 15, 3600.0, 20
CROWD, CROWD_S = 100, 600.0
FILM_S, FILMS = 40.0, 3


def run(seconds: float, file: Path | None) -> tuple[kiks.Simulation, float]:
    """Return the simulation of the demo after some time, and the processor time that it took [s]."""
    sim = kiks.Simulation(kiks.Arena.load(ARENA), seed=1)
    robot, follow = kiks.Khepera(sim.port(1)), Follow()
    recorder = None if file is None else sim.record(file)
    start_s = time.process_time()
    while sim.time_s < seconds:
        follow.step(robot)
    took_s = time.process_time() - start_s
    if recorder is not None:
        recorder.close()
    return sim, took_s


def record_crowd(file: Path) -> None:
    """Record many robots."""
    sim = kiks.Simulation(kiks.Arena.box(3000, 3000), robots=CROWD, seed=1)
    robots = [kiks.Khepera(sim.port(number)) for number in range(1, CROWD + 1)]
    with sim.record(file):
        for number, robot in enumerate(robots):
            robot.set_speed(3 + number % 5, 3 + number % 3)
        while sim.time_s < CROWD_S:
            for robot in robots[:10]:
                robot.proximity()


def seek_s(file: Path) -> float:
    """Return how long the longest of some jumps into a recording takes [s]."""
    recording, rng, jumps_s = kiks.Recording(file), random.Random(1), []
    for _ in range(JUMPS):
        start_s = time.perf_counter()
        recording.world_at(rng.uniform(0.0, recording.duration_s))
        jumps_s.append(time.perf_counter() - start_s)
    return max(jumps_s)


def film_pictures_per_s(recording: kiks.Recording) -> float:
    """Return how many pictures of a film one core makes in a second."""
    start_s = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        count = save_film(recording, Path(folder, "film.mp4"), end_s=FILM_S)
    return count / (time.process_time() - start_s)


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "run.mcap")
        run(10.0, file)
        slower, alone_s = [], []
        for _ in range(ROUNDS):
            (alone, without_s), (recorded, with_s) = run(SECONDS, None), run(SECONDS, file)
            assert alone.state_hash() == recorded.state_hash()
            slower.append(100 * (with_s / without_s - 1))
            alone_s.append(without_s)
        bytes_per_s = file.stat().st_size / recorded.time_s
        run(HOUR_S, file)
        hour_seek_s = seek_s(file)
        films = [film_pictures_per_s(kiks.Recording(file)) for _ in range(FILMS)]
        record_crowd(file)
        crowd_seek_s = seek_s(file)
    figures = [
        ("record.slowdown_percent", median(slower), "%"),
        ("record.us_without", 1e6 * median(alone_s) / SECONDS, "us a simulated second, without a recording"),
        ("record.kb_per_simulated_s", bytes_per_s / 1000, "kB"),
        ("record.seek_s", hour_seek_s, "s"),
        ("record.seek_100_s", crowd_seek_s, "s"),
        ("record.film_pictures_per_s", median(films), "1/s"),
        ("calibration.loops_per_s", calibration_loops_per_s(), "1/s"),
    ]
    report(figures, as_json=options.json)


if __name__ == "__main__":
    main()
