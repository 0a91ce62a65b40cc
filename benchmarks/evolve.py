"""How long tasks take to evolve from random, and whether their champions solve them.

Run: python benchmarks/evolve.py [--json] [--seeds 5] [--task NAME ...]. For each seed the task is evolved by CMA-ES for
the task's own number of generations, and its champion takes the exam (`kiks.Exam`): twenty starts in arenas where it
was not trained, with the timing of a line of 9600 baud.

* `evolve.NAME_solved`: the share of champions that pass; `evolve.NAME_s`: the median time of an evolution.
* `evolve.avoid_maze_solved`, `evolve.avoid_office_solved`: the same exam in two arenas of `examples`.
* `evolve.swarm_generations_per_min`: the pace at which a swarm evolves: `SWARM` robots that gather as many balls, in
  each of a hundred candidates' worlds; `evolve.generations_per_min`: that of the robots that avoid obstacles.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import kiks
from calibration import report
from kiks.batch.initial_state import random_starts
from kiks.model.arena import Ball

ARENAS = Path(__file__).parent.parent / "examples" / "arenas"
TASKS = ("avoid", "follow", "light", "gather", "maze")

SWARM, SWARM_MM, SWARM_POPULATION, SWARM_GENERATIONS = 20, 2000, 100, 3


def exams_of(task: kiks.Task) -> dict[str, kiks.Exam]:
    """Return the exams of a task by their names."""
    assert task.exam is not None
    exams = {task.name: task.exam}
    if task.name == "avoid":
        for name in ("maze", "office"):
            exams[f"avoid_{name}"] = replace(task.exam, arenas=(kiks.Arena.load(ARENAS / f"{name}.toml"),))
    return exams


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


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--seeds", type=int, default=5, help="how many evolutions of each task")
    arguments.add_argument("--task", nargs="+", choices=TASKS, default=TASKS, help="the tasks")
    arguments.add_argument("--where", default="threads", help="where candidates are evaluated")
    options = arguments.parse_args()

    rows: list[tuple[str, float, str]] = []
    for name in options.task:
        task, wholes_s, passed = kiks.tasks.load(name), [], Counter[str]()
        exams = exams_of(task)
        for seed in range(1, options.seeds + 1):
            start_s = time.perf_counter()
            champion = kiks.Evolution(task, seed=seed).run(generations=task.generations, executor=options.where)
            wholes_s.append(time.perf_counter() - start_s)
            for exam_name, exam in exams.items():
                result = exam.examine(champion)
                passed[exam_name] += result.is_passed
                rows.append(
                    (f"evolve.{exam_name}_starts_{seed}", result.solved.sum(), f"of {len(result.solved)} solved")
                )
        rows += [(f"evolve.{each}_solved", passed[each] / options.seeds, "of the champions") for each in exams]
        rows.append((f"evolve.{name}_s", statistics.median(wholes_s), f"s for {task.generations} generations"))
        if name == "avoid":
            pace = 60 * task.generations / statistics.median(wholes_s)
            rows.append(("evolve.generations_per_min", pace, "of one robot that avoids"))
    start_s = time.perf_counter()
    swarm = kiks.Evolution(swarm_task(), seed=1, population=SWARM_POPULATION)
    swarm.run(generations=SWARM_GENERATIONS, executor=options.where)
    pace = 60 * SWARM_GENERATIONS / (time.perf_counter() - start_s)
    rows.append(("evolve.swarm_generations_per_min", pace, f"of {SWARM} robots and {SWARM} balls"))
    report(rows, as_json=options.json)


if __name__ == "__main__":
    main()
