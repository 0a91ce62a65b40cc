"""The task to come back to a charging zone before a battery is empty (Floreano and Mondada 1996).

Example:
    >>> import kiks
    >>> task = kiks.tasks.floreano_mondada_1996()  # or (shuttling=True), as for `floreano_mondada_1994`
    >>> task.parameter_count, task.timings[0].period_s, task.seconds
    (102, 0.38, 57.0)
"""

import math

import kiks
from kiks.controllers import SPEED_LIMIT, do_layer, kernel, layer_size, stack_floats, tanh
from kiks.measures import FULL_COUNT, clear_share, roaming_share, wheels_share

FULL_ACTIONS, LIFE_ACTIONS, ACTION_S = 50.0, 150, 0.38  # of a full battery, of the longest life; the time of each
HIDDEN, CONTEXT, USED = 5, 0, 5  # hidden units; where the memory holds them, and what the battery has lost
INPUTS = 8 + 2 + 1 + 1
FED = INPUTS + HIDDEN
WHEELS_FIRST = layer_size(FED, HIDDEN)
AMBIENT, FLOOR = 8, 16
FRONT, BACK = 2, 6  # of the two ambient light sensors that it uses
BLACK = 512.0  # below this reading of the floor sensor it stands on the charging zone
SENSES = ("proximity", "ambient", "floor")


@kernel
def charge_lost(lost, floor):
    """Return the share of the battery that is lost after one more action: none on the charging zone."""
    return 0.0 if floor < BLACK else min(lost + 1.0 / FULL_ACTIONS, 1.0)


@kiks.controller(senses=SENSES, memory=HIDDEN + 1, parameters=102)
def homing_network(sensors, memory, parameters, wheels):
    """Drive by hidden units that feed back to themselves; one of their inputs is the battery, which is counted here.

    Inputs: eight of proximity, two of ambient light, the floor, the battery; then the last hidden units. Parameters:
    5 biases of hidden units, a matrix [17, 5], 2 biases of wheels, a matrix [5, 2].
    """
    memory[USED] = charge_lost(memory[USED], sensors[FLOOR])
    inputs, hidden, outputs = stack_floats(FED), stack_floats(HIDDEN), stack_floats(2)
    for k in range(8):
        inputs[k] = sensors[k] / FULL_COUNT
    inputs[8] = (500.0 - sensors[AMBIENT + FRONT]) / 500.0
    inputs[9] = (500.0 - sensors[AMBIENT + BACK]) / 500.0
    inputs[10] = sensors[FLOOR] / FULL_COUNT
    inputs[11] = 1.0 - memory[USED]
    for k in range(HIDDEN):
        inputs[INPUTS + k] = memory[CONTEXT + k]
    do_layer(inputs, FED, parameters, 0, hidden, HIDDEN)
    for k in range(HIDDEN):
        memory[CONTEXT + k] = tanh(hidden[k])
    do_layer(memory, HIDDEN, parameters, WHEELS_FIRST, outputs, 2)
    for wheel in range(2):
        wheels[wheel] = SPEED_LIMIT * tanh(outputs[wheel])


@kiks.measure(notes=2, senses=SENSES)
def battery_empty(moment, notes):
    """1 once the battery is empty, which ends a life."""
    notes[1] = charge_lost(notes[1], moment.sensors[FLOOR])
    if notes[1] >= 1.0 - 1e-9:
        notes[0] = 1.0


@kernel
def clear_off_zone(moment):
    """Return (1 - i) as a share of a life's actions; 0 on the charging zone."""
    return clear_share(moment) / LIFE_ACTIONS if moment.sensors[FLOOR] >= BLACK else 0.0


@kiks.measure(senses=SENSES)
def homing(moment, notes):
    """Sum of V (1 - i) over a life, divided by its most actions; nothing is counted on the charging zone.

    V and i are those of `navigation` (1994). Battery, lamp and zone are not in it: a robot that charges lives longer.
    """
    notes[0] += wheels_share(moment) * clear_off_zone(moment)


@kiks.measure(notes=4, senses=SENSES)
def homing_gained(moment, notes):
    """The same with the V of `navigation_gained` (1994)."""
    notes[0] += roaming_share(moment, notes) * clear_off_zone(moment)
    notes[1] += 1.0


@kiks.measure(notes=2, senses=SENSES)
def charges(moment, notes):
    """How often it has come to the charging zone."""
    is_there = moment.sensors[FLOOR] < BLACK
    if is_there and notes[1] == 0.0:
        notes[0] += 1.0
    notes[1] = 1.0 if is_there else 0.0


@kiks.measure
def actions(moment, notes):
    """Number of actions."""
    notes[0] += 1.0


def fitness(values):
    """Return the mean of the first measure over all worlds."""
    return next(iter(values.values())).mean(axis=1)


def floreano_mondada_1996(shuttling: bool = False) -> kiks.Task:
    """Return the task.

    Args:
        shuttling: Whether V counts the speeds of the wheels without their signs, as for `floreano_mondada_1994`.
    """
    return kiks.Task(
        "floreano_mondada_1996" + ("_shuttling" if shuttling else ""),
        [kiks.Arena.load("classics/floreano_mondada_1996")],
        homing_network,
        [homing if shuttling else homing_gained, actions, charges, kiks.measures.path_mm, kiks.measures.contacts],
        fitness=fitness,
        seconds=LIFE_ACTIONS * ACTION_S,
        timing=kiks.Timing(period_s=ACTION_S),
        spread=0.5 / math.sqrt(3.0),  # the deviation of genes that are spread evenly over +-0.5
        algorithm="sga:bits=0,selection=roulette,crossover=0.1,mutation=0.2",
        generations=240,
        population=100,
        until=battery_empty,
    )


task = floreano_mondada_1996()
