"""Built-in controllers, whose parameters are evolved or set by hand.

Parameters are numbers of about 1: normally distributed around 0 with a deviation of 1 they are a sensible start.
`N` inputs are those of the senses, in the order of `senses`: eight of proximity, as shares of 1023 counts, and eight of
ambient light, (500 - counts) / 500: about 0 in the dark, nearly 1 beside a lamp. Speeds go out as shares of
`speed_limit`. Matrices are [input, unit], row by row. The same arguments return the same controller.

Each function declares a kind once: its annotations check arguments in calls and in files, and it returns the function
of the controller, how many numbers that remembers, and how many parameters it has. Numba compiles that function with
the arguments and all counts as constants.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec, TypeAlias, Union, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Discriminator, Field, PlainSerializer, Tag

from kiks.control.arguments import checked_call, record_of
from kiks.control.controller import Controller
from kiks.control.neural_nets import (
    GAIN,
    PLASTIC_GAIN,
    add_products,
    cut,
    do_layer,
    exact_tanh,
    exponential_between,
    feed_forward,
    layer_size,
    learnt,
    logistic,
    rectified,
    senses_as_inputs,
)
from kiks.control.recipes import FunctionRecipe, find, relative_to
from kiks.control.senses import check_senses, named, reading_count, recipes_for
from kiks.engine.compiling import kernel
from kiks.engine.numbers import tanh
from kiks.engine.simd.stack_arrays import stack_floats
from kiks.errors import ParameterError, shown
from kiks.model.checks import check_count, check_kind
from kiks.model.data_file import Number, OneOf, Rule, Switch, Whole, adapter, check
from kiks.unknown_names import hinting

__all__ = [
    "collector",
    "ctrnn",
    "elman",
    "from_recipe",
    "graph",
    "gru",
    "linear",
    "mlp",
    "plastic",
    "policy",
    "random_parameters",
    "recipe_for",
]


__getattr__, __dir__ = hinting(__name__, __all__)

SPEED_LIMIT = 10.0
"""Default speed of an output of 1 [pulses/10 ms]: 80 mm/s."""

LAYERS_MAX, UNITS_MAX = 8, 512
"""Most hidden layers, and most units in one: scratch lies on the stack, and learners take 400 by default at most."""

PLASTIC_NEURONS_MAX = 64
"""Most neurons of a plastic network: each world keeps the weights of all their synapses."""

Units = Annotated[Whole, Field(ge=1, le=UNITS_MAX)]
if TYPE_CHECKING:
    # One needs no list where a user gives it; the functions get several.
    Senses: TypeAlias = Any
    Layers: TypeAlias = Sequence[int]
    Recipe: TypeAlias = Any
else:
    Senses = Annotated[
        tuple[Any, ...], BeforeValidator(check_senses), PlainSerializer(recipes_for), Field(min_length=1)
    ]
    Layers = Annotated[tuple[Units, ...], Field(max_length=LAYERS_MAX, description="One for each hidden layer.")]
TraceShare = Annotated[Number, Field(ge=0, le=1, description="0 for no traces; the period over the time to forget.")]
SpeedLimit = Annotated[Number, Field(ge=0, le=127, description="Speed of an output of 1 [pulses/10 ms].")]

WITH_GRIPPER: dict[str, Any] = {"senses": ("proximity", "barrier"), "actuators": ("wheels", "gripper")}
"""Senses and actuators of kinds that do not let their users choose senses."""

Made = tuple[Any, int, int]
"""The function of a controller, how many numbers it remembers, and how many parameters it has."""

_Arguments = ParamSpec("_Arguments")

KINDS: dict[str, tuple[Any, Callable[[Any], Controller]]] = {}
"""Of each kind of controllers that come with KiKS: the record of its arguments, and what makes one of these."""


def kind(function: Callable[_Arguments, Made]) -> Callable[_Arguments, Controller]:
    """Make of a declaration a function that returns controllers, and a kind of recipes."""
    name, declared = function.__name__, cast(Callable[..., Made], function)
    arguments = record_of(function, kind=name)

    @functools.lru_cache(maxsize=1024)
    def make(given: Any) -> Controller:
        values = dict(vars(given))
        del values["kind"]
        decide, memory, parameters = declared(**values)
        decide.__name__ = decide.__qualname__ = name
        parts = {"senses": given.senses} if hasattr(given, "senses") else WITH_GRIPPER
        made = Controller(decide, memory=memory, parameters=parameters, **parts)
        made.recipe = adapter(arguments).dump_python(given, mode="json")
        return made

    KINDS[name] = arguments, make
    call: Any = checked_call(function, arguments, make)
    call.__signature__ = inspect.signature(function).replace(return_annotation=Controller)
    return call  # type: ignore[no-any-return]


@kind
def linear(
    *,
    senses: Senses = ("proximity",),
    speed_limit: SpeedLimit = SPEED_LIMIT,
    feedback: Switch = False,
    trace_share: TraceShare = 0.0,
) -> Made:
    """Return a Braitenberg vehicle: each wheel a weighted sum of the sensors, cut to +-1.

    Parameters: 2 biases, a matrix [N, 2]; with feedback [N + 2, 2], the last two inputs being the last outputs; with
    traces N more rows, the last ones.

    Args:
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The speed of an output of 1 [pulses/10 ms].
        feedback: Whether its last outputs are inputs.
        trace_share: As for `mlp`.

    Example:
        >>> import kiks
        >>> kiks.controllers.linear().parameter_count
        18
    """
    return feed_forward((), senses, speed_limit, has_feedback=feedback, trace_share=trace_share, squash=cut)


@kind
def mlp(
    *,
    hidden: Layers = (6,),
    senses: Senses = ("proximity",),
    speed_limit: SpeedLimit = SPEED_LIMIT,
    feedback: Switch = False,
    trace_share: TraceShare = 0.0,
) -> Made:
    """Return a network of layers of tanh units.

    Parameters, for each layer: a bias for each unit, a matrix [input, unit]. The last layer are the wheels.
    `mlp(hidden=(), feedback=True)` is the recurrent perceptron of Floreano and Mondada (Automatic creation of an
    autonomous agent, From Animals to Animats 3, 1994): sigmoid outputs that are connected to one another.

    Args:
        hidden: Units of each hidden layer.
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The speed of an output of 1 [pulses/10 ms].
        feedback: Whether its last outputs are inputs, after the sensors.
        trace_share: If it is above 0, the trace of each sensor is an input, too, after all others: the mean of what it
            has shown, of which each call renews this share. So 0.02 forgets most of it in 50 calls.

    Example:
        >>> import kiks
        >>> kiks.controllers.mlp(hidden=(6,)).parameter_count
        68
    """
    return feed_forward(hidden, senses, speed_limit, has_feedback=feedback, trace_share=trace_share)


@kind
def elman(*, units: Units = 4, senses: Senses = ("proximity",), speed_limit: SpeedLimit = SPEED_LIMIT) -> Made:
    """Return hidden units h that feed back to themselves and a layer of tanh from them to the wheels.

    h becomes tanh(units of the inputs s and of h); the last h is the context (Elman, Finding structure in time,
    Cognitive Science 14, 1990, with tanh in place of logistic units, and a context that begins at 0).

    Parameters: layers as in `mlp`. Of h, [1 + N + units, units]; of the wheels, [1 + units, 2].

    Args:
        units: Number of hidden units.
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The highest speed [pulses/10 ms].

    Example:
        >>> import kiks
        >>> kiks.controllers.elman(units=4).parameter_count
        62
    """
    sense_count, take_senses = reading_count(senses), senses_as_inputs(senses)
    input_count = sense_count + units
    wheels_first = layer_size(input_count, units)

    def decide(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        inputs, fresh, outputs = stack_floats(input_count), stack_floats(units), stack_floats(2)
        take_senses(sensors, inputs)
        for k in range(units):
            inputs[sense_count + k] = memory[k]
        do_layer(inputs, input_count, parameters, 0, fresh, units)
        for k in range(units):
            memory[k] = tanh(fresh[k])
        do_layer(memory, units, parameters, wheels_first, outputs, 2)
        for wheel in range(2):
            wheels[wheel] = speed_limit * tanh(outputs[wheel])

    return decide, units, wheels_first + layer_size(units, 2)


@kind
def ctrnn(
    *,
    neurons: Annotated[Whole, Field(ge=2, le=UNITS_MAX, description="The first two are the wheels.")] = 6,
    period_s: Annotated[Number, Field(ge=0.001, le=10, description="Time that passes in a call.")] = 0.1,
    time_constant_s: Annotated[Number, Field(ge=0.001, le=1000, description="Of a parameter of 0.")] = 0.4,
    senses: Senses = ("proximity",),
    speed_limit: SpeedLimit = SPEED_LIMIT,
) -> Made:
    """Return a continuous-time recurrent neural network; its first two neurons are the wheels.

    The state y of a neuron follows T dy/dt = -y + sum of w f(y' + b') over all neurons + sum of v s over the inputs, f
    being the logistic function (Beer, On the dynamics of small continuous-time recurrent neural networks, Adaptive
    Behavior 3, 1995). Time passes by Euler's method, in as many equal steps a period as the shortest T asks for.

    Parameters: logarithms of T / time_constant_s, cut to +-4; b / 4; v / 4 as a matrix [N, neuron]; w / 4 as a matrix
    [neuron, neuron]. A neuron whose weight to itself is above 4 can hold what it has.

    Args:
        neurons: Number of neurons, at least 2.
        period_s: The time that passes in a call [s]: the period of the control loop.
        time_constant_s: T of a parameter of 0 [s].
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The highest speed [pulses/10 ms].

    Example:
        >>> import kiks
        >>> kiks.controllers.ctrnn(neurons=6).parameter_count
        96
    """
    sense_count, take_senses = reading_count(senses), senses_as_inputs(senses)
    bias_first, senses_first = neurons, 2 * neurons
    neurons_first = senses_first + sense_count * neurons
    periods = period_s / time_constant_s

    def decide(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        inputs, rates = stack_floats(sense_count), stack_floats(neurons)
        driven, active, towards = stack_floats(neurons), stack_floats(neurons), stack_floats(neurons)
        fastest = 0.0
        for k in range(neurons):
            rates[k] = periods * exponential_between(-parameters[k])
            driven[k] = 0.0
        for k in range(neurons):
            fastest = max(fastest, rates[k])
        take_senses(sensors, inputs)
        add_products(inputs, sense_count, parameters, senses_first, driven, neurons)
        # Steps of at most half of the shortest time constant neither swing nor run away.
        step_count = max(int(np.ceil(2.0 * fastest)), 1)
        share = 1.0 / step_count
        for _ in range(step_count):
            for k in range(neurons):
                active[k] = logistic(memory[k] + GAIN * parameters[bias_first + k])
                towards[k] = driven[k]
            add_products(active, neurons, parameters, neurons_first, towards, neurons)
            for k in range(neurons):
                memory[k] += share * rates[k] * (GAIN * towards[k] - memory[k])
        for wheel in range(2):
            wheels[wheel] = speed_limit * tanh(0.5 * (memory[wheel] + GAIN * parameters[bias_first + wheel]))

    return decide, neurons, neurons_first + neurons * neurons


PICK_UP = ((2, -4.0, 255.0, 0.0), (5, 0.0, 255.0, 0.0), (4, 0.0, 255.0, 1.0), (5, 0.0, 127.0, 1.0))
"""Picking up: for so many steps, speed [pulses/10 ms], arm and jaws. It backs off, lowers the arm, grips and lifts."""

RELEASE = ((3, 0.0, 190.0, 1.0), (2, 0.0, 190.0, 0.0), (3, 0.0, 127.0, 0.0))
"""Releasing, likewise: it holds the arm out, opens the jaws, and lifts the arm."""

COLLECTOR_INPUTS, COLLECTOR_OUTPUTS, COLLECTOR_UNITS = 7, 4, 4
"""Six proximity sensors and the light barrier; two wheels, picking up and releasing; hidden units."""

Architecture = Annotated[str, OneOf(("feed_forward", "hidden", "elman", "designed", "emergent"))]


@kernel
def steps_of(phases: Any) -> Any:
    """Return how many steps a macro takes."""
    count = 0
    for phase in phases:
        count += phase[0]
    return count


@kernel
def follow_macro(phases: Any, step: Any, wheels: Any) -> Any:
    """Write the outputs of a step of a macro, from 0."""
    for count, speed, arm, jaws in phases:
        if 0 <= step < count:
            wheels[0], wheels[1], wheels[2], wheels[3] = speed, speed, arm, jaws
        step -= count


@kind
def collector(*, architecture: Architecture = "feed_forward", speed_limit: SpeedLimit = SPEED_LIMIT) -> Made:
    """Return a network with a gripper, in one of the five architectures of Nolfi (1997).

    Its inputs are the six sensors at the front and the sides and the light barrier. Its outputs are logistic: the speed
    of each wheel, from backwards to ahead, and two triggers. A trigger above a half, and above the other, starts a
    macro, during which the network rests: picking up (`PICK_UP`) while the barrier is free, releasing (`RELEASE`) while
    it is not. The controller keeps the clock of the macro in its memory.

    Parameters: of `feed_forward`, a layer [1 + 7, 4]; of `hidden`, [1 + 7, 4] and [1 + 4, 4]; of `elman`, whose hidden
    units feed back to themselves, [1 + 7 + 4, 4] and [1 + 4, 4]; of `designed`, a layer for an empty gripper and one
    for a full one; of `emergent`, two layers of outputs and two of selectors: for each output, the layer whose selector
    is higher decides.

    Args:
        architecture: 'feed_forward', 'hidden', 'elman', 'designed' or 'emergent'.
        speed_limit: The highest speed [pulses/10 ms].

    Example:
        >>> import kiks
        >>> [kiks.controllers.collector(architecture=each).parameter_count for each in ("hidden", "emergent")]
        [52, 128]
    """
    layer = layer_size(COLLECTOR_INPUTS, COLLECTOR_OUTPUTS)
    hidden = {"hidden": COLLECTOR_UNITS, "elman": COLLECTOR_UNITS}.get(architecture, 0)
    context = COLLECTOR_UNITS if architecture == "elman" else 0
    input_count = COLLECTOR_INPUTS + context
    hidden_size = layer_size(input_count, hidden)
    is_designed, is_emergent = architecture == "designed", architecture == "emergent"
    picking, releasing = steps_of.py_func(PICK_UP), steps_of.py_func(RELEASE)

    def decide(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        if memory[0] > 0.0:
            follow_macro(PICK_UP, picking - np.int64(memory[0]), wheels)
            memory[0] -= 1.0
            return
        if memory[1] > 0.0:
            follow_macro(RELEASE, releasing - np.int64(memory[1]), wheels)
            memory[1] -= 1.0
            return
        inputs, outputs = stack_floats(input_count), stack_floats(COLLECTOR_OUTPUTS)
        for k in range(6):
            inputs[k] = sensors[k] / 1023.0
        is_full = sensors[8] > 0.0
        inputs[6] = 1.0 if is_full else 0.0
        if hidden > 0:
            units = stack_floats(hidden)
            for k in range(context):
                inputs[COLLECTOR_INPUTS + k] = memory[2 + k]
            do_layer(inputs, input_count, parameters, 0, units, hidden)
            for k in range(hidden):
                units[k] = logistic(units[k])
                if k < context:
                    memory[2 + k] = units[k]
            do_layer(units, hidden, parameters, hidden_size, outputs, COLLECTOR_OUTPUTS)
        elif is_emergent:
            others, selectors, rivals = stack_floats(4), stack_floats(4), stack_floats(4)
            do_layer(inputs, input_count, parameters, 0, outputs, COLLECTOR_OUTPUTS)
            do_layer(inputs, input_count, parameters, layer, others, COLLECTOR_OUTPUTS)
            do_layer(inputs, input_count, parameters, 2 * layer, selectors, COLLECTOR_OUTPUTS)
            do_layer(inputs, input_count, parameters, 3 * layer, rivals, COLLECTOR_OUTPUTS)
            for k in range(COLLECTOR_OUTPUTS):
                if rivals[k] > selectors[k]:
                    outputs[k] = others[k]
        else:
            first = layer if is_designed and is_full else 0
            do_layer(inputs, input_count, parameters, first, outputs, COLLECTOR_OUTPUTS)
        for wheel in range(2):
            wheels[wheel] = speed_limit * (2.0 * logistic(outputs[wheel]) - 1.0)
        wheels[2], wheels[3] = 127.0, 1.0 if is_full else 0.0
        is_picking = outputs[2] > max(0.0, outputs[3])
        is_releasing = outputs[3] > max(0.0, outputs[2])
        if is_picking and not is_full:
            follow_macro(PICK_UP, 0, wheels)
            memory[0] = picking - 1.0
        elif is_releasing and is_full:
            follow_macro(RELEASE, 0, wheels)
            memory[1] = releasing - 1.0

    sizes = {"hidden": hidden_size + layer_size(hidden, 4), "designed": 2 * layer, "emergent": 4 * layer}
    sizes["elman"] = sizes["hidden"]
    return decide, 2 + context, sizes.get(architecture, layer)


@kind
def graph(
    *,
    hidden: Annotated[Whole, Field(ge=0, le=UNITS_MAX, description="Neurons that are no wheels.")] = 8,
    senses: Senses = ("proximity",),
    speed_limit: SpeedLimit = SPEED_LIMIT,
) -> Made:
    """Return a network in which each neuron may be connected with each: any graph; the first two are the wheels.

    In a call each neuron becomes tanh(weighted sum of the inputs and of all neurons as they were before). So a signal
    needs a call for each connection on its way, and a connection that is not there is a weight of 0. The algorithm
    `neat` evolves which there are.

    Parameters: a bias for each neuron, a matrix [input, neuron], a matrix [neuron, neuron].

    Args:
        hidden: Number of neurons besides the wheels, at most.
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The speed of an output of 1 [pulses/10 ms].

    Example:
        >>> import kiks
        >>> kiks.controllers.graph(hidden=8).parameter_count
        190
    """
    neurons, sense_count, take_senses = 2 + hidden, reading_count(senses), senses_as_inputs(senses)
    input_count = sense_count + neurons

    def decide(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        inputs, fresh = stack_floats(input_count), stack_floats(neurons)
        take_senses(sensors, inputs)
        for k in range(neurons):
            inputs[sense_count + k] = memory[k]
        do_layer(inputs, input_count, parameters, 0, fresh, neurons)
        for k in range(neurons):
            memory[k] = tanh(fresh[k])
        for wheel in range(2):
            wheels[wheel] = speed_limit * memory[wheel]

    return decide, neurons, layer_size(input_count, neurons)


@kind
def gru(*, units: Units = 4, senses: Senses = ("proximity",), speed_limit: SpeedLimit = SPEED_LIMIT) -> Made:
    """Return gated recurrent units h and a layer of tanh from them to the wheels.

    z and r are logistic units of the inputs s and of h; then h becomes z h + (1 - z) tanh(units of s and of r h)
    (Cho et al., Learning phrase representations using RNN encoder-decoder, 2014, equations 5 to 8).

    Parameters: layers as in `mlp`. Of z and r together, [1 + N + units, 2 units]; of what is new, [1 + N + units,
    units]; of the wheels, [1 + units, 2].

    Args:
        units: Number of units.
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The highest speed [pulses/10 ms].

    Example:
        >>> import kiks
        >>> kiks.controllers.gru(units=4).parameter_count
        166
    """
    sense_count, take_senses = reading_count(senses), senses_as_inputs(senses)
    input_count, gate_count = sense_count + units, 2 * units
    units_first = layer_size(input_count, gate_count)
    wheels_first = units_first + layer_size(input_count, units)

    def decide(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        inputs, outputs = stack_floats(input_count), stack_floats(2)
        gates, fresh = stack_floats(gate_count), stack_floats(units)
        take_senses(sensors, inputs)
        for k in range(units):
            inputs[sense_count + k] = memory[k]
        do_layer(inputs, input_count, parameters, 0, gates, gate_count)
        for k in range(gate_count):
            gates[k] = logistic(gates[k])
        for k in range(units):
            inputs[sense_count + k] *= gates[units + k]
        do_layer(inputs, input_count, parameters, units_first, fresh, units)
        for k in range(units):
            memory[k] = gates[k] * memory[k] + (1.0 - gates[k]) * tanh(fresh[k])
        do_layer(memory, units, parameters, wheels_first, outputs, 2)
        for wheel in range(2):
            wheels[wheel] = speed_limit * tanh(outputs[wheel])

    return decide, units, wheels_first + layer_size(units, 2)


@kind
def plastic(
    *,
    neurons: Annotated[Whole, Field(ge=2, le=PLASTIC_NEURONS_MAX, description="The first two are the wheels.")] = 3,
    per: Annotated[
        str, OneOf(("synapse", "neuron")), Field(description="What has a rule, a sign and a learning rate of its own.")
    ] = "synapse",
    senses: Senses = ("proximity",),
    speed_limit: SpeedLimit = SPEED_LIMIT,
) -> Made:
    """Return neurons whose weights change by Hebbian rules while the robot drives; the first two are the wheels.

    Parameters say how weights change, and no parameter is a weight (Floreano and Mondada, Evolution of plastic
    neurocontrollers for situated agents, From Animals to Animats 4, 1996; Floreano and Urzelai, Evolutionary robots
    with on-line self-organization and behavioral fitness, Neural Networks 13, 2000). Senders x are the inputs, cut to
    0 to 1, the last activities of the neurons, and a 1. A synapse has a sign and a weight w from 0 to 1; all weights
    are 0 at the start. In a call, a neuron's activity y becomes f(4 sum of sign w x), f being the logistic function.
    Then w grows by its rate times::

        plain Hebb     (1 - w) x y
        postsynaptic   (1 - w) x y - w (1 - x) y
        presynaptic    (1 - w) x y - w x (1 - y)
        covariance     (1 - w) F if F > 0, else w F, with F = tanh(4 (1 - |x - y|) - 2)

    The speed of a wheel is 2 y - 1. Two bits name the rule, in this order 00, 01, 10, 11. A parameter above 0 is the
    bit 1 or the sign +. A parameter r makes the rate `|r| / (1 + |r|)`.

    Parameters per synapse: three matrices [N + neurons + 1, neuron], of rates, of first bits, of second bits; the sign
    is that of r. Per neuron: the sign of each sender, N + neurons + 1, for all synapses that lead away from it; then of
    each neuron the rate, the first bits, the second bits, for all synapses that lead to it.

    Args:
        neurons: Number of neurons, at least 2.
        per: What has a rule, a sign and a rate of its own: 'synapse' or 'neuron'.
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The highest speed [pulses/10 ms].

    Example:
        >>> import kiks
        >>> [kiks.controllers.plastic(per=each).parameter_count for each in ("synapse", "neuron")]
        [108, 21]
    """
    sense_count, take_senses = reading_count(senses), senses_as_inputs(senses)
    sender_count = sense_count + neurons + 1
    synapse_count = sender_count * neurons
    # A rate stands `row` further on for the next sender, and each table `size` behind the one before.
    row, size = (neurons, synapse_count) if per == "synapse" else (0, neurons)
    signs_first, sign_row, sign_column = (0, neurons, 1) if per == "synapse" else (0, 1, 0)
    rates_first = 0 if per == "synapse" else sender_count
    first_bits, second_bits = rates_first + size, rates_first + 2 * size

    # The memory holds the activity of each neuron, then the weights, [sender, neuron].
    def decide(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        senders, totals = stack_floats(sender_count), stack_floats(neurons)
        take_senses(sensors, senders)
        for k in range(sense_count):
            senders[k] = min(max(0.0, senders[k]), 1.0)
        for k in range(neurons):
            senders[sense_count + k] = memory[k]
            totals[k] = 0.0
        senders[sender_count - 1] = 1.0
        for sender in range(sender_count):
            for k in range(neurons):
                excites = parameters[signs_first + sender * sign_row + k * sign_column] > 0.0
                given = senders[sender] * memory[neurons + sender * neurons + k]
                totals[k] += given if excites else -given
        for k in range(neurons):
            memory[k] = logistic(PLASTIC_GAIN * totals[k])
        for sender in range(sender_count):
            for k in range(neurons):
                own, rule = neurons + sender * neurons + k, sender * row + k
                rate = abs(parameters[rates_first + rule])
                change = learnt(
                    memory[own],
                    senders[sender],
                    memory[k],
                    parameters[first_bits + rule] > 0.0,
                    parameters[second_bits + rule] > 0.0,
                )
                memory[own] += rate / (1.0 + rate) * change
        for wheel in range(2):
            wheels[wheel] = speed_limit * (2.0 * memory[wheel] - 1.0)

    return decide, neurons + synapse_count, rates_first + 3 * size


@kind
def policy(
    *,
    hidden: Layers = (16, 16),
    activation: Annotated[str, OneOf(("tanh", "relu")), Field(description="Of hidden units.")] = "tanh",
    output: Annotated[str, OneOf(("clip", "tanh")), Field(description="What keeps outputs within +-1.")] = "clip",
    senses: Senses = ("proximity",),
    speed_limit: SpeedLimit = SPEED_LIMIT,
) -> Made:
    """Return the network of a policy that PyTorch or another library learnt; `kiks.champion_of_policy` fills it.

    It is an `mlp` with a choice of functions, and with the tanh of a mathematical library to the last digits, where
    `mlp` has a faster one that is right within 7e-6. Parameters as for `mlp`.

    Args:
        hidden: Units of each hidden layer.
        activation: The function of hidden units: 'tanh' or 'relu'.
        output: What keeps outputs within +-1: 'clip' or 'tanh'.
        senses: Its senses, as for `kiks.Controller`.
        speed_limit: The speed of an output of 1 [pulses/10 ms].

    Example:
        >>> import kiks
        >>> kiks.controllers.policy(hidden=(64, 64)).parameter_count
        4866
    """
    return feed_forward(
        hidden,
        senses,
        speed_limit,
        activation=exact_tanh if activation == "tanh" else rectified,
        squash=exact_tanh if output == "tanh" else cut,
    )


# ---- controllers in files ----


def _tag(given: Any) -> str | None:
    if not isinstance(given, Mapping):
        return None
    return str(given["kind"]) if "kind" in given else "function" if "function" in given else None


if not TYPE_CHECKING:
    _RECORDS = {name: arguments for name, (arguments, _) in KINDS.items()} | {"function": FunctionRecipe}
    Recipe = Annotated[
        Union[tuple(Annotated[each, Tag(tag)] for tag, each in _RECORDS.items())],  # noqa: UP007
        Discriminator(_tag),
        Rule(f"a table with a kind ({', '.join(KINDS)}) or a function"),
    ]
    """The recipe of a controller in a file."""


def from_recipe(recipe: Mapping[str, Any], folder: str | Path = ".") -> Controller:
    """Return the controller of a recipe, as `Controller.recipe` has it.

    A recipe of a user's own controller names a module or a file, and that is run: load only what you trust.

    Args:
        recipe: {"kind": "mlp", "hidden": [6], ...}, {"function": "module:name"} or {"function": "my.py:shy"}.
        folder: Where a relative file is looked for.

    Example:
        >>> import kiks
        >>> kiks.controllers.from_recipe({"kind": "gru", "units": 3}) is kiks.controllers.gru(units=3)
        True
    """
    return controller_of(check(Recipe, recipe, "the recipe"), folder)


def controller_of(recipe: Recipe, folder: str | Path) -> Controller:
    """Return the controller of a checked recipe of a file in a folder. A user's own module or file is run."""
    if not isinstance(recipe, FunctionRecipe):
        return KINDS[recipe.kind][1](recipe)
    found = find(recipe, folder)
    if not isinstance(found, Controller):
        raise ParameterError(
            f"the recipe {shown(recipe)} must name a controller, but it names {shown(found)}. "
            "Write @kiks.controller over the function."
        )
    return found


def recipe_for(controller: Controller, folder: str | Path = ".") -> dict[str, Any]:
    """Return the recipe of a controller for a file in a folder: JSON-able, with paths relative to there.

    Example:
        >>> import kiks
        >>> kiks.controllers.recipe_for(kiks.controllers.elman(units=3))
        {'kind': 'elman', 'units': 3, 'senses': ['proximity'], 'speed_limit': 10.0}
    """
    check_kind("controller", controller, Controller)
    if controller.recipe is None:
        raise ParameterError(
            f"the controller {shown(controller.name)} must be defined at the top of a module or file to be found "
            "again, but it was defined inside another function or typed into a console."
        )
    if None in controller.recipe.get("senses", ()):
        raise ParameterError(
            "senses must be defined at the top of a module or file to be found again, but one of "
            f"{named(controller.senses)} was defined inside another function or typed into a console."
        )
    return relative_to(controller.recipe, folder)


def random_parameters(controller: Controller, count: int, *, seed: int) -> NDArray[np.float64]:
    """Return random parameters to begin with, of normal distribution (0, 1), float64 [count, parameter].

    Example:
        >>> import kiks
        >>> kiks.controllers.random_parameters(kiks.controllers.linear(), 3, seed=1).shape
        (3, 18)
    """
    check_kind("controller", controller, Controller)
    if controller.parameter_count is None:
        raise ParameterError(
            f"the controller {shown(controller.name)} must say how many parameters it has, but takes any number. "
            "Write @kiks.controller(parameters=...)."
        )
    check_count("seed", seed, most=2**63 - 1)
    return np.random.default_rng(seed).standard_normal((check_count("count", count), controller.parameter_count))
