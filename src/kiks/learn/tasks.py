"""Tasks by name, and task files: a ready-made task with changes, in a few lines of TOML (the page "Evolution")."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from kiks.batch.initial_state import Starts
from kiks.batch.loop_timing import Milliseconds
from kiks.control.controller import Controller
from kiks.control.controllers import Recipe, controller_of
from kiks.control.recipes import module_in
from kiks.errors import KiksError, ParameterError, shown
from kiks.learn.ready_tasks import (
    TASKS,
    avoid,
    disperse,
    follow,
    football,
    gather,
    light,
    maze,
    pursuit,
    taking_changes,
)
from kiks.learn.task import WORLDS_MAX, Seconds, Task
from kiks.meant import nearest_file
from kiks.model.arena import Arena
from kiks.model.atomic_files import inside, path_of
from kiks.model.checks import ROBOTS_MAX
from kiks.model.data_file import OneOf, Rule, Text, Whole, check, parse_toml, read_file, record
from kiks.model.package import shipped
from kiks.model.robot import robot_names
from kiks.unknown_names import hinting

__all__ = [
    "TASKS",
    "avoid",
    "disperse",
    "floreano_mondada_1994",
    "floreano_mondada_1996",
    "floreano_nolfi_1997",
    "follow",
    "football",
    "gather",
    "jakobi_husbands_harvey_1995",
    "light",
    "load",
    "maze",
    "miglino_lund_nolfi_1995",
    "nolfi_1997",
    "pursuit",
]


__getattr__, __dir__ = hinting(__name__, __all__)


def paper_task(name: str) -> Callable[..., Task]:
    """Return the function that makes the task of a paper, from its file, which first runs when it is called."""
    file = shipped(f"examples/classics/tasks/{name}.py")

    def make(controller: Controller | None = None, **changes: Any) -> Task:
        return taking_changes(getattr(module_in(file), name))(controller, **changes)

    make.__name__ = make.__qualname__ = name
    make.__doc__ = file.read_text(encoding="utf-8").split('"""')[1]
    TASKS[name] = make
    return make


floreano_mondada_1994 = paper_task("floreano_mondada_1994")
jakobi_husbands_harvey_1995 = paper_task("jakobi_husbands_harvey_1995")
nolfi_1997 = paper_task("nolfi_1997")
floreano_nolfi_1997 = paper_task("floreano_nolfi_1997")
floreano_mondada_1996 = paper_task("floreano_mondada_1996")
miglino_lund_nolfi_1995 = paper_task("miglino_lund_nolfi_1995")

Name = Annotated[
    Text,
    Field(pattern=r"^\w[\w .-]{0,59}$", description="The folder of its evolution has this name."),
    Rule("a text of 1 to 60 letters, digits, blanks, dots, - and _"),
]
ArenaPath = Annotated[Text, Field(min_length=1, description="An arena file in the folder of this file or below it.")]


@record
class TaskFile:
    """A task for `kiks evolve`: a ready-made task with changes."""

    task: Annotated[Literal[1], Field(description="Version of the format.")]
    base: Annotated[str, OneOf(tuple(TASKS)), Field(description="The ready-made task: what is measured, and fitness.")]
    name: Name | None = None
    seconds: Annotated[Seconds, Field(description="Time for which a candidate drives in each world.")] | None = None
    worlds: (
        Annotated[Whole, Field(ge=1, le=WORLDS_MAX, description="Worlds of a candidate: n times the arenas, or fewer.")]
        | None
    ) = None
    arenas: (
        Annotated[tuple[ArenaPath, ...], Field(min_length=1, max_length=100, description="Arena files to train in.")]
        | None
    ) = None
    exam: ArenaPath | None = None
    robot: (
        Annotated[Text, Field(min_length=1, description="'khepera', 'khepera_ii', or a robot file beside.")] | None
    ) = None
    robots: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX, description="Robots in each world.")] | None = None
    starts: (
        Annotated[Starts, Field(description="'random' places, or those of the 'arena'; 'arena' for several robots.")]
        | None
    ) = None
    period_ms: Annotated[Milliseconds, Field(description="Period of the control loop.")] | None = None
    think_ms: Annotated[Milliseconds, Field(description="Thinking time before each command.")] | None = None
    baud: Annotated[Whole, Field(ge=0, le=10_000_000, description="Bits per second; 0 for no line.")] | None = None
    controller: Annotated[Recipe, Field(description="The controller to evolve.")] | None = None
    against: Annotated[Recipe, Field(description="Of two sides, the controller of the second.")] | None = None


def load(name: str | Path, controller: Controller | None = None) -> Task:
    """Return a task by its name or its file.

    A task file (.toml) may name a controller of the user's, whose file runs. A Python file (.py) runs, and must define
    `task`.

    Args:
        name: A key of `TASKS`, or a path that ends in .toml or .py.
        controller: Replaces the task's own controller.

    Example:
        >>> import kiks
        >>> kiks.tasks.load("maze").seconds
        180.0
    """
    name = str(path_of(name, "the name of a task"))
    if name in TASKS:
        return TASKS[name](controller)
    path = Path(name)
    if path.suffix == ".toml":
        return _load_task_file(path, controller)
    if path.suffix != ".py" or not path.is_file():
        raise ParameterError(
            f"a task must be one of {', '.join(TASKS)}, a task file *.toml or a Python file, but it was {shown(name)}."
            f"{nearest_file(path, TASKS)}"
        )
    task = getattr(module_in(path.absolute()), "task", None)
    if not isinstance(task, Task):
        raise ParameterError(f"{shown(name)} must hold a `task = kiks.Task(...)`, but `task` was {shown(task)}.")
    task = replace(task, file=str(path.absolute()))
    return task if controller is None else replace(task, controller=controller)


def _load_task_file(path: Path, controller: Controller | None) -> Task:
    """Return the task of a file; the files that it names lie in its folder or below."""
    what = f"Task file {str(path)!r}"
    given = check(TaskFile, parse_toml(read_file(path, what), what), what)
    try:
        return _task_of(given, path, controller)
    except KiksError as error:
        raise ParameterError(f"{what}: {error}") from None


def _task_of(given: TaskFile, path: Path, controller: Controller | None) -> Task:
    folder, base = path.parent, TASKS[given.base]()
    changes: dict[str, Any] = {
        name: value for name in ("seconds", "worlds", "robots", "starts") if (value := getattr(given, name)) is not None
    }
    if given.arenas is not None:
        changes["arenas"] = tuple(Arena.load(inside(folder, each, "arenas")) for each in given.arenas)
    if given.exam is not None:
        if base.exam is None:
            raise ParameterError(f"exam must be left out, because {shown(given.base)} has none, but it was given.")
        changes["exam"] = replace(base.exam, arenas=(Arena.load(inside(folder, given.exam, "exam")),))
    if given.robot is not None:
        is_name = given.robot in robot_names()
        changes["robot"] = given.robot if is_name else str(inside(folder, given.robot, "robot"))
    times = {"period_s": given.period_ms, "think_s": given.think_ms}
    timing: dict[str, Any] = {name: value / 1000 for name, value in times.items() if value is not None}
    if given.baud is not None:
        timing["baud"] = given.baud or None
    changes["timing"] = replace(base.timings[0], **timing)
    if controller is None and given.controller is not None:
        controller = controller_of(given.controller, folder)
    if controller is not None:
        changes["controller"] = controller
    if given.against is not None:
        if base.against is None:
            raise ParameterError(
                f"against must be left out, because {shown(given.base)} has one side, but it was given."
            )
        changes["against"] = replace(base.against, controller=controller_of(given.against, folder))
    return replace(base, name=given.name or path.stem, file=str(path.absolute()), **changes)
