"""Ready tasks of classic papers; the page "Classics of evolutionary robotics" says what of each is known.

`examples/classics` has a script for each paper, which makes its figure.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.batch.loop_timing import Timing
from kiks.control import controllers, measures
from kiks.control.controller import controller
from kiks.control.measure import measure
from kiks.control.measures import (
    FULL_COUNT,
    clear_share,
    distance_mm,
    mean,
    roaming_share,
    share_of_full,
    straight_share,
    wheels_share,
)
from kiks.control.neural_nets import do_layer, layer_size, logistic
from kiks.control.senses import Sense
from kiks.engine.compiling import kernel
from kiks.engine.numbers import sin_cos, tanh
from kiks.engine.simd.stack_arrays import stack_floats
from kiks.learn.exam import Exam
from kiks.learn.ready_tasks import (
    CAMERA_BAUD,
    CAUGHT_MM,
    PREDATOR_SPEED,
    PREY_SPEED,
    PURSUIT_APART_MM,
    PURSUIT_MM,
    Floats,
    Values,
    ready,
)
from kiks.learn.sampled import NOISES, sampled_proximity
from kiks.learn.task import Side, Task
from kiks.model.arena import Arena, Cylinder
from kiks.model.data_file import Number, OneOf, Rule, Switch, Text
from kiks.model.robot import RobotSpec, specs_of
from kiks.model.shipped import shipped_arena
from kiks.model.walls import Wall


def mean_of_first(values: Values) -> Floats:
    """Return the mean of the first measure over all worlds: the fitness of most papers."""
    fitness: Floats = next(iter(values.values())).mean(axis=1)
    return fitness


# ---- Floreano and Mondada 1994 ----

HALF_UNIT_SPREAD = 0.5 / math.sqrt(3.0)
"""Standard deviation of genes that are spread evenly over +-0.5."""


@measure(notes=2, result=mean, senses=("proximity",))
def navigation(moment: Any, notes: Any) -> None:
    """Mean of V (1 - sqrt(dv)) (1 - i): fast, straight, and far from everything, whichever side leads.

    V is the mean of both wheels' speeds without their signs, dv half of how much they differ with their signs, i the
    highest proximity: each from 0 to 1. The measure `avoidance` differs: there driving back earns nothing.
    """
    notes[0] += wheels_share(moment) * (straight_share(moment) * clear_share(moment))
    notes[1] += 1.0


@measure(notes=4, result=mean, senses=("proximity",))
def navigation_gained(moment: Any, notes: Any) -> None:
    """The same with another V: the speed at which it gets away from where it was two seconds ago, as in `roaming`."""
    add_gained(moment, notes)


@kernel
def add_gained(moment: Any, notes: Any) -> Any:
    """Add one step of `navigation_gained`."""
    notes[0] += roaming_share(moment, notes) * (straight_share(moment) * clear_share(moment))
    notes[1] += 1.0


@ready
def floreano_mondada_1994(shuttling: Switch = False) -> Task:
    """The task to navigate in a looping corridor (Floreano and Mondada 1994).

    Args:
        shuttling: Whether V counts the speeds of the wheels without their signs, as the paper has it. A robot that
            shuttles on the spot then earns the most. Left out, V is how fast it gets away from where it was two seconds
            ago.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.floreano_mondada_1994()
        >>> task.parameter_count, task.timings[0].period_s, task.seconds
        (22, 0.3, 24.0)
    """
    counted = navigation if shuttling else navigation_gained
    return Task(
        "floreano_mondada_1994" + ("_shuttling" if shuttling else ""),
        (shipped_arena("classics/floreano_mondada_1994"),),
        controllers.mlp(hidden=(), feedback=True),
        (counted, measures.speed_pulses, measures.roaming, measures.contacts, measures.path_mm),
        fitness=mean_of_first,
        seconds=24.0,
        timing=Timing(period_s=0.3),
        spread=HALF_UNIT_SPREAD,
        algorithm="sga:bits=0,selection=roulette,crossover=0.1,mutation=0.2",
        generations=100,
        population=80,
    )


# ---- Jakobi, Husbands and Harvey 1995 ----


def progress_straight(notes: NDArray[np.float64]) -> Floats:
    """Return V (1 - sqrt(D)) of the notes of `exploration`."""
    steps = np.maximum(notes[..., 1], 1.0)
    straight: Floats = notes[..., 0] / steps * (1.0 - np.sqrt(np.abs(notes[..., 4]) / steps))
    return straight


@measure(notes=5, result=progress_straight)
def exploration(moment: Any, notes: Any) -> None:
    """V (1 - sqrt(D)): how fast it gets about, and does not turn to one side.

    V is how fast it gets away from where it was two seconds ago, as in `roaming`; D half of how much the speeds of the
    wheels differ, with its sign, on average over the trial.
    """
    notes[0] += roaming_share(moment, notes)
    notes[1] += 1.0
    notes[4] += 0.5 * (share_of_full(moment.wheels[0]) - share_of_full(moment.wheels[1]))


def with_noise(spec: RobotSpec, factor: float) -> RobotSpec:
    """Return a robot whose proximity sensors have so many times their noise, up to 99 %.

    Example:
        >>> with_noise(RobotSpec.load("khepera"), 2.0).proximity.noise_small
        0.5
    """
    noise = spec.proximity
    return spec.with_changes(
        proximity__noise_small=min(factor * noise.noise_small, 0.99),
        proximity__noise_large=min(factor * noise.noise_large, 0.99),
        proximity__jitter_counts=tuple(factor * each for each in noise.jitter_counts),
    )


@cache
def room_with_pillars() -> Arena:
    """Return the room of Jakobi, Husbands and Harvey (1995): 50 cm, four pillars; where they stand is our own."""
    places = ((150, 160), (360, 140), (140, 360), (370, 370))
    pillars = tuple(Wall(disc_mm=place, radius_mm=40) for place in places)
    return replace(Arena.box(520, 520), name="pillars of 1995", walls=pillars)


Noise = Annotated[Number, Field(ge=0, le=100)]
RobotKind = Annotated[Text | RobotSpec, Rule("the name of a robot, a robot file or a kiks.RobotSpec")]


@ready
def jakobi_husbands_harvey_1995(noise: Noise = 1.0, robot: RobotKind = "khepera") -> Task:
    """The task to avoid obstacles with sensors of more or less noise (Jakobi, Husbands and Harvey 1995).

    Args:
        noise: What the noise of the proximity sensors is multiplied by.
        robot: Kind of robot, whose noise is multiplied.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.jakobi_husbands_harvey_1995(noise=2.0)
        >>> task.worlds, task.robot.proximity.noise_large
        (2, 0.2)
    """
    (spec,) = specs_of(robot, 1, None)
    return Task(
        f"jakobi_husbands_harvey_1995_{noise:g}",
        (room_with_pillars(),),
        controllers.ctrnn(neurons=6),
        (exploration, measures.roaming, measures.contacts, measures.path_mm),
        fitness=mean_of_first,
        robot=with_noise(spec, noise),
        seconds=20.0,
        worlds=2,
        algorithm="ga",
        generations=16,
        population=64,
        spread=1.0,
    )


# ---- Nolfi 1996, 1997 ----

COLLECTED_COUNT = 5
"""Cylinders of the arena."""

SEEN_SHARE, HELD_SHARE = 0.1, 0.4
"""What facing a cylinder, and holding one, count beside one that is outside (our own guess)."""

FACED_STEPS, FACED_MM, ASIDE_MM = 20.0, (27.5, 65.0), 15.0
"""Steps before a cylinder that count fully, and where it then is: ahead from, to, and aside at most [mm]."""


@measure(notes=4)
def collecting(moment: Any, notes: Any) -> None:
    """Cylinders outside; and since the last one, whether another was held, and for how long one was between the jaws.

    A cylinder that is picked up and put down again counts as held once.
    """
    out = measures.count_out(moment.bodies)
    if out > notes[1]:
        notes[1], notes[2], notes[3] = out, 0.0, 0.0
    sine, cosine = sin_cos(moment.heading_rad)
    for row in range(moment.bodies.shape[0]):
        body = moment.bodies[row]
        if body.holder == moment.robot + 1:
            notes[2] = 1.0
        elif body.is_lifted == 0:
            dx, dy = body.x_mm - moment.x_mm, body.y_mm - moment.y_mm
            ahead, aside = dx * cosine + dy * sine, abs(dy * cosine - dx * sine)
            if FACED_MM[0] < ahead < FACED_MM[1] and aside < ASIDE_MM:
                notes[3] = min(notes[3] + 1.0 / FACED_STEPS, 1.0)
    notes[0] = max(notes[0], out + HELD_SHARE * notes[2] + SEEN_SHARE * max(notes[2], notes[3]))


@measure(notes=2)
def picked_up(moment: Any, notes: Any) -> None:
    """Number of times that the robot has gripped a cylinder."""
    is_held = 0.0
    for row in range(moment.bodies.shape[0]):
        is_held = max(is_held, 1.0 * (moment.bodies[row].holder == moment.robot + 1))
    notes[0] += max(is_held - notes[1], 0.0)
    notes[1] = is_held


def all_out(values: Values) -> NDArray[np.bool_]:
    """Return in which starts all cylinders are outside."""
    solved: NDArray[np.bool_] = values["taken_out"] >= COLLECTED_COUNT
    return solved


def collecting_arenas(count: int, *, seed: int) -> tuple[Arena, ...]:
    """Return arenas of 60 x 35 cm with five cylinders at random places, clear of each other and of the walls."""
    rng, arenas = np.random.default_rng(seed), list[Arena]()
    for number in range(count):
        places: list[tuple[float, float]] = []
        while len(places) < COLLECTED_COUNT:
            x_mm, y_mm = rng.uniform((62.0, 62.0), (542.0, 292.0)).tolist()
            if all(math.hypot(x_mm - x, y_mm - y) > 75.0 for x, y in places):
                places.append((x_mm, y_mm))
        cylinders = tuple(Cylinder(x, y, radius_mm=11.5) for x, y in places)
        arenas.append(replace(Arena.box(604, 354, wall_mm=2), name=f"collecting {number + 1}", cylinders=cylinders))
    return tuple(arenas)


@ready
def nolfi_1997(architecture: str = "emergent") -> Task:
    """The task to carry five cylinders out of an arena with the gripper (Nolfi 1996, 1997).

    A robot that opens its jaws while the cylinder is beyond the edge of the arena has dropped it outside.

    Args:
        architecture: Of `kiks.controllers.collector`: 'feed_forward', 'hidden', 'elman', 'designed' or 'emergent'.

    Example:
        >>> import kiks
        >>> kiks.tasks.nolfi_1997().parameter_count
        128
    """
    return Task(
        f"nolfi_1997_{architecture}",
        collecting_arenas(60, seed=1),
        controllers.collector(architecture=architecture),
        (collecting, measures.taken_out, picked_up, measures.contacts),
        fitness=mean_of_first,
        seconds=20.0,
        worlds=4,
        timing=Timing(period_s=0.1, baud=38_400),
        generations=60,
        population=32,
        exam=Exam(
            collecting_arenas(10, seed=2), (measures.taken_out,), all_out, "carried all cylinders out", seconds=120.0
        ),
    )


# ---- Floreano and Nolfi 1997 ----

RACE_S, RACE_STEPS = 50.0, 500
"""A trial lasts for 500 cycles of 100 ms, or until predator and prey touch."""

WHITE, FALL, MIDDLE, DARK_SHARE = 225.0, 0.41, 7.875, 0.75
"""Grey of a white wall in the middle of the camera's picture; the share by which it is less at its border; the middle
of the sixteen greys; and the share of white below which a grey is dark. A Khepera's body has half of the wall's grey.
"""

VISION_UNITS, GREYS = 5, 16
"""Units of the predator's vision, of 7.2 degrees each, and greys that they divide among them."""

PREDATOR_INPUTS, PREY_INPUTS = 13, 8
"""Inputs of the networks."""


@kernel
def perceptron(inputs: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Set both wheels from inputs and the last outputs; weights without biases [input or output, wheel]."""
    count = inputs.shape[0]
    for wheel in range(2):
        total = 0.0
        for number in range(count):
            total += inputs[number] * parameters[2 * number + wheel]
        for number in range(2):
            total += memory[number] * parameters[2 * (count + number) + wheel]
        wheels[wheel] = logistic(total)
    for wheel in range(2):
        memory[wheel] = wheels[wheel]


@controller(parameters=30, memory=2, senses=("proximity", "camera"))
def predator(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Drive by proximity and by five units of vision, each 1 if something dark is in its sector; 80 mm/s at most."""
    inputs = stack_floats(PREDATOR_INPUTS)
    for number in range(8):
        inputs[number] = sensors[number] / FULL_COUNT
    for unit in range(VISION_UNITS):
        inputs[8 + unit] = 0.0
    for grey in range(GREYS):
        aside = (grey - MIDDLE) / MIDDLE
        if sensors[8 + grey] < DARK_SHARE * WHITE * (1.0 - FALL * aside * aside):
            inputs[8 + grey * VISION_UNITS // GREYS] = 1.0
    perceptron(inputs, memory, parameters, wheels)
    for wheel in range(2):
        wheels[wheel] = PREDATOR_SPEED * (2.0 * wheels[wheel] - 1.0)


@controller(parameters=20, memory=2)
def prey(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Drive by proximity, 160 mm/s at most."""
    inputs = stack_floats(PREY_INPUTS)
    for number in range(8):
        inputs[number] = sensors[number] / FULL_COUNT
    perceptron(inputs, memory, parameters, wheels)
    for wheel in range(2):
        wheels[wheel] = PREY_SPEED * (2.0 * wheels[wheel] - 1.0)


@measure
def caught(moment: Any, notes: Any) -> None:
    """1 from the contact of predator and prey on."""
    if is_caught(moment):
        notes[0] = 1.0


@measure
def lasted_steps(moment: Any, notes: Any) -> None:
    """Number of cycles before the contact."""
    if not is_caught(moment):
        notes[0] += 1.0


@kernel
def is_caught(moment: Any) -> Any:
    """Return whether another robot touches it."""
    for other in range(moment.poses.shape[0]):
        is_near = distance_mm(moment, moment.poses[other, 0], moment.poses[other, 1]) <= CAUGHT_MM
        if other != moment.robot and is_near:
            return True
    return False


def lasted(values: Values) -> Floats:
    """Return t / 500, the prey's fitness."""
    share: Floats = values["lasted_steps"].mean(axis=1) / RACE_STEPS
    return share


def caught_early(values: Values) -> Floats:
    """Return 1 - t / 500, the predator's fitness."""
    return 1.0 - lasted(values)


@ready
def floreano_nolfi_1997() -> Task:
    """The task to catch, or to escape, with networks of five bits a synapse (Floreano and Nolfi 1997).

    Networks, genes and selection are those of the papers: weights of five bits, without biases, the best fifth has five
    children each. Fitness counts shares of 500 cycles, also in trials of another length.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.floreano_nolfi_1997()
        >>> [side.parameter_count for side in task.sides], task.population, task.seconds
        ([30, 20], 100, 50.0)
    """
    return Task(
        "floreano_nolfi_1997",
        (Arena.box(PURSUIT_MM, PURSUIT_MM),),
        predator,
        (lasted_steps, measures.path_mm, measures.contacts),
        fitness=caught_early,
        side="predator",
        against=Side("prey", prey, lasted),
        seconds=RACE_S,
        until=caught,
        apart_mm=PURSUIT_APART_MM,
        timing=Timing(baud=CAMERA_BAUD),
        algorithm="sga",
        generations=100,
        population=100,
    )


# ---- Floreano and Mondada 1996 ----

FULL_ACTIONS, LIFE_ACTIONS, ACTION_S = 50.0, 150, 0.38
"""Actions for which a full battery lasts, most actions of a life, and the time of each [s]."""

HIDDEN, CONTEXT, USED = 5, 0, 5
"""Hidden units of the homing network; where its memory holds them, and what the battery has lost, a share of it."""

_INPUTS = 8 + 2 + 1 + 1
_FED = _INPUTS + HIDDEN
_WHEELS_FIRST = layer_size(_FED, HIDDEN)
_AMBIENT, FLOOR = 8, 16
_FRONT, _BACK = 2, 6  # of the two ambient light sensors that it uses
_BLACK = 512.0  # below this reading of the floor sensor it stands on the charging zone


@kernel
def charge_lost(lost: Any, floor: Any) -> Any:
    """Return the share of the battery that is lost after one more action: none on the charging zone."""
    return 0.0 if floor < _BLACK else min(lost + 1.0 / FULL_ACTIONS, 1.0)


@controller(senses=("proximity", "ambient", "floor"), memory=HIDDEN + 1, parameters=102)
def homing_network(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Drive by hidden units that feed back to themselves; one of their inputs is the battery, which is counted here.

    Inputs: eight of proximity, two of ambient light, the floor, the battery; then the last hidden units. Parameters:
    5 biases of hidden units, a matrix [17, 5], 2 biases of wheels, a matrix [5, 2].
    """
    memory[USED] = charge_lost(memory[USED], sensors[FLOOR])
    inputs, hidden, outputs = stack_floats(_FED), stack_floats(HIDDEN), stack_floats(2)
    for k in range(8):
        inputs[k] = sensors[k] / FULL_COUNT
    inputs[8] = (500.0 - sensors[_AMBIENT + _FRONT]) / 500.0
    inputs[9] = (500.0 - sensors[_AMBIENT + _BACK]) / 500.0
    inputs[10] = sensors[FLOOR] / FULL_COUNT
    inputs[11] = 1.0 - memory[USED]
    for k in range(HIDDEN):
        inputs[_INPUTS + k] = memory[CONTEXT + k]
    do_layer(inputs, _FED, parameters, 0, hidden, HIDDEN)
    for k in range(HIDDEN):
        memory[CONTEXT + k] = tanh(hidden[k])
    do_layer(memory, HIDDEN, parameters, _WHEELS_FIRST, outputs, 2)
    for wheel in range(2):
        wheels[wheel] = controllers.SPEED_LIMIT * tanh(outputs[wheel])


@measure(notes=2, senses=("proximity", "ambient", "floor"))
def battery_empty(moment: Any, notes: Any) -> None:
    """1 once the battery is empty, which ends a life."""
    notes[1] = charge_lost(notes[1], moment.sensors[FLOOR])
    if notes[1] >= 1.0 - 1e-9:
        notes[0] = 1.0


@kernel
def clear_off_zone(moment: Any) -> Any:
    """Return (1 - i) as a share of a life's actions; 0 on the charging zone."""
    return clear_share(moment) / LIFE_ACTIONS if moment.sensors[FLOOR] >= _BLACK else 0.0


@measure(senses=("proximity", "ambient", "floor"))
def homing(moment: Any, notes: Any) -> None:
    """Sum of V (1 - i) over a life, divided by its most actions; nothing is counted on the charging zone.

    V and i are those of `navigation`. Battery, lamp and zone are not in it: a robot that charges lives longer.
    """
    notes[0] += wheels_share(moment) * clear_off_zone(moment)


@measure(notes=4, senses=("proximity", "ambient", "floor"))
def homing_gained(moment: Any, notes: Any) -> None:
    """The same with the V of `navigation_gained`."""
    notes[0] += roaming_share(moment, notes) * clear_off_zone(moment)
    notes[1] += 1.0


@measure(notes=2, senses=("proximity", "ambient", "floor"))
def charges(moment: Any, notes: Any) -> None:
    """How often it has come to the charging zone."""
    is_there = moment.sensors[FLOOR] < _BLACK
    if is_there and notes[1] == 0.0:
        notes[0] += 1.0
    notes[1] = 1.0 if is_there else 0.0


@measure
def actions(moment: Any, notes: Any) -> None:
    """Number of actions."""
    notes[0] += 1.0


@ready
def floreano_mondada_1996(shuttling: Switch = False) -> Task:
    """The task to come back to a charging zone before a battery is empty (Floreano and Mondada 1996).

    Args:
        shuttling: Whether V counts the speeds of the wheels without their signs, as for `floreano_mondada_1994`.

    Example:
        >>> import kiks
        >>> task = kiks.tasks.floreano_mondada_1996()
        >>> task.parameter_count, task.timings[0].period_s, task.seconds
        (102, 0.38, 57.0)
    """
    return Task(
        "floreano_mondada_1996" + ("_shuttling" if shuttling else ""),
        (shipped_arena("classics/floreano_mondada_1996"),),
        homing_network,
        (homing if shuttling else homing_gained, actions, charges, measures.path_mm, measures.contacts),
        fitness=mean_of_first,
        seconds=LIFE_ACTIONS * ACTION_S,
        timing=Timing(period_s=ACTION_S),
        spread=HALF_UNIT_SPREAD,
        algorithm="sga:bits=0,selection=roulette,crossover=0.1,mutation=0.2",
        generations=240,
        population=100,
        until=battery_empty,
    )


# ---- Miglino, Lund and Nolfi 1995 ----

ROUND_MM, ROUND_PLACES = 27.0, ((190.0, 130.0), (430.0, 110.0), (330.0, 250.0))
"""Radius of the obstacles, and their places, which are our own [mm]."""


@cache
def box_with_obstacles() -> Arena:
    """Return the box of Miglino, Lund and Nolfi (1995): 60 x 35 cm with a few round obstacles."""
    discs = tuple(Wall(disc_mm=place, radius_mm=ROUND_MM) for place in ROUND_PLACES)
    return replace(Arena.box(620, 370), name="obstacles of 1995", walls=discs)


@measure(notes=4, result=mean)
def navigation_seen(moment: Any, notes: Any) -> None:
    """As `navigation_gained`, for controllers whose first sense stands for proximity."""
    add_gained(moment, notes)


@cache
def sampled_sense(noise: str) -> Sense:
    """Return the sense that reads tables in that box; the same object for the same noise."""
    return sampled_proximity(box_with_obstacles(), ROUND_PLACES, ROUND_MM, noise)


Sampled = Annotated[str, OneOf(("", *NOISES))]


@ready
def miglino_lund_nolfi_1995(sampled: Sampled = "") -> Task:
    """The task to navigate among round obstacles, with sensors from tables or whole ones (Miglino, Lund, Nolfi 1995).

    Args:
        sampled: 'none', 'uniform' or 'conservative', the noise of sensors that read tables of samples; left out, the
            sensors of KiKS as they are.

    Example:
        >>> import kiks
        >>> kiks.tasks.miglino_lund_nolfi_1995(sampled="uniform").controller
        <Controller 'mlp': sampled; 22 parameters>
    """
    seen = sampled_sense(sampled) if sampled else "proximity"
    return Task(
        "miglino_lund_nolfi_1995" + (f"_{sampled}" if sampled else ""),
        (box_with_obstacles(),),
        controllers.mlp(hidden=(), feedback=True, senses=(seen,)),
        (navigation_seen, measures.roaming, measures.contacts, measures.path_mm),
        fitness=mean_of_first,
        seconds=24.0,
        algorithm="sga:bits=8,limit=5,parents=0.2,crossover=0,mutation=0.01",
        generations=200,
        population=100,
    )
