"""Nolfi (1997): five architectures learn to carry cylinders out of an arena. The figure: fitness, and a robot's way."""

from pathlib import Path

import numpy as np
from findings import Finding, command, evolved, path_of

import kiks
from kiks.export.figures import column_figure, draw_paths
from kiks.learn.statistics import compare, mean_interval
from kiks.model.ranges import seeds_in

ARCHITECTURES = {
    "feed_forward": "A feed-forward",
    "hidden": "B hidden layer",
    "elman": "C Elman",
    "designed": "D designed modules",
    "emergent": "E emergent modules",
}
DRIVE_S = 60.0


def main(
    seeds: str = "1-10",
    out: Path = Path("nolfi_1997.pdf"),
    generations: int = 60,
    population: int = 32,
) -> list[Finding]:
    """Evolve collectors of each architecture for several seeds, draw their fitness and the best one's way."""
    tasks = {each: kiks.tasks.nolfi_1997(architecture=each) for each in ARCHITECTURES}
    setting = {"seeds": seeds_in(seeds), "generations": generations, "population": population}
    evolutions = {each: evolved(task, **setting) for each, task in tasks.items()}
    exams = {
        each: [tasks[each].exam.examine(evolution.champion) for evolution in those]
        for each, those in evolutions.items()
    }
    outside = {each: [float(exam.values[:, 0].mean()) for exam in those] for each, those in exams.items()}

    architecture, place = max(
        ((each, k) for each in outside for k in range(len(outside[each]))),
        key=lambda found: outside[found[0]][found[1]],
    )
    champion, arena = evolutions[architecture][place].champion, tasks[architecture].exam.arenas[0]
    highest = 0.5
    with column_figure(out, 120, nrows=2, height_ratios=[1.5, 1]) as (above, below):
        for number, (each, name) in enumerate(ARCHITECTURES.items()):
            best = [[generation.fitness.max() for generation in one.generations] for one in evolutions[each]]
            mean, low, high = mean_interval(best)
            numbers, highest = np.arange(1, len(mean) + 1), max(highest, float(mean.max()))
            above.fill_between(numbers, low, high, color=f"C{number}", alpha=0.1, linewidth=0)
            above.plot(numbers, mean, color=f"C{number}", label=name)
        above.set(xlabel="generation", ylabel="best fitness", xlim=(1, max(2, len(mean))), ylim=(0, 1.5 * highest))
        above.figure.legend(*above.get_legend_handles_labels(), loc="outside upper center", ncols=2)
        draw_paths(below, arena, [path_of(champion, DRIVE_S, arena=arena)])
        below.set_title(f"the best robot's way in {DRIVE_S:.0f} s ({ARCHITECTURES[architecture]})")

    comparison = compare(outside)
    pairs = [each for each in comparison.pairs if each.p < 0.05]
    differ = ", ".join(f"{ARCHITECTURES[each.first][0]} and {ARCHITECTURES[each.second][0]}" for each in pairs)
    cleaned = [
        Finding(
            f"{name}: cylinders outside after 120 s, of 5",
            {"E": "cleans the arena with 7 of 10 (secondary)", "A": "below the others (secondary)"}.get(name[0], ""),
            outside[each],
            within=(0, 5),
        )
        for each, name in ARCHITECTURES.items()
    ]
    trained = [
        Finding(
            f"{name}: fitness of the last generation, best",
            "",
            [one.generations[-1].fitness.max() for one in evolutions[each]],
        )
        for each, name in ARCHITECTURES.items()
    ]
    return [
        Finding(
            "parameters, A to E",
            "E has the most (secondary)",
            ", ".join(str(tasks[each].parameter_count) for each in tasks),
        ),
        *trained,
        *cleaned,
        Finding("pairs that differ, p < 0.05", "at generation 199 E from all others (secondary)", differ or "none"),
        Finding("test", "", f"{comparison.pairs[0].test.method}, {comparison.correction}"),
    ]


if __name__ == "__main__":
    command(main)
