"""The cross tournament: champions of co-evolutions meet those of others.

The fitness of two sides is relative: a predator that catches each prey of its own evolution may have met slow ones. So
co-evolutions are compared by how their champions do against strangers: each meets the champions of all other evolutions
that are compared, from the same starts. Each group of opponents counts alike, so that groups of two evolutions or more
meet the same mixture; a lone evolution has no strangers in its own group.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.learn import seeds
from kiks.learn.champion import Champion
from kiks.learn.evaluation import Floats, evaluate
from kiks.learn.evolution_log import EvolutionFolder
from kiks.learn.individual import task_of
from kiks.learn.seeds import seed_for
from kiks.learn.task import Task

MEETINGS = 8
"""Number of evaluations of each pair, each from another start."""


def hold_cross_tournament(
    groups: Mapping[str, Sequence[Path]], task: Task | None = None, executor: Executor | None = None
) -> dict[str, dict[str, list[float]]]:
    """Return the mean fitness of the champions of co-evolutions against those of all others.

    Args:
        groups: Folders of co-evolutions of one task, at least two in all, by the names of their groups.
        task: The task, for one that was made in Python; looked up if left out.
        executor: As for `kiks.Evolution.run`.

    Returns:
        For each side by its name, and each group by its name, the mean of each evolution's champion.
    """
    folders = [(name, EvolutionFolder(path)) for name, paths in groups.items() for path in paths]
    if len(folders) < 2:
        raise ParameterError("a cross tournament must have two evolutions or more, but it has one. Add another.")
    # One task for each group, whose controllers may differ.
    tasks = {
        name: task_of(EvolutionFolder(paths[0]), EvolutionFolder(paths[0]).identity(), task)
        for name, paths in groups.items()
    }
    sides = [side.name for side in tasks[folders[0][0]].sides]
    champions = [
        [np.array(Champion.load(folder.champion_file(side)).parameters) for side in sides] for _, folder in folders
    ]
    drawn = np.array([seed_for(0, seeds.TOURNAMENT, number) for number in range(MEETINGS)], np.int64)
    size, of_group = len(folders), np.array([name for name, _ in folders])
    scores: Floats = np.full((2, size, size), np.nan)
    for one, first in tasks.items():
        for other, second in tasks.items():
            meeting = first.with_changes(against=second.against)
            pairs = [
                (row, column)
                for row in np.flatnonzero(of_group == one)
                for column in np.flatnonzero(of_group == other)
                if row != column  # strangers only
            ]
            if not pairs:
                continue
            rows = np.array([np.concatenate([champions[row][0], champions[column][1]]) for row, column in pairs])
            values = evaluate(meeting, np.repeat(rows, MEETINGS, axis=0), np.tile(drawn, len(rows)), executor)
            means = values.reshape(len(pairs), MEETINGS, 2, -1)[:, :, :, 0].mean(axis=1)
            for (row, column), (of_first, of_second) in zip(pairs, means, strict=True):
                scores[:, row, column] = of_first, of_second
    means_of = (mean_over_groups(each, of_group) for each in (scores[0], scores[1].T))
    return {
        side: {name: means[of_group == name].tolist() for name in groups}
        for side, means in zip(sides, means_of, strict=True)
    }


def mean_over_groups(scores: Floats, of_group: NDArray[np.str_]) -> Floats:
    """Return the mean over groups of a champion's mean score against their strangers, float64 [champion].

    Args:
        scores: Score of each champion against each opponent, float64 [champion, opponent]; NaN if it is no stranger.
        of_group: Name of the group of each opponent [opponent].
    """
    known = np.ma.masked_invalid(scores)
    of_groups = [known[:, of_group == name].mean(axis=1) for name in dict.fromkeys(of_group.tolist())]
    means: Floats = np.ma.stack(of_groups).mean(axis=0).filled(np.nan)
    return means
