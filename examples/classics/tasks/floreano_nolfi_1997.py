"""The task to catch, or to escape, with networks of five bits a synapse (Floreano and Nolfi 1997).

Networks, genes and selection are those of the papers: weights of five bits, without biases, the best fifth has five
children each. Fitness counts shares of 500 cycles, also in trials of another length.

Example:
    >>> import kiks
    >>> task = kiks.tasks.floreano_nolfi_1997()
    >>> [side.parameter_count for side in task.sides], task.population, task.seconds
    ([30, 20], 100, 50.0)
"""

import kiks
from kiks.controllers import kernel, logistic, stack_floats
from kiks.measures import FULL_COUNT, distance_mm

RACE_S, RACE_STEPS = 50.0, 500  # a trial lasts for 500 cycles of 100 ms, or until predator and prey touch
SIDE_MM, CAUGHT_MM, APART_MM = 470, 57.0, 100.0  # of the arena; between middles that touch; least gap at the start
PREDATOR_SPEED, PREY_SPEED = 10.0, 20.0  # the highest speeds [pulses/10 ms]: 80 and 160 mm/s
BAUD = 38400  # at 9600 a loop with a picture of the camera would take longer than 0.1 s

# Grey of a white wall in the middle of the camera's picture; the share by which it is less at its border; the middle of
# the sixteen greys; and the share of white below which a grey is dark. A Khepera's body has half of the wall's grey.
WHITE, FALL, MIDDLE, DARK_SHARE = 225.0, 0.41, 7.875, 0.75

VISION_UNITS, GREYS = 5, 16  # units of the predator's vision, of 7.2 degrees each, and greys that they divide
PREDATOR_INPUTS, PREY_INPUTS = 13, 8


@kernel
def perceptron(inputs, memory, parameters, wheels):
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


@kiks.controller(parameters=30, memory=2, senses=("proximity", "camera"))
def predator(sensors, memory, parameters, wheels):
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


@kiks.controller(parameters=20, memory=2)
def prey(sensors, memory, parameters, wheels):
    """Drive by proximity, 160 mm/s at most."""
    inputs = stack_floats(PREY_INPUTS)
    for number in range(8):
        inputs[number] = sensors[number] / FULL_COUNT
    perceptron(inputs, memory, parameters, wheels)
    for wheel in range(2):
        wheels[wheel] = PREY_SPEED * (2.0 * wheels[wheel] - 1.0)


@kiks.measure
def caught(moment, notes):
    """1 from the contact of predator and prey on."""
    if is_caught(moment):
        notes[0] = 1.0


@kiks.measure
def lasted_steps(moment, notes):
    """Number of cycles before the contact."""
    if not is_caught(moment):
        notes[0] += 1.0


@kernel
def is_caught(moment):
    """Return whether another robot touches it."""
    for other in range(moment.poses.shape[0]):
        is_near = distance_mm(moment, moment.poses[other, 0], moment.poses[other, 1]) <= CAUGHT_MM
        if other != moment.robot and is_near:
            return True
    return False


def lasted(values):
    """Return t / 500, the prey's fitness."""
    return values["lasted_steps"].mean(axis=1) / RACE_STEPS


def caught_early(values):
    """Return 1 - t / 500, the predator's fitness."""
    return 1.0 - lasted(values)


def floreano_nolfi_1997() -> kiks.Task:
    """Return the task."""
    return kiks.Task(
        "floreano_nolfi_1997",
        [kiks.Arena.box(SIDE_MM, SIDE_MM)],
        predator,
        [lasted_steps, kiks.measures.path_mm, kiks.measures.contacts],
        fitness=caught_early,
        side="predator",
        against=kiks.Side("prey", prey, lasted),
        seconds=RACE_S,
        until=caught,
        apart_mm=APART_MM,
        timing=kiks.Timing(baud=BAUD),
        algorithm="sga",
        generations=100,
        population=100,
    )


task = floreano_nolfi_1997()
