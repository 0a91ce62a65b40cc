"""How long tasks take to evolve from random, and whether their champions solve them.

Run: python benchmarks/evolve.py [--json] [--seeds 101-120] [--task NAME ...] [--kheperax FOLDER]. For each seed the
task is evolved with its own algorithm, population and number of generations, and its champion takes the exam
(`kiks.Exam`): twenty starts, with the timing of its serial line, in arenas where it was not trained, but for the
maze. The seeds are a range, a list such as 3,7 or 1-5,9, or a number such as 5 for those from 1 to 5. What is known is
printed at once.

Settings of tasks are chosen on seeds 1 to 20. So results are to be reported on others.

* `evolve.NAME_starts_SEED`: the starts that the champion of a seed solves, and the time of its evolution.
* `evolve.NAME_solved`: the share of champions that pass, with Wilson's interval of 95 %; `evolve.NAME_s`: the median
  time of an evolution, and `evolve.NAME_cpu_s` that of the processor.
* `evolve.maze_coverage`, `evolve.maze_qd_score`: of the archive of `maze`, medians; `evolve.maze_kheperax_coverage`:
  that of MAP-Elites in Kheperax itself, in the same maze with as many cells, candidates and evaluations
  (benchmarks/kheperax_elites.py). Its environment is made in the folder if it is not there; without --kheperax it is
  left out.
* `evolve.NAME_PLACE_solved`: of `avoid` and `follow`, the same exam in small and in large random rooms, and in two
  arenas of `examples`, `maze` and `office`.
* `evolve.pursuit_s`: the median time of a co-evolution of predator and prey without its master tournament, which gives
  `evolve.pursuit_SIDE_N`, the mean fitness of the champions of each fifth of the generations against all champions of
  the other side.
* `evolve.swarm_generations_per_min`: the pace at which a swarm evolves: `SWARM` robots that gather as many balls, in
  each of a hundred candidates' worlds; `evolve.generations_per_min`: that of the robots that avoid obstacles.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import chain
from pathlib import Path

import numpy as np

import kiks
from batch import kheperax_python
from calibration import report
from kiks.batch.initial_state import random_starts
from kiks.errors import KiksError
from kiks.learn.statistics import wilson_interval
from kiks.model.arena import Ball
from kiks.model.ranges import seeds_in

ARENAS = Path(__file__).parent.parent / "examples" / "arenas"
TASKS = ("avoid", "follow", "light", "gather", "maze")
CONTEST, PERIODS = "pursuit", 5
SWARMS = "swarm"
ALL = (*TASKS, CONTEST, SWARMS)

Row = tuple[str, float, str]
"""Name, value and unit of a figure."""

SWARM, SWARM_MM, SWARM_POPULATION, SWARM_GENERATIONS = 20, 2000, 100, 3


def exams_of(task: kiks.Task) -> dict[str, kiks.Exam]:
    """Return the exams of a task by their names."""
    assert task.exam is not None
    exams = {task.name: task.exam}
    if task.name in ("avoid", "follow"):
        places = {name: (kiks.Arena.load(ARENAS / f"{name}.toml"),) for name in ("maze", "office")}
        for place, arenas in (places | random_rooms()).items():
            exams[f"{task.name}_{place}"] = replace(task.exam, arenas=arenas)
    return exams


@cache
def random_rooms() -> dict[str, tuple[kiks.Arena, ...]]:
    """Return rooms in which no task trains and that no exam has."""
    small, large = {"width_mm": 900, "height_mm": 700, "walls": 2}, {"width_mm": 2000, "height_mm": 1500, "walls": 10}
    return {
        "small_rooms": tuple(kiks.Arena.room(**small, pillars=2, lamps=0, seed=seed) for seed in range(1001, 1005)),
        "large_rooms": tuple(kiks.Arena.room(**large, pillars=6, lamps=0, seed=seed) for seed in (1001, 1002)),
    }


def kheperax_coverage(folder: Path, task: kiks.Task, seed: int) -> float:
    """Return the coverage of MAP-Elites in Kheperax, with the cells and the number of evaluations of a task."""
    script = Path(__file__).with_name("kheperax_elites.py")
    numbers = (seed, task.population, task.population * task.generations, task.axes[0].cells)
    command = [str(kheperax_python(folder)), str(script), *map(str, numbers)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return float(json.loads(done.stdout.splitlines()[-1])["coverage"])


def swarm_task() -> kiks.Task:
    """Return the task of many robots to gather as many balls in a large room."""
    room = kiks.Arena.box(SWARM_MM, SWARM_MM)
    places = random_starts(room, SWARM, seed=1, clear_mm=50)[:, :2].tolist()
    balls = tuple(Ball(x_mm, y_mm) for x_mm, y_mm in places)
    return kiks.tasks.gather(
        arenas=(replace(room, balls=balls),),
        robots=SWARM,
        worlds=1,
        starts="arena",
        exam=None,
    )


def seeds_of(text: str) -> list[int]:
    """Return the seeds of a number, a list or a range."""
    if text.isdigit():
        return list(range(1, int(text) + 1))
    try:
        return seeds_in(text)
    except KiksError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def coevolutions(seeds: list[int]) -> Iterator[Row]:
    """Yield how long predator and prey take to evolve against each other, and who progressed."""
    contest, wholes_s = kiks.tasks.pursuit(), []
    for seed in seeds:
        start_s = time.perf_counter()
        coevolution = kiks.Evolution(contest, seed=seed)
        coevolution.run(generations=contest.generations)
        wholes_s.append(time.perf_counter() - start_s)
        tournament = coevolution.master_tournament()
        for side, means in zip(tournament.sides, tournament.means, strict=True):
            for number, period in enumerate(np.array_split(means, PERIODS), 1):
                yield f"evolve.pursuit_{side}_{number}", period.mean(), f"against all champions, seed {seed}"
    yield "evolve.pursuit_s", statistics.median(wholes_s), f"s for {contest.generations} generations"


def evolutions(name: str, seeds: list[int], kheperax: Path | None) -> Iterator[Row]:
    """Yield how long a task takes to evolve, and how its champions do in its exams."""
    task, wholes_s, cpus_s, passed = kiks.tasks.load(name), [], [], Counter[str]()
    coverages: dict[str, list[float]] = {"coverage": [], "qd_score": [], "kheperax_coverage": []}
    exams = exams_of(task)
    for seed in seeds:
        start_s, start_cpu_s = time.perf_counter(), time.process_time()
        evolution = kiks.Evolution(task, seed=seed)
        champion = evolution.run(generations=task.generations)
        wholes_s.append(time.perf_counter() - start_s)
        cpus_s.append(time.process_time() - start_cpu_s)
        if name == "maze" and evolution.archive is not None:
            coverages["coverage"].append(evolution.archive.coverage)
            coverages["qd_score"].append(evolution.archive.qd_score)
            if kheperax is not None:
                coverages["kheperax_coverage"].append(kheperax_coverage(kheperax, task, seed))
        for exam_name, exam in exams.items():
            result = exam.examine(champion)
            passed[exam_name] += result.is_passed
            unit = f"of {len(result.solved)} solved, after {cpus_s[-1]:.1f} s of the processor"
            yield f"evolve.{exam_name}_starts_{seed}", result.solved.sum(), unit
    for each in exams:
        low, high = wilson_interval(passed[each], len(seeds))
        unit = f"of {len(seeds)} champions; 95 %: {low:.2f} to {high:.2f}"
        yield f"evolve.{each}_solved", passed[each] / len(seeds), unit
    yield f"evolve.{name}_s", statistics.median(wholes_s), f"s for {task.generations} generations"
    yield f"evolve.{name}_cpu_s", statistics.median(cpus_s), "s of the processor"
    cells = f"of {task.generations * task.population} evaluations"
    for measure, found in coverages.items():
        if found:
            yield f"evolve.{name}_{measure}", statistics.median(found), cells
    if name == "avoid":
        pace = 60 * task.generations / statistics.median(wholes_s)
        yield "evolve.generations_per_min", pace, "of one robot that avoids"


def swarms() -> Iterator[Row]:
    """Yield the pace at which a swarm evolves."""
    start_s = time.perf_counter()
    swarm = kiks.Evolution(swarm_task(), seed=1, population=SWARM_POPULATION)
    swarm.run(generations=SWARM_GENERATIONS)
    pace = 60 * SWARM_GENERATIONS / (time.perf_counter() - start_s)
    yield "evolve.swarm_generations_per_min", pace, f"of {SWARM} robots and {SWARM} balls"


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--seeds", type=seeds_of, default="5", help="seeds of the evolutions: 101-120, 3,7 or 5")
    arguments.add_argument("--task", nargs="+", choices=ALL, default=ALL, help="what to evolve")
    arguments.add_argument("--kheperax", type=Path, metavar="FOLDER", help="environment of Kheperax, for maze")
    options = arguments.parse_args()

    measured = [evolutions(name, options.seeds, options.kheperax) for name in TASKS if name in options.task]
    if CONTEST in options.task:
        measured.append(coevolutions(options.seeds))
    if SWARMS in options.task:
        measured.append(swarms())
    for row in chain.from_iterable(measured):
        report([row], as_json=options.json)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
