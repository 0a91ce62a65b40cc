"""Floreano and Mondada (1994): a robot learns to navigate in a looping corridor. The figure: fitness, and its way."""

from pathlib import Path

import numpy as np
from findings import AMOUNT, Finding, command, draw_generations, evolved, path_of

import kiks
from kiks.export.figures import column_figure, draw_paths
from kiks.model.ranges import seeds_in

DRIVE_S = 120.0
SHUTTLING = 0.1  # of `roaming`: a robot that gets away more slowly than 8 mm/s stays where it is


def main(
    seeds: str = "1-10",
    out: Path = Path("floreano_mondada_1994.pdf"),
    generations: int = 100,
    population: int = 80,
) -> list[Finding]:
    """Evolve navigators for several seeds, draw fitness and the best one's way, and compare with the paper."""
    task = kiks.tasks.floreano_mondada_1994()
    setting = {"seeds": seeds_in(seeds), "generations": generations, "population": population}
    evolutions = evolved(task, **setting)
    as_printed = evolved(kiks.tasks.floreano_mondada_1994(shuttling=True), **setting)
    champions = [each.champion for each in evolutions]
    paths = [path_of(each, DRIVE_S) for each in champions]
    speeds = [np.hypot(*np.diff(path[:, :2], axis=0).T) / 0.1 for path in paths]
    ahead = [each.measures["speed_pulses"] > 0 for each in champions]
    stayed = sum(each.champion.measures["roaming"] < SHUTTLING for each in as_printed)

    best = int(np.argmax([each.fitness for each in champions]))
    with column_figure(out, 105, nrows=2, height_ratios=[1, 1.15]) as (above, below):
        draw_generations(above, evolutions)
        above.set(ylim=(0, None))
        above.legend(loc="upper left")
        draw_paths(below, task.arenas[0], [paths[best]])
        below.set_title(f"the best robot's way in {DRIVE_S:.0f} s")

    last = [each.generations[-1].fitness for each in evolutions]
    return [
        Finding("parameters", "22 (secondary)", str(task.parameter_count)),
        Finding("fitness of the last generation, best", "not recovered", [each.max() for each in last], 3),
        Finding(
            "fitness of the last generation, mean",
            "stays clearly lower (usually quoted)",
            [each.mean() for each in last],
            3,
        ),
        Finding(
            "the side with six sensors leads",
            "yes, though fitness is symmetric (S1)",
            f"{sum(ahead)} of {len(ahead)} seeds",
        ),
        Finding("cruising speed [mm/s]", "usually quoted as about 48", [np.median(each) for each in speeds], 1),
        Finding(
            "contacts of the champion in 24 s", "", [each.measures["contacts"] for each in champions], within=AMOUNT
        ),
        Finding("with V as printed: stay where they are", "", f"{stayed} of {len(as_printed)} seeds"),
    ]


if __name__ == "__main__":
    command(main)
