"""Specifications of environments, and those of `kiks/Avoid-v0` and the others that come with KiKS."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import field, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from kiks.batch.initial_state import Arenas, Starts
from kiks.batch.loop_timing import Timing
from kiks.control.measure import Measure, measure
from kiks.control.measures import avoidance, light_approach, near_light_share, nearest_lamp_mm
from kiks.control.senses import check_senses, reading_count
from kiks.engine.physics.motor import SPEED_MAX
from kiks.errors import ParameterError, nearest, shown
from kiks.learn import football as game
from kiks.learn import ready_tasks
from kiks.learn.task import Task
from kiks.model.arena import Arena, Cylinder, Pose
from kiks.model.checks import check_kind, check_number
from kiks.model.data_file import Number, Text, record

_CheckedMeasure = Annotated[Measure, Field(description="Write @kiks.measure over the function.")]


@record
class EnvSpec:
    """The specification of an environment: arenas, senses, reward and goal.

    Args:
        name: Its name.
        arenas: The arenas; each episode draws one of them.
        reward: A measure whose first note accumulates; its gain in a step is the reward of that step.
        goal: A measure: an episode terminates once its first note is above zero for at least one robot of the world.
            None for environments that never terminate.
        senses: The robots' senses, of 'proximity', 'ambient' and 'camera'.
        starts: 'random' for new free places in each episode; 'arena' for the starts of the arena.
        speed_limit: Wheel speed of action 1 [pulses/10 ms].
        timing: Timing of the control loop; that of a program on a line of 9600 baud if left out.
    """

    name: Text
    arenas: Arenas
    reward: _CheckedMeasure
    goal: _CheckedMeasure | None = None
    senses: Annotated[tuple[Text, ...], BeforeValidator(check_senses), Field(min_length=1)] = ("proximity",)
    starts: Starts = "random"
    speed_limit: Annotated[Number, Field(gt=0, le=SPEED_MAX)] = 10.0
    timing: Timing = field(default_factory=Timing)

    # Functions cannot be compared: a specification equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    @property
    def sensor_count(self) -> int:
        """Number of readings of a robot."""
        return reading_count(self.senses)

    def with_changes(self, **changes: Any) -> EnvSpec:
        """Return a copy with some arguments changed."""
        return replace(self, **changes)


CONTACT_COST = 5.0
"""What a contact takes off the reward of `Follow`: as much as half a second of following at best."""

ARRIVED_MM = 60.0
"""Distance to a lamp at which a robot has arrived [mm]; nearer, most light comes from above."""


@measure(notes=2)
def nearer_to_light(moment: Any, notes: Any) -> None:
    """Distance by which it has come nearer to a burning lamp since its first step [0.1 m], plus 1 once it arrives."""
    distance_mm = nearest_lamp_mm(moment)
    if notes[1] > 0.0:
        notes[0] += (notes[1] - distance_mm) / 100.0
        notes[0] += 1.0 if distance_mm <= ARRIVED_MM < notes[1] else 0.0
    notes[1] = distance_mm


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


@functools.lru_cache(maxsize=256)
def without_contacts(reward: Measure, cost: float = CONTACT_COST) -> Measure:
    """Return a reward that falls by a cost with each contact; the same measure for the same arguments.

    Args:
        reward: A measure; the gain of its first note is the reward.
        cost: What a contact takes off.
    """
    check_kind("reward", reward, Measure, "Write @kiks.measure over the function.")
    cost = check_number("cost", cost, 0, 1e6)
    watch, result = reward.kernel, reward.result

    def value(notes: NDArray[np.float64]) -> NDArray[np.float64]:
        return result(np.concatenate([notes[..., :1], notes[..., 2:]], axis=-1))

    @measure(notes=reward.note_count + 1, result=value, senses=reward.senses)
    def reward_without_contacts(moment: Any, notes: Any) -> None:
        watch(moment, notes[1:])
        notes[0] = notes[1] - cost * moment.contact_count

    return reward_without_contacts


def avoid() -> EnvSpec:
    """Drive fast and straight, far from everything."""
    return EnvSpec("Avoid", ready_tasks.training("pillars"), avoidance)


def follow() -> EnvSpec:
    """Follow a wall on the left, and touch nothing: the task `follow`."""
    return _of_task("Follow", ready_tasks.follow(), "wall_following", CONTACT_COST)


def light() -> EnvSpec:
    """Go to a lamp and stay there: the task `light`."""
    return _of_task("Light", ready_tasks.light(), light_approach.name)


def gather() -> EnvSpec:
    """Push cylinders together."""
    cylinders = tuple(Cylinder(x_mm, y_mm) for x_mm in (200, 500, 800) for y_mm in (200, 500, 800))
    arena = replace(Arena.box(1000, 1000), cylinders=cylinders, starts=(Pose(350, 350, 0.0),))
    return EnvSpec("Gather", (arena,), drawn_together)


def maze() -> EnvSpec:
    """Find the way out of a maze with a lamp at its exit."""
    arena = Arena.maze(columns=3, rows=3, seed=1)
    senses = ("proximity", "ambient")
    return EnvSpec("Maze", (arena,), nearer_to_light, near_light_share(ARRIVED_MM), senses, starts="arena")


def football() -> EnvSpec:
    """Bring the ball into the goal of the other side."""
    task = ready_tasks.football()
    return EnvSpec(
        "Football",
        task.arenas,
        game.ball_gain,
        game.is_goal,
        ("proximity", "camera"),
        speed_limit=ready_tasks.PLAYER_SPEED,
        timing=task.timings[0],
    )


def _of_task(name: str, task: Task, reward: str, contact_cost: float = 0.0) -> EnvSpec:
    """Return an environment with the arenas, senses, speed and timing of a task, and one of its measures as reward."""
    measured = next(each for each in task.measures if each.name == reward)
    recipe: Any = task.controller.recipe
    return EnvSpec(
        name,
        task.arenas,
        without_contacts(measured, contact_cost) if contact_cost else measured,
        senses=task.controller.senses,
        speed_limit=recipe["speed_limit"],
        timing=task.timings[0],
    )


ENV_SPECS: dict[str, Callable[[], EnvSpec]] = {
    "Avoid": avoid,
    "Follow": follow,
    "Light": light,
    "Gather": gather,
    "Maze": maze,
    "Football": football,
}
"""Functions that return the specifications, by the names of the environments."""


@functools.lru_cache(maxsize=16)
def _named(name: str) -> EnvSpec:
    return ENV_SPECS[name]()


def env_spec_of(spec: str | EnvSpec) -> EnvSpec:
    """Return a specification, given or by its name."""
    if isinstance(spec, EnvSpec):
        return spec
    if not isinstance(spec, str) or spec not in ENV_SPECS:
        raise ParameterError(
            f"spec must be an EnvSpec or one of {', '.join(ENV_SPECS)}, but it was {shown(spec)}."
            f"{nearest(shown(spec), tuple(ENV_SPECS))}"
        )
    return _named(spec)
