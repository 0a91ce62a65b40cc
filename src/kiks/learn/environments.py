"""Environments: tasks with a reward; `kiks/Avoid-v0` and the others that come with KiKS."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.batch.loop_timing import Timing
from kiks.control.actuators import orders_of
from kiks.control.arguments import made_once
from kiks.control.controllers import linear
from kiks.control.measure import Measure, measure
from kiks.control.measures import (
    freely_ahead,
    light_approach,
    mean,
    near_light_share,
    nearest_lamp_mm,
    roaming_share,
    wall_following,
)
from kiks.errors import ParameterError, shown
from kiks.learn import football as game
from kiks.learn import ready_tasks
from kiks.learn.task import Task, Watched
from kiks.meant import nearest
from kiks.model.arena import Arena, Cylinder, Pose
from kiks.model.data_file import Number

CONTACT_COST = 5.0
"""What a contact takes off the rewards of `Avoid` and `Follow`: half a second of following at best is worth as much."""

EPISODE_S = 60.0
"""Time after which an episode is truncated [s]."""

PERIODS_S = {"Avoid": ready_tasks.PERIOD_S}
"""Periods of the control loops of environments that have another one than usual [s]: known before a task is made."""

FOLLOW_SPEED_LIMIT = 8.0
"""Highest speed of `Follow` [pulses/10 ms]: 64 mm/s."""

LIT_ROOMS = 18
"""Number of rooms of `Light`."""

ARRIVED_MM = 60.0
"""Distance to a lamp at which a robot has arrived [mm]; nearer, most light comes from above."""


@measure(notes=4, result=mean, senses=("proximity",))
def exploring(moment: Any, notes: Any) -> None:
    """Mean of the products of `avoidance` and `roaming` of a step: fast, straight, far from everything, and elsewhere.

    A robot that shuttles between two places or drives in circles gets little, unlike in `avoidance` alone.
    """
    notes[0] += freely_ahead(moment) * roaming_share(moment, notes)
    notes[1] += 1.0


@measure(notes=2)
def nearer_to_light(moment: Any, notes: Any) -> None:
    """Distance by which it has come nearer to a burning lamp since its first step [0.1 m], plus 1 once it arrives.

    Steps in which no lamp burns do not count.
    """
    distance_mm = nearest_lamp_mm(moment)
    if notes[1] > 0.0 and distance_mm < np.inf:
        notes[0] += (notes[1] - distance_mm) / 100.0
        notes[0] += 1.0 if distance_mm <= ARRIVED_MM < notes[1] else 0.0
    notes[1] = distance_mm if distance_mm < np.inf else 0.0


@measure(notes=2)
def drawn_together(moment: Any, notes: Any) -> None:
    """Decrease of the sum of distances between all pairs of bodies since its first step [0.1 m]."""
    total_mm = 0.0
    for one in range(moment.bodies.shape[0]):
        for other in range(one):
            dx_mm = moment.bodies[one].x_mm - moment.bodies[other].x_mm
            dy_mm = moment.bodies[one].y_mm - moment.bodies[other].y_mm
            total_mm += (dx_mm * dx_mm + dy_mm * dy_mm) ** 0.5
    if notes[1] > 0.0:
        notes[0] += (notes[1] - total_mm) / 100.0
    notes[1] = total_mm


Cost = Annotated[Number, Field(ge=0, le=1e6)]


@made_once
def without_contacts(reward: Watched, cost: Cost = CONTACT_COST) -> Measure:
    """Return a reward that falls by a cost with each contact; the same measure for the same arguments.

    Args:
        reward: A measure; the gain of its first note is the reward.
        cost: What a contact takes off.
    """
    watch, result = reward.kernel, reward.result

    def value(notes: NDArray[np.float64]) -> NDArray[np.float64]:
        return result(np.concatenate([notes[..., :1], notes[..., 2:]], axis=-1))

    @measure(notes=reward.note_count + 1, result=value, senses=reward.senses)
    def reward_without_contacts(moment: Any, notes: Any) -> None:
        watch(moment, notes[1:])
        notes[0] = notes[1] - cost * moment.contact_count

    return reward_without_contacts


def avoid() -> Task:
    """Drive fast and straight, explore, and touch nothing: the task `avoid`, among walls that are always near."""
    return narrow(ready_tasks.avoid(name="Avoid", reward=without_contacts(exploring)), 4)


def follow() -> Task:
    """Follow a wall on the left, and touch nothing: the task `follow`, faster, among walls that are always near."""
    reward, fast = without_contacts(wall_following("left")), linear(speed_limit=FOLLOW_SPEED_LIMIT)
    return narrow(ready_tasks.follow(fast, name="Follow", reward=reward, timing=Timing()), 3)


def narrow(task: Task, count: int) -> Task:
    """Return a task in so many of its arenas, and with an exam in two: the first ones, which are drawn by hand."""
    exam = task.exam and task.exam.with_changes(arenas=task.exam.arenas[:2])
    return task.with_changes(arenas=task.arenas[:count], exam=exam)


def light() -> Task:
    """Go to a lamp and stay there: the task `light`, from random places in smaller rooms, where most see the lamp."""
    return ready_tasks.light(name="Light", arenas=ready_tasks.rooms(LIT_ROOMS), starts="random", reward=light_approach)


def gather() -> Task:
    """Push cylinders together."""
    cylinders = tuple(Cylinder(x_mm, y_mm) for x_mm in (200, 500, 800) for y_mm in (200, 500, 800))
    arena = replace(Arena.box(1000, 1000), cylinders=cylinders, starts=(Pose(350, 350, 0.0),))
    return Task("Gather", (arena,), linear(), (drawn_together,), reward=drawn_together)


def maze() -> Task:
    """Find the way out of a maze with a lamp at its exit."""
    return Task(
        "Maze",
        (Arena.maze(columns=3, rows=3, seed=1),),
        linear(senses=("proximity", "ambient")),
        (nearer_to_light,),
        starts="arena",
        reward=nearer_to_light,
        until=near_light_share(ARRIVED_MM),
    )


def football() -> Task:
    """Bring the ball into the goal of the other side."""
    task = ready_tasks.football()
    return Task(
        "Football",
        task.arenas,
        task.controller,
        (game.ball_gain,),
        worlds=task.worlds,
        timing=task.timing,
        reward=game.ball_gain,
        until=game.is_goal,
    )


ENVIRONMENTS: dict[str, Callable[[], Task]] = {
    make.__name__.capitalize(): functools.cache(make) for make in (avoid, follow, light, gather, maze, football)
}
"""Functions that return the environments, by name; each time the same one."""


def step_limit(period_s: float) -> int:
    """Return the number of steps after which an episode is truncated, with a period of the control loop [s]."""
    return round(EPISODE_S / (period_s or Timing().period_s))


def find_environment(task: str | Task) -> Task:
    """Return an environment, given or by its name."""
    if isinstance(task, str) and task in ENVIRONMENTS:
        return ENVIRONMENTS[task]()
    if not isinstance(task, Task):
        raise ParameterError(
            f"task must be a kiks.Task with a reward, or one of {', '.join(ENVIRONMENTS)}, but it was {shown(task)}."
            f"{nearest(task, tuple(ENVIRONMENTS))}"
        )
    if task.reward is None or task.against is not None:
        raise ParameterError(
            f"an environment must be a task of one side with a reward, but {shown(task.name)} is not. Give it a "
            "measure: task.with_changes(reward=measure)."
        )
    if orders := orders_of(task.controller.actuators):
        names = " and ".join(order.name for order in orders)
        raise ParameterError(
            f"the controller of an environment must command wheels alone, but that of {shown(task.name)} commands "
            f"{names}, too. Evolve it, or give the task another controller."
        )
    if len(task.timings) > 1 or len(task.sides[0].specs) > 1:
        raise ParameterError(
            f"an environment must have one timing and one kind of robot, but {shown(task.name)} has more. "
            "Choose: task.with_changes(timing=kiks.Timing(), robot='khepera')."
        )
    return task
