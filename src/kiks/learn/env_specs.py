"""The lessons that come with KiKS: what `kiks/Avoid-v0` and the other environments are about."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import field, replace
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from kiks.batch.initial_state import Arenas, Starts
from kiks.batch.loop_timing import Timing
from kiks.control.controller import check_senses
from kiks.control.measure import Measure, measure
from kiks.control.measures import avoidance, near_light_share, nearest_lamp_mm, wall_following
from kiks.engine.physics.motor import SPEED_MAX
from kiks.errors import ParameterError, nearest, shown
from kiks.learn.training_arenas import corridors, pillars
from kiks.model.arena import Arena, Cylinder, Lamp, Pose
from kiks.model.data_file import Number, Text, record
from kiks.model.robot import SENSOR_COUNT

_Watch = Annotated[Measure, Field(description="Write @kiks.measure over the function.")]


@record
class EnvSpec:
    """What environments of all kinds are made of: a place, what is sensed there, what is good and when it is over.

    Args:
        name: What it is called.
        arenas: Where it takes place; of several, world k has the one of number k modulo their count.
        reward: A measure whose first note adds up: what it gains in a step is the reward of that step.
        goal: A measure: an episode is over (terminated) once its first note is above zero, for one robot of the world
            at least. None for lessons that have no end of their own.
        senses: What robots sense, of 'proximity' and 'ambient'.
        starts: 'random' for free places anywhere, another for each episode; 'arena' for where the arena puts robots.
        speed_limit: What an action of 1 means [pulses/10 ms].
        timing: The pace of the loop; that of a program on a line of 9600 baud if left out.

    Raises:
        ParameterError: If an argument is out of range.
    """

    name: Text
    arenas: Arenas
    reward: _Watch
    goal: _Watch | None = None
    senses: Annotated[tuple[Text, ...], BeforeValidator(check_senses), Field(min_length=1)] = ("proximity",)
    starts: Starts = "random"
    speed_limit: Annotated[Number, Field(gt=0, le=SPEED_MAX)] = 10.0
    timing: Timing = field(default_factory=Timing)

    # Functions cannot be compared: a lesson equals itself alone.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    @property
    def sensor_count(self) -> int:
        """How many counts a robot senses."""
        return SENSOR_COUNT * len(self.senses)

    def with_changes(self, **changes: Any) -> EnvSpec:
        """Return the same lesson with other arguments.

        Raises:
            ParameterError: If one of them is unknown or out of range.
        """
        return replace(self, **changes)


ARRIVED_MM = 60.0
"""How near to a lamp a robot has arrived [mm]: a lamp's light then comes from above more than from aside."""


@measure(notes=2)
def nearer_to_light(moment: Any, notes: Any) -> None:
    """How much nearer to a lamp that burns it has come since its first step [0.1 m], and 1 once it has arrived."""
    distance_mm = nearest_lamp_mm(moment)
    if notes[1] > 0.0:
        notes[0] += (notes[1] - distance_mm) / 100.0
        notes[0] += 1.0 if distance_mm <= ARRIVED_MM < notes[1] else 0.0
    notes[1] = distance_mm


@measure(notes=2)
def drawn_together(moment: Any, notes: Any) -> None:
    """How much smaller the distances between all pairs of bodies have become since its first step, in all [0.1 m]."""
    total_mm = 0.0
    for one in range(moment.bodies.shape[0]):
        for other in range(one):
            across = moment.bodies[one].x_mm - moment.bodies[other].x_mm
            up = moment.bodies[one].y_mm - moment.bodies[other].y_mm
            total_mm += (across * across + up * up) ** 0.5
    if notes[1] > 0.0:
        notes[0] += (notes[1] - total_mm) / 100.0
    notes[1] = total_mm


def avoid() -> EnvSpec:
    """Drive fast and straight, far from everything."""
    return EnvSpec("Avoid", (pillars(),), avoidance)


def follow_wall() -> EnvSpec:
    """Drive fast and straight with a wall on the left."""
    return EnvSpec("FollowWall", (corridors(),), wall_following("left"))


def light() -> EnvSpec:
    """Go to a lamp."""
    arena = replace(Arena.box(1000, 1000), lamps=(Lamp(500, 500),))
    return EnvSpec("Light", (arena,), nearer_to_light, near_light_share(ARRIVED_MM), ("proximity", "ambient"))


def gather() -> EnvSpec:
    """Push cylinders together."""
    cylinders = tuple(Cylinder(x_mm, y_mm) for x_mm in (200, 500, 800) for y_mm in (200, 500, 800))
    arena = replace(Arena.box(1000, 1000), cylinders=cylinders, starts=(Pose(350, 350, 0.0),))
    return EnvSpec("Gather", (arena,), drawn_together)


def maze() -> EnvSpec:
    """Find the way out of a maze, in whose exit a lamp hangs."""
    arena = Arena.maze(columns=3, rows=3, seed=1)
    senses = ("proximity", "ambient")
    return EnvSpec("Maze", (arena,), nearer_to_light, near_light_share(ARRIVED_MM), senses, starts="arena")


LESSONS: dict[str, Callable[[], EnvSpec]] = {
    "Avoid": avoid,
    "FollowWall": follow_wall,
    "Light": light,
    "Gather": gather,
    "Maze": maze,
}
"""What makes them, by the names of their environments."""


@functools.lru_cache(maxsize=16)
def _named(name: str) -> EnvSpec:
    return LESSONS[name]()


def lesson_of(lesson: str | EnvSpec) -> EnvSpec:
    """Return a lesson, given or by its name.

    Raises:
        ParameterError: If there is none of that name.
    """
    if isinstance(lesson, EnvSpec):
        return lesson
    if not isinstance(lesson, str) or lesson not in LESSONS:
        raise ParameterError(
            f"lesson must be a EnvSpec or one of {', '.join(LESSONS)}, but it was {shown(lesson)}."
            f"{nearest(shown(lesson), tuple(LESSONS))}"
        )
    return _named(lesson)
