"""The tasks that come with KiKS."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control import controllers, measures
from kiks.control.controller import Controller
from kiks.learn import training_arenas
from kiks.learn.exam import Exam
from kiks.learn.task import Axis, Task, cautious_mean
from kiks.model.arena import Arena, Cylinder

Floats = NDArray[np.float64]
Values = Mapping[str, Floats]

SPEED_LIMIT = 8.0
"""Highest speed of the ready-made tasks [pulses/10 ms]: 64 mm/s."""

EXAM_S = 180.0
"""Time of the exam of `maze` [s]."""

LEAST_ROAMING = 0.2
"""Mean `roaming` from which on a robot gets around: 16 mm/s away from where it was two seconds ago."""

CONTACT_COST = 3.0
"""Fitness is divided by 1 plus this times the mean number of contacts per world."""

CONTACTS_COUNTED = 3.0
"""Largest number of contacts of a world that counts: a stuck robot has hundreds."""


def without_contacts(fitness: Floats, values: Values, cost: float = CONTACT_COST) -> Floats:
    """Return fitness reduced by contacts, but not below zero: driving with contacts beats standing still."""
    contacts = np.minimum(values["contacts"], CONTACTS_COUNTED).mean(axis=1)
    reduced: Floats = fitness / (1 + cost * contacts)
    return reduced


# ---- avoid ----


def avoid_fitness(values: Values) -> Floats:
    """Return the fitness of `avoid`: that of Floreano and Mondada (1994) times `roaming`."""
    return without_contacts(cautious_mean(values["avoidance"] * values["roaming"]), values)


def avoid(controller: Controller | None = None, **changes: Any) -> Task:
    """Return the task to drive fast and straight, explore, and touch nothing (Floreano and Mondada 1994).

    Args:
        controller: The controller to evolve; a linear one if left out.
        changes: Other arguments of `Task`.
    """
    task = Task(
        "avoid",
        (training_arenas.pillars(), training_arenas.corridors(), training_arenas.wedges()),
        controllers.linear(speed_limit=SPEED_LIMIT) if controller is None else controller,
        (measures.avoidance, measures.roaming, measures.contacts, measures.path_mm, measures.straightness),
        fitness=avoid_fitness,
        seconds=20.0,
        worlds=12,
        axes=(Axis("path_mm", 0, 1500), Axis("straightness", 0, 1)),
        exam=Exam(
            (training_arenas.unseen(), training_arenas.rooms()),
            (measures.contacts, measures.roaming),
            avoid_solved,
            "got around for three minutes and touched nothing",
        ),
        about="drive fast and straight, explore, touch nothing",
    )
    return replace(task, **changes)


def avoid_solved(values: Values) -> NDArray[np.bool_]:
    """Return whether the robot touched nothing and did not stay where it was."""
    solved: NDArray[np.bool_] = (values["contacts"] == 0) & (values["roaming"] > LEAST_ROAMING)
    return solved


# ---- follow ----

FOLLOW_SHARE, FOLLOW_CONTACTS = 0.8, 2.0
"""Exam of `follow`: smallest share of time beside a wall, and largest number of contacts."""


def follow_fitness(values: Values) -> Floats:
    """Return the fitness of `follow`: `wall_following`, halved by the first contact in a world."""
    return cautious_mean(values["wall_following"] / (1 + values["contacts"]))


def follow_solved(values: Values) -> NDArray[np.bool_]:
    """Return whether the robot had a wall at its side, got along, and touched something twice at most."""
    solved: NDArray[np.bool_] = (
        (values["beside_wall_share"] >= FOLLOW_SHARE)
        & (values["roaming"] >= LEAST_ROAMING)
        & (values["contacts"] <= FOLLOW_CONTACTS)
    )
    return solved


def follow(controller: Controller | None = None, *, side: str = "left", **changes: Any) -> Task:
    """Return the task to follow walls.

    Args:
        controller: The controller to evolve; a perceptron with feedback if left out, which remembers that it has lost a
            wall.
        side: The side of the robot on which the wall is: 'left' or 'right'.
        changes: Other arguments of `Task`.

    Raises:
        ParameterError: If the side is neither 'left' nor 'right'.
    """
    task = Task(
        "follow",
        (training_arenas.wall_ends(), training_arenas.alcoves(), training_arenas.corridors()),
        controllers.mlp(hidden=(), feedback=True, speed_limit=SPEED_LIMIT) if controller is None else controller,
        (measures.wall_following(side), measures.beside_wall_share(side), measures.contacts, measures.path_mm),
        fitness=follow_fitness,
        seconds=40.0,
        worlds=12,
        axes=(Axis("path_mm", 0, 3000), Axis("wall_following", 0, 1)),
        # Larger parameters saturate the wheels: then a robot without a wall drives straight on or spins. The arc that
        # leads round the end of a wall needs small ones.
        spread=1.0,
        generations=140,
        exam=Exam(
            (training_arenas.unseen(), training_arenas.unseen_rooms()),
            (measures.beside_wall_share(side), measures.roaming, measures.contacts),
            follow_solved,
            "followed the wall for 80 % of three minutes",
        ),
        about=f"drive along walls, on the robot's {side}",
    )
    # The sides are two tasks: a folder of the one must not be continued as the other.
    return replace(task, **({"name": "follow-right"} if side == "right" else {}) | changes)


# ---- light ----


LIGHT_SPEED_LIMIT = 10.0
"""Highest speed on the way to a lamp [pulses/10 ms]: 80 mm/s. A robot in the dark has to search."""

LIGHT_CONTACT_COST = 0.5
"""As `CONTACT_COST`, but less: a robot that stands still in the dark touches nothing, and finds no lamp."""

AT_LAMP_MM = 100.0
"""Distance of the robot's middle from the lamp at which it is there [mm]."""

STAY_S = 30.0
"""Time at the end of the exam for which it must be there without a break [s]."""


def light_fitness(values: Values) -> Floats:
    """Return the fitness of `light`: the share of the way that was made, more if it ends at the lamp; 0 of standing."""
    scores = values["light_approach"] * (1 + values["near_light_share"])
    return without_contacts(cautious_mean(scores), values, LIGHT_CONTACT_COST)


def light_solved(values: Values) -> NDArray[np.bool_]:
    """Return whether the robot reached the lamp and stayed there."""
    solved: NDArray[np.bool_] = values["light_stay_s"] >= STAY_S
    return solved


def light(controller: Controller | None = None, **changes: Any) -> Task:
    """Return the task to find the lamp, go to it and stay there.

    In the exam the robot starts at least 1 m from the lamp, in the shadow of walls.

    Args:
        controller: The controller to evolve; a network of both senses with four hidden units if left out.
        changes: Other arguments of `Task`.
    """
    default = controllers.mlp(hidden=(4,), senses=("proximity", "ambient"), speed_limit=LIGHT_SPEED_LIMIT)
    task = Task(
        "light",
        (training_arenas.lit_pillars(), training_arenas.lit_walls(), training_arenas.lit_rooms()),
        default if controller is None else controller,
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
        axes=(Axis("light_mm", 0, 600), Axis("path_mm", 0, 4000)),
        exam=Exam(
            (training_arenas.lit_unseen(),),
            (measures.light_stay_s(AT_LAMP_MM),),
            light_solved,
            "reached the lamp from the shadow, 1 m away, and stayed",
            starts="arena",
        ),
        about="find the lamp, go to it and stay there",
    )
    return replace(task, **changes)


# ---- gather ----

GATHERED = 4
"""Cylinders in the middle that are enough to pass the exam, of six."""


def gather_fitness(values: Values) -> Floats:
    """Return the fitness of `gather`."""
    return cautious_mean(values["gathered"] - values["spread_mm"] / 1000)


def gather(controller: Controller | None = None, **changes: Any) -> Task:
    """Return the task to push cylinders to the middle of a room.

    Args:
        controller: The controller to evolve; gated recurrent units, which have a memory, if left out.
        changes: Other arguments of `Task`.
    """
    task = Task(
        "gather",
        tuple(_with_cylinders(number) for number in range(3)),
        controllers.gru(units=4, speed_limit=SPEED_LIMIT) if controller is None else controller,
        (measures.gathered(300, 300, radius_mm=150), measures.spread_mm, measures.contacts, measures.path_mm),
        fitness=gather_fitness,
        seconds=90.0,
        worlds=12,
        axes=(Axis("spread_mm", 0, 300), Axis("path_mm", 0, 6000)),
        exam=Exam(
            tuple(_with_cylinders(number) for number in (3, 4)),
            (measures.gathered(300, 300, radius_mm=150),),
            gather_solved,
            "brought four of six cylinders to the middle",
        ),
        about="push six cylinders to the middle",
    )
    return replace(task, **changes)


def gather_solved(values: Values) -> NDArray[np.bool_]:
    """Return whether most cylinders were brought to the middle."""
    return values["gathered"] >= GATHERED


def _with_cylinders(number: int) -> Arena:
    """Return an arena with six cylinders around its middle, placed differently for each number."""
    angles = np.arange(6) * np.pi / 3 + number * 0.4
    away_mm = 170.0 + 15.0 * ((np.arange(6) + number) % 3)
    places = zip(300 + away_mm * np.cos(angles), 300 + away_mm * np.sin(angles), strict=True)
    return replace(
        Arena.box(600, 600),
        name=f"cylinders {number + 1}",
        cylinders=tuple(Cylinder(float(x), float(y)) for x, y in places),
    )


# ---- disperse ----

SWARM_ROBOTS = 20
"""Robots of `disperse`."""

SPREAD_SHARE = 0.85
"""Share of the mean distance of random neighbours that a swarm must reach in the exam of `disperse`."""

DISPERSE_CONTACT_COST = 0.1
"""Fitness of a robot is divided by 1 plus this times its contacts."""

EXAM_SIDE_MM = 1500.0
"""Side of the rooms of that exam [mm]."""


def disperse_fitness(values: Values) -> Floats:
    """Return the fitness of `disperse`: the mean distance of neighbours at the end [m], reduced by contacts."""
    return cautious_mean(values["neighbour_mm"] / (1 + DISPERSE_CONTACT_COST * values["contacts"])) / 1000


def disperse_solved(values: Values) -> NDArray[np.bool_]:
    """Return whether the robots are as far from each other as robots at random places, nearly.

    Among n random places in an area A, the nearest neighbour is sqrt(A / n) / 2 away on average (Clark and Evans 1954,
    equation 1).
    """
    return values["neighbour_mm"] >= SPREAD_SHARE * EXAM_SIDE_MM / math.sqrt(SWARM_ROBOTS) / 2


def disperse(controller: Controller | None = None, **changes: Any) -> Task:
    """Return the task of twenty robots, all with one controller, to spread out from a heap.

    Args:
        controller: The controller to evolve; a perceptron with feedback if left out.
        changes: Other arguments of `Task`.
    """
    task = Task(
        "disperse",
        (training_arenas.heap(1400, 700, 700, 1), training_arenas.heap(1600, 400, 500, 2)),
        controllers.mlp(hidden=(), feedback=True, speed_limit=SPEED_LIMIT) if controller is None else controller,
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
            (
                training_arenas.heap(EXAM_SIDE_MM, 1000, 400, 3),
                training_arenas.heap(EXAM_SIDE_MM, 300, 750, 4),
            ),
            (measures.neighbour_mm,),
            disperse_solved,
            "spread out nearly as far as random places",
            starts="arena",
        ),
        about="twenty robots spread out from a heap",
    )
    return replace(task, **changes)


# ---- maze ----

GOAL_RADIUS_MM = 100.0
"""Distance from the goal at which it counts as reached [mm]."""


def maze_fitness(values: Values) -> Floats:
    """Return the fitness of `maze`: minus the distance to the goal, in metres."""
    return -cautious_mean(values["goal_mm"]) / 1000


def maze(controller: Controller | None = None, **changes: Any) -> Task:
    """Return the task to end near the goal of Kheperax's maze; the direct path is a dead end.

    Args:
        controller: The controller to evolve; a network with eight hidden units if left out.
        changes: Other arguments of `Task`.
    """
    task = Task(
        "maze",
        (training_arenas.kheperax(),),
        controllers.mlp(hidden=(8,), speed_limit=SPEED_LIMIT) if controller is None else controller,
        (
            measures.goal_mm(*training_arenas.goal_mm()),
            measures.final_x_mm,
            measures.final_y_mm,
            measures.turned_pulses,
        ),
        fitness=maze_fitness,
        seconds=100.0,
        worlds=2,
        axes=(Axis("final_x_mm", 0, training_arenas.SIDE_MM, 32), Axis("final_y_mm", 0, training_arenas.SIDE_MM, 32)),
        starts="arena",
        exam=Exam(
            (training_arenas.kheperax(),),
            (measures.reached_s(*training_arenas.goal_mm(), radius_mm=GOAL_RADIUS_MM),),
            maze_solved,
            "reached the goal",
            seconds=EXAM_S,
            starts="arena",
        ),
        about="end near the goal of the Kheperax maze",
    )
    return replace(task, **changes)


def maze_solved(values: Values) -> NDArray[np.bool_]:
    """Return whether the robot reached the goal before the end."""
    return values["reached_s"] < EXAM_S - 1.0


def maze_qd_fitness(values: Values) -> Floats:
    """Return the fitness of `maze-qd`: minus the turns of the wheels, in thousands of pulses."""
    fitness: Floats = -values["turned_pulses"].mean(axis=1) / 1000
    return fitness


def maze_qd(controller: Controller | None = None, **changes: Any) -> Task:
    """Return the task to find short paths to every place in Kheperax's maze.

    Args:
        controller: The controller to evolve; a network with eight hidden units if left out.
        changes: Other arguments of `Task`.
    """
    given = {"name": "maze-qd", "fitness": maze_qd_fitness, "worlds": 1}
    return maze(controller, **given | {"about": "reach every place in the Kheperax maze by short paths"} | changes)


# ---- tasks by name ----

TASKS: dict[str, Callable[..., Task]] = {
    "avoid": avoid,
    "follow": follow,
    "light": light,
    "gather": gather,
    "disperse": disperse,
    "maze": maze,
    "maze-qd": maze_qd,
}
"""The tasks that come with KiKS."""
