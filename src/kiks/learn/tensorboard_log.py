"""The log of an evolution for TensorBoard. It needs the package `tensorboard`.

`kiks evolve --tensorboard` writes it into the folder of the evolution; `tensorboard --logdir FOLDER` shows it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self

import numpy as np

from kiks.errors import ParameterError, library
from kiks.learn.evolution import Evolution
from kiks.model.atomic_files import make_folder, path_of

FOLDER, FILES = "tensorboard", "events.out.tfevents.*"
"""Folder of the log in that of an evolution, and the files in it."""

MODULE = "tensorboard.summary"


class TensorBoardLog:
    """Writes the curves of an evolution for TensorBoard, in a `with` statement.

    Call it after each generation: it writes those that it has not written yet. Files of an earlier log in the folder
    are removed, because the first call writes all generations again.

    Args:
        folder: Folder of the log.

    Raises:
        ParameterError: If TensorBoard is not installed.

    Example:
        >>> import kiks
        >>> evolution = kiks.Evolution(kiks.tasks.avoid(seconds=1, worlds=4), seed=1, population=4)
        >>> with TensorBoardLog("runs/curves") as log:  # doctest: +SKIP
        ...     evolution.run(generations=3, each=log)
    """

    def __init__(self, folder: str | Path) -> None:
        try:
            summary = library(MODULE)
        except ParameterError:
            raise ParameterError(
                "--tensorboard must have TensorBoard, but it is not installed. Install it: pip install tensorboard."
            ) from None
        path = path_of(folder, "folder")
        make_folder(path, "a log for TensorBoard")
        for file in path.glob(FILES):
            file.unlink()
        self._writer: Any = summary.Writer(str(path))
        self._count = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def __call__(self, evolution: Evolution) -> None:
        """Write the generations since the last call."""
        for number in range(self._count, len(evolution.generations)):
            for name, value in _curves(evolution, number):
                self._writer.add_scalar(name, value, number + 1)
        self._count = len(evolution.generations)
        self._writer.flush()


def _curves(evolution: Evolution, number: int) -> Iterator[tuple[str, float]]:
    """Yield the curves at a generation, whose number counts from 0: their names and values."""
    held = evolution.generations[number]
    yield "evaluations", float(sum(each.evaluations for each in evolution.generations[: number + 1]))
    sides, names = evolution.task.sides, ("fitness", *evolution.task.measure_names)
    if not evolution.task.against and not np.isnan(held.champion_fitness):
        yield "fitness/champion", held.champion_fitness
    for side, part in zip(sides, np.split(held.values[: held.population], len(sides), axis=1), strict=True):
        begin = f"{side.name}/" if side.name else ""
        fitness = part[:, 0]
        for name, value in (("best", fitness.max()), ("median", np.median(fitness)), ("mean", fitness.mean())):
            yield f"{begin}fitness/{name}", float(value)
        for name, value in zip(names[1:], part.mean(axis=0)[1:], strict=False):
            yield f"{begin}measures/{name}", float(value)
