"""Miglino, Lund and Nolfi (1995): sensors from tables of samples, with three kinds of noise; then the whole sensors."""

import copy
from pathlib import Path

import numpy as np
from findings import Finding, command, evolved

import kiks
from kiks.export.figures import column_figure
from kiks.learn.statistics import mean_interval
from kiks.model.ranges import seeds_in

NOISES = ("none", "uniform", "conservative")
TESTS = 10**6 + np.arange(20)  # seeds of the starts of a test


def tested(task, evolutions):
    """Return the fitness of each champion over 20 other starts."""
    return [
        task.evaluate(np.tile(each.champion.parameters, (len(TESTS), 1)), TESTS)[:, 0].mean() for each in evolutions
    ]


def means(evolutions):
    """Return the mean fitness of each generation: its mean over seeds, and the ends of its interval."""
    return mean_interval([[each.fitness.mean() for each in evolution.generations] for evolution in evolutions])


def main(
    seeds: str = "1-10",
    out: Path = Path("miglino_lund_nolfi_1995.pdf"),
    generations: int = 100,
    more: int = 20,
    population: int = 100,
) -> list[Finding]:
    """Evolve with sampled sensors, go on with the populations and whole sensors, and say what the change costs."""
    numbers = seeds_in(seeds)
    whole = kiks.tasks.miglino_lund_nolfi_1995()
    findings, chart = [], {}
    for noise in NOISES:
        task = kiks.tasks.miglino_lund_nolfi_1995(sampled=noise)
        first = evolved(task, numbers, generations=generations, population=population)
        # The state of an algorithm holds its population: handed over, it goes on under the changed physics.
        states = {number: each.algorithms[0] for number, each in zip(numbers, first)}
        then = evolved(whole, numbers, generations=more, algorithm=lambda seed: copy.deepcopy(states[seed]))
        chart[noise] = means(first), means(then)
        before, moved, after = tested(task, first), tested(whole, first), tested(whole, then)
        findings += [
            Finding(f"{noise} noise: champion with sampled sensors", "", before, 3),
            Finding("  the same with whole sensors", "usually quoted: drops, least if conservative", moved, 3),
            Finding(f"  champion of {more} more generations", "usually quoted: repairs it", after, 3),
        ]

    with column_figure(out, 62) as axes:
        for colour, (noise, (first, then)) in zip(("C0", "C1", "C2"), chart.items()):
            for begin, (mean, low, high) in ((1, first), (generations + 1, then)):
                at = np.arange(begin, begin + len(mean))
                axes.fill_between(at, low, high, color=colour, alpha=0.15, linewidth=0)
                axes.plot(at, mean, color=colour, linewidth=0.8, label=f"{noise} noise" if begin == 1 else None)
        axes.axvline(generations + 0.5, color="0.5", linewidth=0.6, linestyle=":")
        axes.text(generations + 1.5, 0.0, "whole\nsensors", fontsize=6.5, va="bottom")
        axes.set(xlabel="generation", ylabel="mean fitness", xlim=(1, generations + more), ylim=(0, None))
        axes.legend(loc="lower center")
    return findings


if __name__ == "__main__":
    command(main)
