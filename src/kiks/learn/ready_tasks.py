"""The tasks that come with KiKS."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.batch.initial_state import random_starts
from kiks.batch.loop_timing import Timing
from kiks.control import controllers, measures
from kiks.control.arguments import record_of
from kiks.control.controller import Controller
from kiks.learn import football as game
from kiks.learn.exam import Exam
from kiks.learn.experiment import CLEAR_MM, cautious_mean
from kiks.learn.task import Axis, Side, Task
from kiks.model.arena import Arena, Pose
from kiks.model.shipped import shipped_arena

Floats = NDArray[np.float64]
Values = Mapping[str, Floats]

TASKS: dict[str, Callable[..., Task]] = {}
"""The tasks that come with KiKS, by name."""

AVOID_SPEED_LIMIT, PERIOD_S = 5.0, 0.06
"""Highest speed of `avoid` [pulses/10 ms], 40 mm/s, and period of the control loop of `avoid` and `follow` [s].

The sensors notice a dark thing (brightness 40) from 8 mm away. At 64 mm/s and 0.1 s a robot drives up to 6.4 mm before
it senses the thing, and 3 mm more before its command acts.
"""

LEAST_ROAMING = 0.2
"""Mean `roaming` from which on a robot gets around: 16 mm/s away from where it was two seconds ago."""

CONTACT_COST = 3.0
"""Fitness is divided by 1 plus this times the mean number of contacts per world; in `follow`, in each world."""

CONTACTS_COUNTED = 3.0
"""Largest number of contacts of a world that counts: a stuck robot has hundreds."""

EXAM_ROOM_SEED = 1000
"""Seed of the first random room of an exam; rooms of training have those from 0 on."""

FURNITURE = (40, 90, 140)
"""Brightness of dark furniture, as in the arena `office`: the sensors notice it from 10 to 20 mm away."""

PLACES = 200
"""Places of a room among which its dark starts are found."""


def taking_changes(make: Callable[..., Task]) -> Callable[..., Task]:
    """Return a function that returns a task, and takes another controller and other arguments of `Task` besides.

    The annotations of its own arguments check them.
    """
    names, arguments = inspect.signature(make).parameters, record_of(make)

    @functools.wraps(make)
    def changed(controller: Controller | None = None, **changes: Any) -> Task:
        own = arguments(**{name: changes.pop(name) for name in names if name in changes})
        task = make(**vars(own))
        return replace(task, **changes if controller is None else {"controller": controller, **changes})

    del vars(changed)["__wrapped__"]  # its signature is that of `changed`
    return changed


def ready(make: Callable[..., Task]) -> Callable[..., Task]:
    """Add a function that returns a task to `TASKS`, with changes."""
    changed = TASKS[make.__name__] = taking_changes(make)
    return changed


def reduced_by_contacts(fitness: Floats, values: Values, cost: float = CONTACT_COST) -> Floats:
    """Return fitness reduced by contacts, but not below zero: driving with contacts beats standing still."""
    contacts = np.minimum(values["contacts"], CONTACTS_COUNTED).mean(axis=1)
    reduced: Floats = fitness / (1 + cost * contacts)
    return reduced


def training(*names: str) -> tuple[Arena, ...]:
    """Return arenas of `examples/arenas/training`."""
    return tuple(shipped_arena(f"training/{name}") for name in names)


@cache
def rooms(count: int, first: int = 0, **sizes: int) -> tuple[Arena, ...]:
    """Return random rooms, the same objects each time.

    Args:
        count: Number of rooms.
        first: Seed of the first one.
        sizes: Arguments of `kiks.Arena.room`.
    """
    return tuple(Arena.room(seed=first + number, **sizes) for number in range(count))


@cache
def furnished_rooms(count: int, first: int = 0, **sizes: int) -> tuple[Arena, ...]:
    """Return `rooms` without a lamp, the same objects each time; the pillars of every second one are dark."""
    drawn = rooms(count, first, lamps=0, **sizes)
    return tuple(darkened(room) if number % 2 else room for number, room in enumerate(drawn))


def darkened(room: Arena) -> Arena:
    """Return a room whose pillars have the shades of `FURNITURE` in turn."""
    shades = cycle(FURNITURE)
    walls = (wall if wall.disc_mm is None else replace(wall, brightness=next(shades)) for wall in room.walls)
    return replace(room, walls=tuple(walls))


def exam_rooms() -> tuple[Arena, ...]:
    """Return arenas unlike those of training, for exams: random rooms, one of them with dark pillars, and `office`."""
    drawn = furnished_rooms(2, EXAM_ROOM_SEED, width_mm=1200, height_mm=1000, walls=5, pillars=4)
    return *drawn, shipped_arena("office")


@cache
def dark_rooms(count: int, starts: int, far_mm: float, first: int = 0, **sizes: int) -> tuple[Arena, ...]:
    """Return random rooms with a lamp, the same objects each time, whose starts are in the dark and far from the lamp.

    Args:
        count: Number of rooms.
        starts: Most starts of a room.
        far_mm: Least distance of a start from the lamp [mm].
        first: Seed of the first one.
        sizes: Arguments of `kiks.Arena.room`.
    """
    # The room whose places are looked at is not kept: its tables take 10 MB.
    drawn = (Arena.room(seed=first + number, **sizes) for number in range(count))
    return tuple(replace(room, starts=dark_places(room, far_mm)[:starts]) for room in drawn)


def dark_places(room: Arena, far_mm: float) -> tuple[Pose, ...]:
    """Return those of `PLACES` random places that are far from the lamp of a room, and behind something."""
    found: list[Pose] = []
    (lamp,) = room.lamps
    along = np.linspace(0, 1, round(math.hypot(room.width_mm, room.height_mm) / room.mm_per_cell))
    for x_mm, y_mm, heading_rad in random_starts(room, PLACES, seed=0, clear_mm=CLEAR_MM).tolist():
        across_mm, up_mm = lamp.x_mm - x_mm, lamp.y_mm - y_mm
        columns, rows = (
            ((place_mm + along * way_mm) / room.mm_per_cell).astype(int)
            for place_mm, way_mm in ((x_mm, across_mm), (y_mm, up_mm))
        )
        if math.hypot(across_mm, up_mm) >= far_mm and room.brightness[rows, columns].any():
            found.append(Pose(x_mm, y_mm, heading_rad))
    return tuple(found)


# ---- avoid ----

AVOID_CONTACT_COST = 10.0
"""As `CONTACT_COST`, but more: the exam lasts three minutes, and a single contact fails a start."""


def avoid_fitness(values: Values) -> Floats:
    """Return the fitness of `avoid`: that of Floreano and Mondada (1994) times `roaming`."""
    return reduced_by_contacts(cautious_mean(values["avoidance"] * values["roaming"]), values, AVOID_CONTACT_COST)


@ready
def avoid() -> Task:
    """The task to drive fast and straight, explore, and touch nothing (Floreano and Mondada 1994).

    Example:
        >>> import kiks
        >>> task = kiks.tasks.avoid()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['avoidance', 'roaming', 'contacts', 'path_mm', 'straightness'], 18)
    """
    return Task(
        "avoid",
        (
            *training("pillars", "corridors", "alcoves", "wall_ends"),
            *furnished_rooms(12, width_mm=1000, height_mm=800, walls=4, pillars=3),
        ),
        controllers.linear(speed_limit=AVOID_SPEED_LIMIT),
        (measures.avoidance, measures.roaming, measures.contacts, measures.path_mm, measures.straightness),
        fitness=avoid_fitness,
        # In shorter trials few robots come to a dead end: then champions stay in those of other rooms for ever.
        seconds=20.0,
        worlds=16,
        timing=Timing(period_s=PERIOD_S),
        axes=(Axis("path_mm", 0, 500), Axis("straightness", 0, 1)),
        generations=115,
        exam=Exam(
            (*training("unseen", "rooms"), *exam_rooms()),
            (measures.contacts, measures.roaming),
            f"contacts == 0 and roaming > {LEAST_ROAMING}",
            "got around for three minutes and touched nothing",
        ),
    )


# ---- follow ----

FOLLOW_SPEED_LIMIT = 7.0
"""Highest speed of `follow` [pulses/10 ms]: 56 mm/s. It has to find a wall, and may touch something twice."""

TRACE_S = 3.0
"""Time after which a trace has forgotten most of what a sensor has shown [s]: half a circle round the end of a wall."""

FOLLOW_SHARE, FOLLOW_CONTACTS = 0.8, 2.0
"""Exam of `follow`: smallest share of time beside a wall, and largest number of contacts."""


def follow_fitness(values: Values) -> Floats:
    """Return the fitness of `follow`: `wall_following`, a quarter of it after one contact in a world.

    If a contact costs less, many evolutions end with robots that scrape along walls.
    """
    return cautious_mean(values["wall_following"] / (1 + CONTACT_COST * values["contacts"]))


@ready
def follow(side: str = "left") -> Task:
    """The task to drive along walls.

    The traces of a perceptron tell whether it has just lost a wall, whose end it rounds, or must look for one.

    Args:
        side: The side of the robot on which the wall is: 'left' or 'right'.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.follow()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['wall_following', 'beside_wall_share', 'contacts', 'path_mm'], 34)
    """
    return Task(
        # The sides are two tasks: a folder of the one must not be continued as the other.
        "follow-right" if side == "right" else "follow",
        (
            *training("wall_ends", "alcoves", "corridors") * 2,
            *furnished_rooms(6, width_mm=1000, height_mm=800, walls=4, pillars=3),
            *furnished_rooms(6, 20, width_mm=1500, height_mm=1200, walls=8, pillars=4),
        ),
        controllers.mlp(hidden=(), trace_share=PERIOD_S / TRACE_S, speed_limit=FOLLOW_SPEED_LIMIT),
        (measures.wall_following(side), measures.beside_wall_share(side), measures.contacts, measures.path_mm),
        fitness=follow_fitness,
        seconds=40.0,
        worlds=12,
        timing=Timing(period_s=PERIOD_S),
        axes=(Axis("path_mm", 0, 3000), Axis("wall_following", 0, 1)),
        # Larger parameters saturate the wheels: then a robot without a wall drives straight on or spins. The arc that
        # leads round the end of a wall needs small ones.
        spread=1.0,
        # Some strategies only find robots that scrape along walls.
        algorithm="cma:starts=3",
        generations=160,
        exam=Exam(
            (*training("unseen", "unseen_rooms"), *exam_rooms()),
            (measures.beside_wall_share(side), measures.roaming, measures.contacts),
            f"beside_wall_share >= {FOLLOW_SHARE} and roaming >= {LEAST_ROAMING} and contacts <= {FOLLOW_CONTACTS}",
            "followed the wall for 80 % of three minutes",
        ),
    )


# ---- light ----


LIGHT_SPEED_LIMIT = 10.0
"""Highest speed on the way to a lamp [pulses/10 ms]: 80 mm/s. A robot in the dark has to search."""

LIGHT_CONTACT_COST = 0.5
"""As `CONTACT_COST`, but less: a robot that stands still in the dark touches nothing, and finds no lamp."""

AT_LAMP_MM = 100.0
"""Distance of the robot's middle from the lamp at which it is there [mm]."""

STAY_S = 30.0
"""Time at the end of the exam for which it must be there without a break [s]."""


LIGHT_ROOMS, LIGHT_STARTS, FROM_LIGHT_MM = 24, 12, 800.0
"""Number of rooms for training, of starts in each, and their least distance from the lamp [mm].

Champions of few rooms bounce to and fro in others for ever. At most random places the robot sees the lamp: then its
light is all that candidates learn to follow, and not to search in the dark.
"""


LIGHT_SIZES = {"width_mm": 1500, "height_mm": 1200, "walls": 8}
"""Arguments of `kiks.Arena.room` for the rooms of `light`."""


def light_fitness(values: Values) -> Floats:
    """Return the fitness of `light`: the share of the way that was made, more if it ends at the lamp; 0 of standing."""
    scores = values["light_approach"] * (1 + values["near_light_share"])
    return reduced_by_contacts(cautious_mean(scores), values, LIGHT_CONTACT_COST)


@ready
def light() -> Task:
    """The task to find the lamp, go to it and stay there.

    In the exam the robot starts at least 1 m from the lamp, in the shadow of walls; half of the starts are in a random
    room.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.light()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['light_approach', 'near_light_share', 'light_mm', 'contacts', 'path_mm'], 78)
    """
    default = controllers.mlp(hidden=(4,), senses=("proximity", "ambient"), speed_limit=LIGHT_SPEED_LIMIT)
    return Task(
        "light",
        dark_rooms(LIGHT_ROOMS, LIGHT_STARTS, FROM_LIGHT_MM, **LIGHT_SIZES),
        default,
        (
            measures.light_approach,
            measures.near_light_share(AT_LAMP_MM),
            measures.light_mm,
            measures.contacts,
            measures.path_mm,
        ),
        fitness=light_fitness,
        seconds=60.0,
        worlds=6,
        starts="arena",
        axes=(Axis("light_mm", 0, 600), Axis("path_mm", 0, 4000)),
        # Fitness rises late: first candidates must learn to search, then to stay.
        generations=70,
        exam=Exam(
            # In the first random room of exams, too few places are dark and far from the lamp.
            (*training("lit_unseen"), *dark_rooms(1, 10, 1000.0, EXAM_ROOM_SEED + 1, **LIGHT_SIZES)),
            (measures.light_stay_s(AT_LAMP_MM),),
            f"light_stay_s >= {STAY_S}",
            "reached the lamp from the shadow, 1 m away, and stayed",
            starts="arena",
        ),
    )


# ---- gather ----

CAMERA_BAUD = 38400
"""Speed of the lines [bit/s]: at 9600 a loop with a picture of the camera would take longer than 0.1 s."""

GATHER_SPEED_LIMIT = 15.0
"""Highest speed of `gather` [pulses/10 ms]: 120 mm/s. Contacts do no harm here, and a faster robot meets more."""

GATHERED = 4
"""How many of the five cylinders must be together to pass the exam of `gather`."""

GROUP_MM = 150.0
"""Distance from one of them within which cylinders are together [mm]; at the start they are at least 170 mm apart."""

CLOSENESS_WEIGHT = 5.0
"""Cylinders in a group that a `closeness` of 1 is worth."""


def gather_fitness(values: Values) -> Floats:
    """Return the fitness of `gather`: cylinders in the largest group, and how close they all are, wherever it is."""
    return cautious_mean(values["largest_group"] + CLOSENESS_WEIGHT * values["closeness"])


@ready
def gather() -> Task:
    """The task to push cylinders together, wherever that is.

    The robot has the camera K213, which sees where other cylinders are; proximity ends 35 mm away. The cylinders are
    white and the walls dark grey: so the camera tells them apart, and proximity sensors notice walls on touch only.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.gather()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['largest_group', 'closeness', 'contacts', 'path_mm'], 54)
    """
    senses = ("proximity", "camera")
    default = controllers.mlp(hidden=(), senses=senses, feedback=True, speed_limit=GATHER_SPEED_LIMIT)
    return Task(
        "gather",
        training(*(f"cylinders_{k}" for k in range(8))),
        default,
        (measures.largest_group(GROUP_MM), measures.closeness, measures.contacts, measures.path_mm),
        fitness=gather_fitness,
        seconds=120.0,
        worlds=8,
        timing=Timing(baud=CAMERA_BAUD),
        axes=(Axis("closeness", 0, 1), Axis("path_mm", 0, 15_000)),
        # Larger parameters saturate the wheels by the camera's sixteen greys alone.
        spread=1.0,
        # Some strategies find no robot that brings cylinders together.
        algorithm="cma:starts=3,race=8",
        generations=80,
        exam=Exam(
            training(*(f"cylinders_{k}" for k in range(100, 104))),
            (measures.largest_group(GROUP_MM),),
            f"largest_group >= {GATHERED}",
            "brought four of five cylinders together",
        ),
    )


# ---- disperse ----

SWARM_ROBOTS = 20
"""Robots of `disperse`."""

DISPERSE_SPEED_LIMIT = 8.0
"""Highest speed of `disperse` [pulses/10 ms]: 64 mm/s."""

SPREAD_SHARE = 0.85
"""Share of the mean distance of random neighbours that a swarm must reach in the exam of `disperse`.

Among n random places in an area A, the nearest neighbour is sqrt(A / n) / 2 away on average (Clark and Evans 1954,
equation 1).
"""

DISPERSE_CONTACT_COST = 0.1
"""Fitness of a robot is divided by 1 plus this times its contacts."""

EXAM_SIDE_MM = 1500
"""Side of the rooms of that exam [mm]."""

HEAP_PITCH_MM = 75.0
"""Distance between neighbours in a heap of robots [mm]: they see each other."""


@cache
def heap(side_mm: int, x_mm: float, y_mm: float, number: int) -> Arena:
    """Return a square room where twenty robots start in a heap around a place, each with another heading."""
    rng = np.random.default_rng(number)
    columns, rows = (each.ravel() for each in np.meshgrid(np.arange(5) - 2.0, np.arange(4) - 1.5))
    starts = tuple(
        Pose(x_mm + HEAP_PITCH_MM * column, y_mm + HEAP_PITCH_MM * row, float(rng.uniform(-np.pi, np.pi)))
        for column, row in zip(columns.tolist(), rows.tolist(), strict=True)
    )
    return replace(Arena.box(side_mm, side_mm), name=f"heap {number}", starts=starts)


def disperse_fitness(values: Values) -> Floats:
    """Return the fitness of `disperse`: the mean distance of neighbours at the end [m], reduced by contacts."""
    return cautious_mean(values["neighbour_mm"] / (1 + DISPERSE_CONTACT_COST * values["contacts"])) / 1000


@ready
def disperse() -> Task:
    """The task to spread out from a heap: twenty robots with one controller.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.disperse()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['neighbour_mm', 'contacts', 'path_mm'], 22)
    """
    return Task(
        "disperse",
        (heap(1400, 700, 700, 1), heap(1600, 400, 500, 2)),
        controllers.mlp(hidden=(), feedback=True, speed_limit=DISPERSE_SPEED_LIMIT),
        (measures.neighbour_mm, measures.contacts, measures.path_mm),
        fitness=disperse_fitness,
        seconds=60.0,
        worlds=2,
        axes=(Axis("neighbour_mm", 0, 400), Axis("path_mm", 0, 4000)),
        robots=SWARM_ROBOTS,
        starts="arena",
        spread=1.0,
        generations=30,
        exam=Exam(
            (heap(EXAM_SIDE_MM, 1000, 400, 3), heap(EXAM_SIDE_MM, 300, 750, 4)),
            (measures.neighbour_mm,),
            f"neighbour_mm >= {SPREAD_SHARE * EXAM_SIDE_MM / math.sqrt(SWARM_ROBOTS) / 2}",
            "spread out nearly as far as random places",
            starts="arena",
        ),
    )


# ---- maze ----

MAZE_SIDE_MM = 27.5 / 0.015
"""Inner side of the arena `kheperax` [mm]: there a Khepera is as large as the robot of Kheperax in its maze."""

MAZE_GOAL_MM = 0.15 * MAZE_SIDE_MM + 10.0, 0.9 * MAZE_SIDE_MM + 10.0
"""x and y of the goal [mm]; the outer wall is 10 mm thick."""

GOAL_RADIUS_MM = 100.0
"""Distance from the goal at which it counts as reached [mm]."""

MAZE_SPEED_LIMIT = 20.0
"""Highest speed in the maze [pulses/10 ms]: 160 mm/s. The shortest way to the goal is 4 m long."""

GOAL_COUNTS, THRIFT_COUNTS = 2.0, 0.1
"""Fitness for the goal, and the most that thrift adds: less than a goal that is missed once in eight trials costs."""

FAR_MM = 2000.0
"""Distance from the goal at which fitness is zero [mm]."""

HALF_THRIFT_PULSES = 1e5
"""Turns of both wheels that halve what thrift adds [pulses]: 4 m straight on."""


def maze_fitness(values: Values) -> Floats:
    """Return the fitness of `maze`: more than 2 for the goal, by thrift, else nearness, from 0 to 1."""
    thrift = THRIFT_COUNTS / (1 + values["turned_pulses"] / HALF_THRIFT_PULSES)
    nearness = np.maximum(1 - values["closest_mm"] / FAR_MM, 0.0)
    return cautious_mean(np.where(values["closest_mm"] <= GOAL_RADIUS_MM, GOAL_COUNTS + thrift, nearness))


@ready
def maze() -> Task:
    """The task to reach the goal of Kheperax's maze.

    The direct path is a dead end: the way leads away from the goal first. So an algorithm that follows fitness ends
    behind the first wall, and the default is MAP-Elites, which looks for ways to all places.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.maze()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['closest_mm', 'final_x_mm', 'final_y_mm', 'turned_pulses'], 90)
    """
    goal_mm = measures.closest_mm(*MAZE_GOAL_MM)
    return Task(
        "maze",
        training("kheperax"),
        controllers.mlp(hidden=(8,), speed_limit=MAZE_SPEED_LIMIT),
        (goal_mm, measures.final_x_mm, measures.final_y_mm, measures.turned_pulses),
        fitness=maze_fitness,
        # As long as a start of the exam: robots that find the way in a shorter trial often reach the goal too late.
        seconds=180.0,
        axes=(Axis("final_x_mm", 0, MAZE_SIDE_MM, 32), Axis("final_y_mm", 0, MAZE_SIDE_MM, 32)),
        starts="arena",
        # Larger parameters saturate the wheels: then the robot turns on the spot or shuttles.
        spread=1.0,
        algorithm="map-elites",
        population=200,
        exam=Exam(
            training("kheperax"), (goal_mm,), f"closest_mm <= {GOAL_RADIUS_MM}", "reached the goal", starts="arena"
        ),
    )


# ---- pursuit ----

PURSUIT_MM = 470
"""Side of the arena of `pursuit` [mm] (Floreano and Nolfi 1997)."""

PREDATOR_SPEED, PREY_SPEED = 10.0, 20.0
"""Highest speeds [pulses/10 ms], 80 and 160 mm/s: the prey is twice as fast (Floreano and Nolfi 1997)."""

PLAYER_SPEED = 20.0
"""Highest speed of a football player [pulses/10 ms], 160 mm/s."""

CAUGHT_MM = 57.0
"""Distance of the middles at which the prey is caught [mm]: two Kheperas of 55 mm, and 2 mm between them."""

PURSUIT_APART_MM = 100.0
"""Least gap between predator and prey at the start [mm], beyond the range of the proximity sensors."""


def predator_fitness(values: Values) -> Floats:
    """Return the share of the time that is left after the prey was caught."""
    return 1.0 - prey_fitness(values)


def prey_fitness(values: Values) -> Floats:
    """Return the share of the time for which the prey was not caught."""
    escaped: Floats = values["escaped_share"].mean(axis=1)
    return escaped


@ready
def pursuit() -> Task:
    """The task to catch, or to escape: a predator and a prey that is twice as fast (Floreano and Nolfi 1997).

    Both have proximity sensors, the predator has the camera K213, too. The prey's fitness is the share of the time for
    which it was not caught, the predator's is the rest. What the robots do after the first contact does not count.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.pursuit()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['escaped_share', 'path_mm', 'contacts'], 76)
    """
    predator = controllers.mlp(hidden=(), senses=("proximity", "camera"), feedback=True, speed_limit=PREDATOR_SPEED)
    prey = controllers.mlp(hidden=(), feedback=True, speed_limit=PREY_SPEED)
    return Task(
        "pursuit",
        (Arena.box(PURSUIT_MM, PURSUIT_MM),),
        predator,
        (measures.escaped_share(radius_mm=CAUGHT_MM), measures.path_mm, measures.contacts),
        fitness=predator_fitness,
        side="predator",
        against=Side("prey", prey, prey_fitness),
        seconds=25.0,
        apart_mm=PURSUIT_APART_MM,
        timing=Timing(baud=CAMERA_BAUD),
        algorithm="ga",
        generations=100,
        population=100,
    )


# ---- football ----


def football_fitness(values: Values) -> Floats:
    """Return the mean of goals and of the ball's place, from -1 to 1; 0 if no robot touches the ball."""
    scores: Floats = (values["goals"] + values["ball_ahead"]).mean(axis=1) / 2.0
    return scores


@ready
def football() -> Task:
    """The task to play football, one against one.

    The pitch is that of `kiks demo soccer`. Both have proximity sensors and the camera K213. Half of the fitness are
    goals, 1 for one of its own and -1 for one of the other side; half is the mean place of the ball, from 1 at the goal
    line of the other side to -1 at its own. What one side gains, the other loses. A game ends with the first goal.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.football()
        >>> [measure.name for measure in task.measures], task.parameter_count
        (['goals', 'ball_ahead', 'path_mm'], 108)
    """
    player = controllers.mlp(hidden=(), senses=("proximity", "camera"), feedback=True, speed_limit=PLAYER_SPEED)
    arenas = game.kick_offs()
    return Task(
        "football",
        arenas,
        player,
        (game.goals, game.ball_ahead, measures.path_mm),
        fitness=football_fitness,
        side="left",
        against=Side("right", player, football_fitness),
        seconds=15.0,
        worlds=len(arenas),
        timing=Timing(baud=CAMERA_BAUD),
        starts="arena",
        algorithm="ga",
        generations=100,
        population=50,
    )
