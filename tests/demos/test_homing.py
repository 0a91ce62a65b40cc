"""Homing (Floreano and Mondada 1996): the battery, what a life is worth, and the same robot on a line."""

from typing import Any

import numpy as np

import kiks
from kiks.control.recipes import module_in
from kiks.model.package import shipped

PAPER = module_in(shipped("examples/classics/tasks/floreano_mondada_1996.py"))
TASK, HIDDEN, USED = PAPER.task, PAPER.HIDDEN, PAPER.USED
FULL_ACTIONS, LIFE_ACTIONS = PAPER.FULL_ACTIONS, PAPER.LIFE_ACTIONS
ZONE, FAR = (375.0, 425.0, 0.0), (150.0, 150.0, 0.0)


def lived(parameters: Any, starts: Any, **options: Any) -> Any:
    """Return `actions`, `charges` and `homing` of lives, float64 [life, 3]."""
    batch = kiks.Batch(TASK.arenas[0], len(starts), starts=np.array(starts)[:, None], timing=TASK.timings[0])
    watched = [PAPER.actions, PAPER.charges, PAPER.homing]
    return batch.run(TASK.controller, parameters, seconds=TASK.seconds, measures=watched, **options).values[:, 0]


def test_a_life_ends_with_the_battery_unless_it_is_charged_and_turning_earns_far_from_walls_alone() -> None:
    still = lived(np.zeros(102), [FAR, ZONE], until=TASK.until)
    np.testing.assert_array_equal(still, [[FULL_ACTIONS, 0, 0], [LIFE_ACTIONS, 1, 0]])
    parameters = np.zeros(102)
    parameters[90:92] = 10.0, -10.0  # the wheels' biases: it turns on the spot
    off, on = lived(parameters, [(220.0, 245.0, 0.0), ZONE], until=TASK.until)[:, 2]
    assert off > 0.95 * FULL_ACTIONS / LIFE_ACTIONS
    assert on == 0.0


def test_the_battery_is_an_input_and_counts_down_in_memory() -> None:
    rng = np.random.default_rng(1)
    parameters, memory, wheels = rng.normal(0.0, 1.0, 102), np.zeros(HIDDEN + 1), np.zeros(2)
    readings = np.concatenate([np.zeros(8), np.full(8, 450.0), [1023.0]])
    inputs = np.concatenate([np.zeros(8), [0.1, 0.1, 1.0]])
    context = np.zeros(HIDDEN)
    for number in range(1, 4):
        TASK.controller(readings, memory, parameters, wheels)
        fed = np.concatenate([inputs, [1.0 - number / FULL_ACTIONS], context])
        context = np.tanh(parameters[:HIDDEN] + fed @ parameters[HIDDEN:90].reshape(17, HIDDEN))
        np.testing.assert_allclose(memory[:HIDDEN], context, atol=2e-5)
        assert memory[USED] == number / FULL_ACTIONS
        expected = 10.0 * np.tanh(parameters[90:92] + context @ parameters[92:].reshape(HIDDEN, 2))
        np.testing.assert_allclose(wheels, expected, atol=2e-4)
    TASK.controller(np.append(readings[:-1], 0.0), memory, parameters, wheels)
    assert memory[USED] == 0.0
