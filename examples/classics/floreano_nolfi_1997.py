"""Floreano and Nolfi (1997): predator and prey evolve against each other. The figure: fitness, and the tournament."""

from pathlib import Path

import numpy as np
from findings import AMOUNT, SHARE, Finding, command, draw_generations, evolved

import kiks
from kiks.export.figures import column_figure
from kiks.learn.plots import SIDE_COLOURS, draw_squares, legend_below
from kiks.learn.statistics import mean_interval
from kiks.model.ranges import seeds_in

FIFTH = 5


def main(
    seeds: str = "1-3",
    out: Path = Path("floreano_nolfi_1997.pdf"),
    generations: int = 100,
    population: int = 100,
) -> list[Finding]:
    """Co-evolve for several seeds, draw fitness, tournament and its means, and compare with the papers."""
    task = kiks.tasks.floreano_nolfi_1997()
    evolutions = evolved(task, seeds_in(seeds), generations=generations, population=population)
    return gather_findings(evolutions, out)


def gather_findings(evolutions: list[kiks.Evolution], out: Path) -> list[Finding]:
    """Draw the figure of finished co-evolutions, and return what came out."""
    tournaments = [each.tournament or each.master_tournament() for each in evolutions]
    names = tournaments[0].sides
    with column_figure(out, 215, nrows=3, height_ratios=[1, 1.25, 1]) as (above, middle, below):
        for side, (name, colour) in enumerate(zip(names, SIDE_COLOURS, strict=True)):
            draw_generations(above, evolutions, side, colour=colour, name=name)
            mean, low, high = mean_interval([each.means[side] for each in tournaments], within=SHARE)
            numbers = tournaments[0].generations
            below.fill_between(numbers, low, high, color=colour, alpha=0.2, linewidth=0)
            below.plot(numbers, mean, color=colour, label=name)
        above.set(ylim=(0, 1), title="against opponents of the last ten generations")
        draw_squares(middle, tournaments[0])
        below.set(xlabel="generation of the champion", ylabel="mean fitness", ylim=(0, 1))
        below.set_title("each champion against all of the other side")
        for axes in (above, below):
            legend_below(axes)

    averages = [
        [[generation.fitness_of(side).mean() for generation in evolution.generations] for side in (0, 1)]
        for evolution in evolutions
    ]
    ahead = [float(np.mean(np.array(prey) > np.array(predator))) for predator, prey in averages]
    mirrored = [float(np.corrcoef(predator, prey)[0, 1]) for predator, prey in averages]
    part = max(1, len(averages[0][0]) // FIFTH)
    gained = [
        [float(each.means[side][-part:].mean() - each.means[side][:part].mean()) for each in tournaments]
        for side in (0, 1)
    ]
    gain = "later generations are not generally better (1998, secondary)"
    return [
        Finding("synapses of predator and prey", "usually quoted as 30 and 20", _counts(evolutions[0])),
        Finding(
            "share of generations in which the prey is ahead, on average", "usually quoted as most", ahead, within=SHARE
        ),
        Finding(
            "correlation of both average curves",
            "usually quoted as mirror images",
            np.nan_to_num(mirrored),
            within=(-1.0, 1.0),
        ),
        Finding(
            "fitness of the last predators, mean", "not recovered", [each[0][-1] for each in averages], within=SHARE
        ),
        Finding("fitness of the last preys, mean", "not recovered", [each[1][-1] for each in averages], within=SHARE),
        Finding("tournament: last fifth of predators less the first", gain, gained[0]),
        Finding("tournament: last fifth of preys less the first", gain, gained[1]),
        Finding("generation of the best predator", "", [float(each.best[0]) for each in tournaments], 0, AMOUNT),
        Finding("generation of the best prey", "", [float(each.best[1]) for each in tournaments], 0, AMOUNT),
    ]


def _counts(evolution: kiks.Evolution) -> str:
    return " and ".join(str(side.parameter_count) for side in evolution.task.sides)


if __name__ == "__main__":
    command(main)
