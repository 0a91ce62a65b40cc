"""Small neural networks as kernels: what the controllers that come with KiKS are made of.

Need: a call takes a hundred nanoseconds or so, and has the same bits on every processor.
Method: sums run over inputs outside and over units inside. So each unit adds up its inputs in their order, and the sums
of several units go on side by side; those of one input after the other would wait for each other. Counts are constants
of the kernels. Scratch lies on the stack, where nothing else can overlap it, so that it stays in registers.

Parameters of a layer are a matrix [1 + input, unit] row by row: first the biases, then the weights of each input.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from kiks.control.senses import AnySense, reading_count, sense_of
from kiks.engine.compiling import inlined, kernel
from kiks.engine.numbers import exponential, tanh
from kiks.engine.simd.stack_arrays import stack_floats

TIME_SCALE_LIMIT = 4.0
"""Time constants lie within e to this power of the one that is given, to either side."""

GAIN = 4.0
"""What a CTRNN's weights and biases are multiplied by: from 1 on, a parameter makes a unit hold what it has."""

PLASTIC_GAIN = 4.0
"""What the sum of a plastic neuron is multiplied by: one strong synapse of an active sender nearly saturates it."""


@kernel
def logistic(x: Any) -> Any:
    """Return 1 / (1 + e^-x), within 4e-6."""
    return 0.5 + 0.5 * tanh(0.5 * x)


@kernel
def exact_tanh(x: Any) -> Any:
    """Return the hyperbolic tangent within 3e-16, for networks that learnt with that of a mathematical library."""
    shrunk = exponential(-2.0 * abs(x))
    positive = (1.0 - shrunk) / (1.0 + shrunk)
    return positive if x > 0.0 else -positive


@kernel
def cut(x: Any) -> Any:
    """Return a number cut to +-1."""
    return min(max(x, -1.0), 1.0)


@kernel
def rectified(x: Any) -> Any:
    """Return a number, or 0 if it is negative."""
    return max(x, 0.0)


@kernel
def exponential_between(x: Any) -> Any:
    """Return e to the power of x, which is cut to +-`TIME_SCALE_LIMIT`, within 0.1 %, which does for time."""
    t = tanh(0.5 * min(max(x, -TIME_SCALE_LIMIT), TIME_SCALE_LIMIT))
    return (1.0 + t) / (1.0 - t)


@inlined
def add_products(inputs: Any, input_count: Any, parameters: Any, first: Any, units: Any, unit_count: Any) -> Any:
    """Add weighted inputs to units; the weights are the parameters from `first` on, [input, unit]."""
    for k in range(input_count):
        given, row = inputs[k], first + k * unit_count
        for unit in range(unit_count):
            units[unit] += given * parameters[row + unit]


@inlined
def do_layer(inputs: Any, input_count: Any, parameters: Any, first: Any, units: Any, unit_count: Any) -> Any:
    """Do a linear layer; its parameters are those from `first` on."""
    for unit in range(unit_count):
        units[unit] = parameters[first + unit]
    add_products(inputs, input_count, parameters, first + unit_count, units, unit_count)


def senses_as_inputs(senses: Sequence[AnySense]) -> Any:
    """Return a kernel `(sensors, inputs)` that writes the counts of senses as inputs.

    A sense says which of its readings are inputs of 0 and of 1.
    """
    if not senses:

        @inlined
        def take_none(sensors: Any, inputs: Any) -> None:
            pass

        return take_none

    take_others, sense = senses_as_inputs(senses[:-1]), sense_of(senses[-1])
    first, count, zero = reading_count(senses[:-1]), sense.size, sense.zero
    share = 1.0 / (sense.full - zero)

    @inlined
    def take(sensors: Any, inputs: Any) -> None:
        take_others(sensors, inputs)
        for k in range(first, first + count):
            inputs[k] = (sensors[k] - zero) * share

    return take


def layer_size(input_count: int, unit_count: int) -> int:
    """Return how many parameters a layer has."""
    return (1 + input_count) * unit_count


def layers(counts: tuple[int, ...], activation: Any, first: int = 0) -> Any:
    """Return a kernel `(inputs, parameters, units)` of layers of so many numbers; `activation` is between them."""
    input_count, unit_count = counts[:2]

    if len(counts) == 2:

        @inlined
        def do_last(inputs: Any, parameters: Any, units: Any) -> Any:
            do_layer(inputs, input_count, parameters, first, units, unit_count)

        return do_last

    do_rest = layers(counts[1:], activation, first + layer_size(input_count, unit_count))

    @inlined
    def do_all(inputs: Any, parameters: Any, units: Any) -> Any:
        between = stack_floats(unit_count)
        do_layer(inputs, input_count, parameters, first, between, unit_count)
        for unit in range(unit_count):
            between[unit] = activation(between[unit])
        do_rest(between, parameters, units)

    return do_all


def feed_forward(
    hidden: Sequence[int],
    senses: Sequence[AnySense],
    speed_limit: float,
    *,
    has_feedback: bool = False,
    trace_share: float = 0.0,
    activation: Any = tanh,
    squash: Any = tanh,
) -> tuple[Any, int, int]:
    """Return the function of a controller whose layers lead from the senses to the wheels, its memory and parameters.

    Args:
        hidden: Units of each hidden layer.
        senses: The senses of the inputs.
        speed_limit: The speed of an output of 1 [pulses/10 ms].
        has_feedback: Whether the last two outputs are inputs, from the memory.
        trace_share: Share of a sensor's trace that a call renews; if it is above 0, the traces are inputs, too.
        activation: Kernel of hidden units.
        squash: Kernel that keeps outputs within +-1.
    """
    sense_count, take_senses = reading_count(senses), senses_as_inputs(senses)
    output_count, trace_count = 2 * has_feedback, sense_count * (trace_share > 0.0)
    memory_count = output_count + trace_count  # what is remembered are the inputs after the sensors
    input_count = sense_count + memory_count
    counts = (input_count, *hidden, 2)
    net = layers(counts, activation)

    def decide(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        inputs, outputs = stack_floats(input_count), stack_floats(2)
        take_senses(sensors, inputs)
        for k in range(memory_count):
            inputs[sense_count + k] = memory[k]
        net(inputs, parameters, outputs)
        for wheel in range(2):
            output = squash(outputs[wheel])
            wheels[wheel] = speed_limit * output
            if has_feedback:
                memory[wheel] = output
        for k in range(trace_count):
            memory[output_count + k] += trace_share * (inputs[k] - memory[output_count + k])

    return decide, memory_count, sum(layer_size(*pair) for pair in pairwise(counts))


@kernel
def learnt(weight: Any, before: Any, after: Any, first_bit: Any, second_bit: Any) -> Any:
    """Return the change of a weight at a learning rate of 1; two bits choose the rule (`kiks.controllers.plastic`).

    The weight and the activities of the sender before the synapse and of the neuron after it are from 0 to 1.
    """
    if not first_bit:
        return after * (before - weight) if second_bit else (1.0 - weight) * before * after
    if not second_bit:
        return before * (after - weight)
    alike = tanh(4.0 * (1.0 - abs(before - after)) - 2.0)
    return ((1.0 - weight) if alike > 0.0 else weight) * alike
