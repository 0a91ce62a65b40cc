"""How long obstacle avoidance takes to evolve from random, and whether its champions touch nothing on the wire.

Run: python benchmarks/evolve.py [--json] [--seeds 5]. For each seed `kiks.tasks.avoid()` is evolved by CMA-ES for
`GENERATIONS` generations. `evolve.threshold_s` is the median of the times after which the champion's fitness on trial
is above `THRESHOLD`, with everything that comes before it but imports; `evolve.whole_s` that of a whole evolution.
`evolve.contact_free` is the share of champions that drive `EXAM_S` simulated seconds on a line of 9600 baud in each
of the arenas of `exams`, where none of them trained, without one contact; `evolve.squares_...` is how far each got.
`evolve.swarm_generations_per_min` is the pace at which a swarm evolves: `SWARM` robots that gather as many balls, in
each of a hundred candidates' worlds; `evolve.generations_per_min` is that of the robots that avoid obstacles.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from dataclasses import replace
from pathlib import Path

import kiks
from calibration import report
from kiks.batch.initial_state import random_starts
from kiks.model.arena import Ball, Pose

ARENAS = Path(__file__).parent.parent / "examples" / "arenas"
GENERATIONS, THRESHOLD, EXAM_S = 60, 0.15, 180.0
SQUARE_MM = 100.0
SWARM, SWARM_MM, SWARM_POPULATION, SWARM_GENERATIONS = 20, 2000, 100, 3


def exams() -> list[kiks.Arena]:
    """Return arenas to be examined in, each with a start of its own."""
    task = kiks.tasks.avoid()
    assert task.exam is not None
    arenas = [task.exam, kiks.Arena.load(ARENAS / "maze.toml"), kiks.Arena.load(ARENAS / "office.toml")]
    starts = [random_starts(arena, 1, seed=1, clear_mm=20)[0].tolist() for arena in arenas]
    return [replace(arena, starts=(Pose(*start),)) for arena, start in zip(arenas, starts, strict=True)]


def drive(champion: kiks.Champion, arena: kiks.Arena, seed: int) -> tuple[int, float, int]:
    """Return how often a champion meets something on the wire, how far it drives [m], and to how many squares."""
    sim, ports = champion.simulation(arena, seed=seed)
    sim.record_paths()
    champion.drive(ports, seconds=EXAM_S)
    squares = {(int(x_mm // SQUARE_MM), int(y_mm // SQUARE_MM)) for x_mm, y_mm in sim.paths()[0, :, 1:3]}
    return sim.contacts(1), sim.travelled_mm(1) / 1000, len(squares)


def swarm_task() -> kiks.Task:
    """Return the task of many robots to gather as many balls in a large room."""
    room = kiks.Arena.box(SWARM_MM, SWARM_MM)
    places = random_starts(room, SWARM, seed=1, clear_mm=50)[:, :2].tolist()
    balls = tuple(Ball(x_mm, y_mm) for x_mm, y_mm in places)
    middle_mm = SWARM_MM / 2
    counted = (kiks.measures.gathered(middle_mm, middle_mm, radius_mm=300), kiks.measures.spread_mm)
    return kiks.tasks.gather(
        arenas=(replace(room, balls=balls),),
        robots=SWARM,
        worlds=1,
        starts="arena",
        measures=(*counted, kiks.measures.contacts, kiks.measures.path_mm),
        exam=None,
    )


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--seeds", type=int, default=5, help="how many evolutions")
    arguments.add_argument("--where", default="threads", help="where candidates are evaluated")
    options = arguments.parse_args()

    arenas = exams()
    rows: list[tuple[str, float, str]] = []
    thresholds_s, wholes_s, passed, lengths_m = [], [], 0, []
    for seed in range(1, options.seeds + 1):
        start_s = time.perf_counter()
        evolution = kiks.Evolution(kiks.tasks.avoid(), seed=seed)
        champion = evolution.run(generations=GENERATIONS, executor=options.where)
        wholes_s.append(time.perf_counter() - start_s)
        above = [each.seconds for each in evolution.generations if each.champion_fitness > THRESHOLD]
        thresholds_s.append(above[0] if above else math.inf)
        driven = [drive(champion, arena, seed) for arena in arenas]
        passed += not any(contacts for contacts, _, _ in driven)
        lengths_m += [metres for _, metres, _ in driven]
        for arena, (contacts, _, squares) in zip(arenas, driven, strict=True):
            rows.append((f"evolve.contacts_{arena.name.lower()}_{seed}", contacts, f"in {EXAM_S:g} s"))
            rows.append((f"evolve.squares_{arena.name.lower()}_{seed}", squares, f"of {SQUARE_MM:g} mm seen"))
        rows.append((f"evolve.fitness_{seed}", champion.fitness, "on trial"))
        rows.append((f"evolve.threshold_s_{seed}", thresholds_s[-1], f"s to fitness {THRESHOLD:g}"))
    rows.append(("evolve.threshold_s", statistics.median(thresholds_s), f"s to fitness {THRESHOLD:g}"))
    rows.append(("evolve.whole_s", statistics.median(wholes_s), f"s for {GENERATIONS} generations"))
    rows.append(("evolve.speed_mm_s", 1000 * statistics.mean(lengths_m) / EXAM_S, "mm/s in the exams"))
    rows.append(("evolve.contact_free", passed / options.seeds, "of the champions"))
    rows.append(
        ("evolve.generations_per_min", 60 * GENERATIONS / statistics.median(wholes_s), "of one robot that avoids")
    )
    start_s = time.perf_counter()
    swarm = kiks.Evolution(swarm_task(), seed=1, population=SWARM_POPULATION)
    swarm.run(generations=SWARM_GENERATIONS, executor=options.where)
    pace = 60 * SWARM_GENERATIONS / (time.perf_counter() - start_s)
    rows.append(("evolve.swarm_generations_per_min", pace, f"of {SWARM} robots and {SWARM} balls"))
    report(rows, as_json=options.json)


if __name__ == "__main__":
    main()
