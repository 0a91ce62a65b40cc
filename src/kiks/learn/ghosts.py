"""Whole generations of a saved evolution as ghosts, for `kiks.export.kinds`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from kiks.errors import ParameterError
from kiks.export.film import FPS, SIZE
from kiks.export.ghost_frames import draw_ghost_page
from kiks.export.ghosts import Ghosts, draw_ghost_film, draw_ghost_picture
from kiks.export.kinds import FILMS, KINDS
from kiks.learn import tasks
from kiks.learn.evolution_log import EvolutionFolder
from kiks.learn.individual import task_of
from kiks.learn.seeds import WORLDS, seed_for
from kiks.learn.task import Task
from kiks.model.atomic_files import ending_of
from kiks.model.checks import check_count
from kiks.model.robot import specs_of

POINTS_MAX = 2000
"""Most poses of a ghost."""

SHOWN = 5
"""Number of generations that are shown unless some are named: at equal intervals."""


def save_ghosts(
    folder: str | Path,
    path: str | Path,
    *,
    generations: Sequence[int] | None = None,
    world: int = 0,
    task: Task | str | None = None,
    size: tuple[int, int] = SIZE,
    fps: int = FPS,
    speed: float = 1.0,
    on_progress: Callable[[float], object] = lambda share: None,
) -> None:
    """Make a film of generations one after the other, or a picture of the whole trajectories of the last one.

    Args:
        folder: Folder of the evolution, of one side, which may run.
        path: The file: .mp4, .gif or .webp for a film, .png for a picture.
        generations: Numbers of the generations, from 1; five, the last one included, if left out.
        world: Number of the world of their evaluation, from 0.
        task: The task or its file, if it was made in Python or was moved.
        size: Width and height [pixels]; of an MP4, an odd one becomes one less.
        fps: Pictures per second.
        speed: Simulated seconds per second of the film.
        on_progress: Called after each picture with the share that is done.
    """
    is_film = ending_of(path, "ghosts", KINDS["ghosts"].endings) in FILMS
    chosen = _chosen(folder, generations)
    scenes = load_ghosts(folder, chosen if is_film else chosen[-1:], world=world, task=task)
    if is_film:
        draw_ghost_film(scenes, path, size=size, fps=fps, speed=speed, on_progress=on_progress)
    else:
        draw_ghost_picture(scenes[-1], path, size)


def save_ghost_page(
    folder: str | Path,
    path: str | Path,
    *,
    generations: Sequence[int] | None = None,
    world: int = 0,
    task: Task | str | None = None,
) -> None:
    """Write a page with a player of generations; arguments as for `save_ghosts`."""
    draw_ghost_page(load_ghosts(folder, _chosen(folder, generations), world=world, task=task), path)


def _chosen(folder: str | Path, generations: Sequence[int] | None) -> Sequence[int]:
    """Return the numbers of the generations that are shown."""
    if generations is None:
        count = max(EvolutionFolder(folder).generation_count(), 1)
        return [int(each) for each in np.unique(np.linspace(1, count, SHOWN).round())]
    if not len(generations):
        raise ParameterError("ghosts must be of one generation at least, but there was none.")
    return generations


def load_ghosts(
    folder: str | Path, generations: Sequence[int], *, world: int = 0, task: Task | str | None = None
) -> list[Ghosts]:
    """Return generations of an evolution, in a world of their evaluation; arguments as for `save_ghosts`.

    Each candidate drives again as it did there, in a world of its own; all its robots are ghosts. The best comes first.
    """
    saved = EvolutionFolder(folder)
    identity = saved.identity()
    count = saved.generation_count()
    if len(identity.sides) != 1 or not count:
        raise ParameterError(
            f"the evolution in {str(saved.path)!r} must have one side and a generation for ghosts, but it has "
            f"{len(identity.sides)} and {count}."
        )
    found = task_of(saved, identity, tasks.load(task) if isinstance(task, str) else task)
    world, scenes = check_count("world", world, 0, found.worlds - 1), []
    points = min(max(round(found.seconds / found.timings[0].period_s), 2), POINTS_MAX)
    for generation in generations:
        number = check_count("generation", generation, 1, count) - 1
        arrays, seed = saved.generation(number, identity), seed_for(identity.seed, WORLDS, number)
        fitness = arrays["values"][: identity.population, 0]
        candidates = arrays["candidates"][(-fitness).argsort(kind="stable")]
        trajectories = found.trajectories(candidates, np.full(len(candidates), seed), points)[:, world]
        shown_by = found.individual(candidates[0], seed, world)
        (spec,) = specs_of(shown_by.robot, 1, None)
        assert shown_by.world is not None
        title = f"{found.name}   generation {generation}   best fitness {fitness.max():.3g}"
        poses = trajectories.reshape(-1, *trajectories.shape[2:])
        scenes.append(Ghosts(shown_by.world.arena, spec, poses, found.seconds, title))
    return scenes
