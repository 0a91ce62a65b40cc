"""Tasks by name: those that come with KiKS, and those in files of the user."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from kiks.control.controller import Controller
from kiks.control.controller_spec import module_in
from kiks.errors import ParameterError, nearest, shown
from kiks.learn.ready_tasks import TASKS, avoid, follow, gather, light, maze, maze_qd
from kiks.learn.task import Task
from kiks.learn.task_file import load_task_file
from kiks.model.atomic_files import path_of

__all__ = ["TASKS", "avoid", "follow", "gather", "light", "load", "maze", "maze_qd"]


def load(name: str | Path, controller: Controller | None = None) -> Task:
    """Return a task by its name or its file.

    A task file (.toml) may name a controller of the user's, whose file runs. A Python file (.py) runs, and must define
    `task`.

    Args:
        name: A key of `TASKS`, or a path that ends in .toml or .py.
        controller: Replaces the task's own controller.

    Raises:
        ParameterError: If the task is unknown, or the file does not hold one.
    """
    name = str(path_of(name, "the name of a task"))
    if name in TASKS:
        return TASKS[name](controller)
    path = Path(name)
    if path.suffix == ".toml":
        return load_task_file(path, controller)
    if path.suffix != ".py" or not path.is_file():
        raise ParameterError(
            f"a task must be one of {', '.join(TASKS)}, a task file *.toml or a Python file, but it was {shown(name)}."
            f"{nearest(name, TASKS)}"
        )
    task = getattr(module_in(path.absolute()), "task", None)
    if not isinstance(task, Task):
        raise ParameterError(f"{shown(name)} must hold a `task = kiks.Task(...)`, but `task` was {shown(task)}.")
    task = replace(task, file=str(path.absolute()))
    return task if controller is None else replace(task, controller=controller)
