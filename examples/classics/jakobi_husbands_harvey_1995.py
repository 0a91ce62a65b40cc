"""Jakobi, Husbands and Harvey (1995): how much noise a simulator needs; another simulated robot plays reality."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from findings import AMOUNT, Finding, command, evolved, path_of

import kiks
from kiks.export.figures import column_figure, draw_paths
from kiks.learn.statistics import mean_interval
from kiks.model.arena import Pose
from kiks.model.family import family
from kiks.model.ranges import seeds_in

NOISES = {0.0: "none", 1.0: "observed", 2.0: "double"}
BEHAVIOUR = {0.0: "4.0", 1.0: "6.0", 2.0: "4.8"}  # the authors' own ratings, 0 to 10
MATCH = {0.0: "6.2", 1.0: "8.0", 2.0: "6.8"}
TESTS, TEST_SEED = 20, 10**6
START = Pose(260, 260, 0.6)


def main(
    seeds: str = "1-10",
    out: Path = Path("jakobi_husbands_harvey_1995.pdf"),
    generations: int = 16,
    population: int = 64,
) -> list[Finding]:
    """Evolve with three levels of noise, let the champions drive a robot that differs, and compare."""
    numbers = seeds_in(seeds)
    thesis = kiks.RobotSpec.load("khepera", response="thesis")
    real = [family(thesis, 1, seed=seed)[0] for seed in numbers]  # of each seed another robot
    tests = TEST_SEED + np.arange(TESTS)
    make = kiks.tasks.jakobi_husbands_harvey_1995
    fitness, apart_mm, drawn = {}, {}, {}
    for noise in NOISES:
        task = make(noise=noise)
        champions = [each.champion for each in evolved(task, numbers, generations=generations, population=population)]
        pairs, distances, paths = [], [], []
        for champion, spec in zip(champions, real):
            same = np.tile(champion.parameters, (TESTS, 1))
            pairs.append([each.evaluate(same, tests)[:, 0].mean() for each in (task, make(robot=spec))])
            arena = replace(task.arenas[0], starts=(START,))
            both = [path_of(replace(champion, robot=robot), 20.0, arena=arena, seed=1) for robot in (task.robot, spec)]
            points = min(map(len, both))
            distances.append(np.hypot(*(both[0][:points, :2] - both[1][:points, :2]).T).mean())
            paths.append(both)
        fitness[noise], apart_mm[noise] = np.array(pairs), np.array(distances)
        drawn[noise] = paths[int(np.argsort(distances)[len(distances) // 2])]  # the median

    with column_figure(out, 88, nrows=2, ncols=2) as panels:
        chart, *maps = panels.flat
        for column, name in enumerate(("simulation", "reality")):
            mean, low, high = mean_interval(np.array([fitness[noise][:, column] for noise in NOISES]), axis=1)
            at = np.arange(len(NOISES)) + 0.16 * (2 * column - 1)
            chart.errorbar(
                at, mean, [mean - low, high - mean], fmt="os"[column], color=f"C{column}", markersize=3, label=name
            )
        chart.set(xticks=range(3), xticklabels=list(NOISES.values()), xlabel="noise", ylabel="fitness", ylim=(0, None))
        chart.legend(loc="lower left")
        for axes, noise in zip(maps, NOISES):
            draw_paths(axes, make().arenas[0], drawn[noise], ["C0", "C1"])
            axes.set_title(f"noise: {NOISES[noise]}")

    findings = []
    for noise, name in NOISES.items():
        findings += [
            Finding(f"fitness in simulation, noise {name}", "", fitness[noise][:, 0]),
            Finding(
                "  fitness in reality", f"behaviour rated {BEHAVIOUR[noise]} of 10 (secondary)", fitness[noise][:, 1]
            ),
            Finding("  paths apart [mm]", f"match rated {MATCH[noise]} of 10 (secondary)", apart_mm[noise], 0, AMOUNT),
        ]
    return findings


if __name__ == "__main__":
    command(main)
