"""An individual of a saved evolution: any candidate of any generation, in a world of its evaluation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from kiks.errors import ParameterError, shown
from kiks.learn import tasks
from kiks.learn.champion import Champion
from kiks.learn.evolution_log import EvolutionFolder, Identity
from kiks.learn.fingerprint import differing
from kiks.learn.seeds import WORLDS, seed_for
from kiks.learn.task import Task
from kiks.model.checks import check_count


def load_individual(
    folder: str | Path, generation: int, *, rank: int = 1, world: int = 0, task: Task | None = None
) -> tuple[Champion, int]:
    """Return a candidate of an evolution, to drive it again, and its number in the generation as in the log.

    The candidate's world is one of those of its evaluation, and ends when that did.

    Args:
        folder: Folder of the evolution.
        generation: Its generation, from 1.
        rank: 1 for the best of the generation, 2 for the next one; equal ones by their numbers.
        world: Number of the world of its evaluation, from 0.
        task: The task; looked up if left out: a ready-made one, or a task file (.toml).
    """
    saved = EvolutionFolder(folder)
    identity = saved.identity()
    count = saved.generation_count()
    if not count:
        raise ParameterError(f"the evolution in {str(saved.path)!r} must have a generation, but it has none yet.")
    number = check_count("generation", generation, 1, count) - 1
    found = task_of(saved, identity, task)
    arrays = saved.generation(number, identity)
    fitness = arrays["values"][: identity.population, 0]
    order = (-fitness).argsort(kind="stable")
    candidate = int(order[check_count("rank", rank, 1, identity.population) - 1])
    champion = found.individual(arrays["candidates"][candidate], seed_for(identity.seed, WORLDS, number), world)
    known = replace(champion, fitness=float(fitness[candidate]), generation=generation, kiks=identity.kiks)
    return replace(known, algorithm=identity.algorithm, seed=identity.seed), candidate


def task_of(folder: EvolutionFolder, identity: Identity, given: Task | None = None) -> Task:
    """Return the task of the evolution in a folder, with its controllers.

    Args:
        folder: The folder.
        identity: Its identity.
        given: The task, for one that was made in Python; looked up if left out.
    """
    name, file = identity.task, identity.task_file
    where = f"the task {shown(name)} of the evolution in {str(folder.path)!r}"
    if given is not None:
        task = given
    elif file.endswith(".toml") and Path(file).is_file():
        task = tasks.load(file)
    elif file:
        # A Python file runs, so a person has to name it.
        found = "is a Python file" if file.endswith(".py") else "is not there"
        raise ParameterError(f"{where} must be given, for its file {shown(file)} {found}. Give it: --task FILE.")
    elif name in tasks.TASKS:
        task = tasks.load(name)
    else:
        raise ParameterError(
            f"{where} must be given, for it was made in Python. Give a Python file in which `task` is this task: "
            "--task FILE."
        )
    if " and ".join(side.controller.name for side in task.sides) != identity.controller:
        first, *others = (Champion.load(folder.champion_file(side)).controller for side in identity.sides)
        against = task.against and replace(task.against, controller=others[0])
        task = task.with_changes(controller=first, against=against)
    if names := differing(identity.task_digest, task.digest(), ("algorithm",)):
        raise ParameterError(
            f"{where} must be the one that was evolved, but it differs now in: {names}. Give a file with the earlier "
            "task: --task FILE."
        )
    return task
