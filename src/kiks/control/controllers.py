"""Built-in controllers, whose parameters are evolved or set by hand.

Parameters are numbers of about 1: normally distributed around 0 with a deviation of 1 they are a sensible start.
`N` inputs are those of the senses, in the order of `senses`: eight of proximity, as shares of 1023 counts, and eight of
ambient light, (500 - counts) / 500: about 0 in the dark, nearly 1 beside a lamp. Speeds go out as shares of
`speed_limit`. Matrices are [input, unit], row by row. The same arguments return the same controller.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control import neural_nets
from kiks.control.controller import Controller
from kiks.control.controller_kinds import ControllerKind
from kiks.control.controller_spec import (
    PERIOD_S,
    SHAPES,
    SPEED_LIMIT,
    TIME_CONSTANT_S,
    Ctrnn,
    Elman,
    Gru,
    InFile,
    InModule,
    Linear,
    Mlp,
    Plastic,
    Policy,
    Recipe,
    Shape,
    find,
    relative_to,
)
from kiks.control.senses import reading_count
from kiks.engine.numbers import tanh
from kiks.errors import ParameterError, shown
from kiks.model.checks import check_count, check_kind
from kiks.model.data_file import adapter, check


def linear(
    *, senses: Sequence[str] = ("proximity",), speed_limit: float = SPEED_LIMIT, feedback: bool = False
) -> Controller:
    """Return a Braitenberg vehicle: each wheel a weighted sum of the sensors, cut to +-1.

    Parameters: 2 biases, a matrix [N, 2]; with feedback [N + 2, 2], the last two inputs being the last outputs.

    Args:
        senses: Its senses, of 'proximity', 'ambient' and 'camera'.
        speed_limit: The speed of an output of 1 [pulses/10 ms].
        feedback: Whether its last outputs are inputs.

    Example:
        >>> import kiks
        >>> kiks.controllers.linear().parameter_count
        18
    """
    return _made(ControllerKind.LINEAR, senses=senses, speed_limit=speed_limit, feedback=feedback)


def mlp(
    *,
    hidden: Sequence[int] = (6,),
    senses: Sequence[str] = ("proximity",),
    speed_limit: float = SPEED_LIMIT,
    feedback: bool = False,
) -> Controller:
    """Return a network of layers of tanh units.

    Parameters, for each layer: a bias for each unit, a matrix [input, unit]. The last layer are the wheels.
    `mlp(hidden=(), feedback=True)` is the recurrent perceptron of Floreano and Mondada (Automatic creation of an
    autonomous agent, From Animals to Animats 3, 1994): sigmoid outputs that are connected to one another.

    Args:
        hidden: Units of each hidden layer.
        senses: Its senses, of 'proximity', 'ambient' and 'camera'.
        speed_limit: The speed of an output of 1 [pulses/10 ms].
        feedback: Whether its last outputs are inputs, after the sensors.

    Example:
        >>> import kiks
        >>> kiks.controllers.mlp(hidden=(6,)).parameter_count
        68
    """
    return _made(ControllerKind.MLP, hidden=hidden, senses=senses, speed_limit=speed_limit, feedback=feedback)


def elman(*, units: int = 4, senses: Sequence[str] = ("proximity",), speed_limit: float = SPEED_LIMIT) -> Controller:
    """Return hidden units h that feed back to themselves and a layer of tanh from them to the wheels.

    h becomes tanh(units of the inputs s and of h); the last h is the context (Elman, Finding structure in time,
    Cognitive Science 14, 1990, with tanh in place of logistic units, and a context that begins at 0).

    Parameters: layers as in `mlp`. Of h, [1 + N + units, units]; of the wheels, [1 + units, 2].

    Args:
        units: Number of hidden units.
        senses: Its senses, of 'proximity', 'ambient' and 'camera'.
        speed_limit: The highest speed [pulses/10 ms].

    Example:
        >>> import kiks
        >>> kiks.controllers.elman(units=4).parameter_count
        62
    """
    return _made(ControllerKind.ELMAN, units=units, senses=senses, speed_limit=speed_limit)


def ctrnn(
    *,
    neurons: int = 6,
    period_s: float = PERIOD_S,
    time_constant_s: float = TIME_CONSTANT_S,
    senses: Sequence[str] = ("proximity",),
    speed_limit: float = SPEED_LIMIT,
) -> Controller:
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
        senses: Its senses, of 'proximity', 'ambient' and 'camera'.
        speed_limit: The highest speed [pulses/10 ms].
    """
    return _made(
        ControllerKind.CTRNN,
        neurons=neurons,
        period_s=period_s,
        time_constant_s=time_constant_s,
        senses=senses,
        speed_limit=speed_limit,
    )


def gru(*, units: int = 4, senses: Sequence[str] = ("proximity",), speed_limit: float = SPEED_LIMIT) -> Controller:
    """Return gated recurrent units h and a layer of tanh from them to the wheels.

    z and r are logistic units of the inputs s and of h; then h becomes z h + (1 - z) tanh(units of s and of r h)
    (Cho et al., Learning phrase representations using RNN encoder-decoder, 2014, equations 5 to 8).

    Parameters: layers as in `mlp`. Of z and r together, [1 + N + units, 2 units]; of what is new, [1 + N + units,
    units]; of the wheels, [1 + units, 2].

    Args:
        units: Number of units.
        senses: Its senses, of 'proximity', 'ambient' and 'camera'.
        speed_limit: The highest speed [pulses/10 ms].
    """
    return _made(ControllerKind.GRU, units=units, senses=senses, speed_limit=speed_limit)


def plastic(
    *,
    neurons: int = 3,
    per: str = "synapse",
    senses: Sequence[str] = ("proximity",),
    speed_limit: float = SPEED_LIMIT,
) -> Controller:
    """Return neurons whose weights change by Hebbian rules while the robot drives; the first two are the wheels.

    Parameters say how weights change, and no parameter is a weight (Floreano and Mondada, Evolution of plastic
    neurocontrollers for situated agents, From Animals to Animats 4, 1996; Floreano and Urzelai, Evolutionary robots
    with on-line self-organization and behavioral fitness, Neural Networks 13, 2000). Senders x are the inputs, cut to
    0 to 1, the last activities of the neurons, and a 1. A synapse has a sign and a weight w from 0 to 1; all weights
    are 0 at the start. In a call, a neuron's activity y becomes f(4 sum of sign w x), f being the logistic function.
    Then w grows by its rate times

        plain Hebb     (1 - w) x y
        postsynaptic   (1 - w) x y - w (1 - x) y
        presynaptic    (1 - w) x y - w x (1 - y)
        covariance     (1 - w) F if F > 0, else w F, with F = tanh(4 (1 - |x - y|) - 2)

    The speed of a wheel is 2 y - 1. Two bits name the rule, in this order 00, 01, 10, 11. A parameter above 0 is the
    bit 1 or the sign +. A parameter r makes the rate |r| / (1 + |r|).

    Parameters per synapse: three matrices [N + neurons + 1, neuron], of rates, of first bits, of second bits; the sign
    is that of r. Per neuron: the sign of each sender, N + neurons + 1, for all synapses that lead away from it; then of
    each neuron the rate, the first bits, the second bits, for all synapses that lead to it.

    Args:
        neurons: Number of neurons, at least 2.
        per: What has a rule, a sign and a rate of its own: 'synapse' or 'neuron'.
        senses: Its senses, of 'proximity', 'ambient' and 'camera'.
        speed_limit: The highest speed [pulses/10 ms].

    Example:
        >>> import kiks
        >>> [kiks.controllers.plastic(per=each).parameter_count for each in ("synapse", "neuron")]
        [108, 21]
    """
    return _made(ControllerKind.PLASTIC, neurons=neurons, per=per, senses=senses, speed_limit=speed_limit)


def policy(
    *,
    hidden: Sequence[int] = (16, 16),
    activation: str = "tanh",
    output: str = "clip",
    senses: Sequence[str] = ("proximity",),
    speed_limit: float = SPEED_LIMIT,
) -> Controller:
    """Return the network of a policy that PyTorch or another library learnt; `kiks.champion_of_policy` fills it.

    It is an `mlp` with a choice of functions, and with the tanh of a mathematical library to the last digits, where
    `mlp` has a faster one that is right within 7e-6. Parameters as for `mlp`.

    Args:
        hidden: Units of each hidden layer.
        activation: The function of hidden units: 'tanh' or 'relu'.
        output: What keeps outputs within +-1: 'clip' or 'tanh'.
        senses: Its senses, of 'proximity', 'ambient' and 'camera'.
        speed_limit: The speed of an output of 1 [pulses/10 ms].

    Example:
        >>> import kiks
        >>> kiks.controllers.policy(hidden=(64, 64)).parameter_count
        4866
    """
    return _made(
        ControllerKind.POLICY,
        hidden=hidden,
        activation=activation,
        output=output,
        senses=senses,
        speed_limit=speed_limit,
    )


def from_recipe(recipe: Mapping[str, Any], folder: str | Path = ".") -> Controller:
    """Return the controller of a recipe, as `Controller.recipe` has it.

    A recipe of a user's own controller names a module or a file, and that is run: load only what you trust.

    Args:
        recipe: {"kind": "mlp", "hidden": [6], ...}, {"function": "module:name"} or {"file": "my.py", "name": "shy"}.
        folder: Where a relative file is looked for.

    Example:
        >>> import kiks
        >>> kiks.controllers.from_recipe({"kind": "gru", "units": 3}) is kiks.controllers.gru(units=3)
        True
    """
    return controller_of(check_recipe(recipe), folder)


def check_recipe(recipe: object) -> Recipe:
    """Return the recipe of a table; nothing that it names is run."""
    model: Any = Recipe
    made: Recipe = check(model, recipe, "the recipe")
    return made


def controller_of(recipe: Recipe, folder: str | Path) -> Controller:
    """Return the controller of a recipe in a file of a folder. A user's own module or file is run."""
    if not isinstance(recipe, InModule | InFile):
        return _shaped(recipe)
    found = find(recipe, folder)
    if not isinstance(found, Controller):
        raise ParameterError(
            f"the recipe {shown(recipe)} must name a controller, but it names {shown(found)}. "
            "Write @kiks.controller over the function."
        )
    return found


def recipe_for(controller: Controller, folder: str | Path = ".") -> dict[str, Any]:
    """Return the recipe of a controller for a file in a folder: JSON-able, with paths relative to there."""
    check_kind("controller", controller, Controller)
    if controller.recipe is None:
        raise ParameterError(
            f"the controller {shown(controller.name)} must be defined at the top of a module or file to be found "
            "again, but "
            "it was defined inside another function or typed into a console."
        )
    return relative_to(controller.recipe, folder)


def random_parameters(controller: Controller, count: int, *, seed: int) -> NDArray[np.float64]:
    """Return random parameters to begin with, of normal distribution (0, 1), float64 [count, parameter]."""
    check_kind("controller", controller, Controller)
    if controller.parameter_count is None:
        raise ParameterError(
            f"the controller {shown(controller.name)} must say how many parameters it has, but takes any number. "
            "Write @kiks.controller(parameters=...)."
        )
    check_count("seed", seed, most=2**63 - 1)
    return np.random.default_rng(seed).standard_normal((check_count("count", count), controller.parameter_count))


# ---- one object for the same arguments: what is compiled for it is compiled once ----


def _made(kind: ControllerKind, **arguments: Any) -> Controller:
    shape: Any = SHAPES[kind]
    return _shaped(shape(kind=str(kind), **arguments))


@functools.lru_cache(maxsize=1024)
def _shaped(recipe: Shape) -> Controller:
    decide, memory, size = _FUNCTIONS[type(recipe)](recipe, reading_count(recipe.senses))
    decide.__name__ = decide.__qualname__ = recipe.kind
    model: Any = type(recipe)
    said = adapter(model).dump_python(recipe, mode="json")
    return Controller(decide, senses=recipe.senses, memory=memory, parameters=size, recipe=said)


# Each returns the function of a controller, and how many numbers of memory and how many parameters it has.


def _layered(recipe: Linear | Mlp, sense_count: int) -> tuple[Any, int, int]:
    memory = 2 * recipe.feedback
    hidden = recipe.hidden if isinstance(recipe, Mlp) else ()
    counts = (sense_count + memory, *hidden, 2)
    decide = neural_nets.feed_forward(
        counts,
        recipe.senses,
        has_feedback=recipe.feedback,
        squash=neural_nets.cut if isinstance(recipe, Linear) else tanh,
        speed_limit=recipe.speed_limit,
    )
    return decide, memory, _layers_size(counts)


def _layers_size(counts: tuple[int, ...]) -> int:
    return sum(neural_nets.layer_size(*pair) for pair in itertools.pairwise(counts))


def _learnt(recipe: Policy, sense_count: int) -> tuple[Any, int, int]:
    counts = (sense_count, *recipe.hidden, 2)
    decide = neural_nets.feed_forward(
        counts,
        recipe.senses,
        activation=neural_nets.exact_tanh if recipe.activation == "tanh" else neural_nets.rectified,
        squash=neural_nets.exact_tanh if recipe.output == "tanh" else neural_nets.cut,
        speed_limit=recipe.speed_limit,
    )
    return decide, 0, _layers_size(counts)


def _simple_recurrent(recipe: Elman, sense_count: int) -> tuple[Any, int, int]:
    size = neural_nets.layer_size(sense_count + recipe.units, recipe.units) + neural_nets.layer_size(recipe.units, 2)
    decide = neural_nets.simple_recurrent(recipe.senses, recipe.units, speed_limit=recipe.speed_limit)
    return decide, recipe.units, size


def _continuous(recipe: Ctrnn, sense_count: int) -> tuple[Any, int, int]:
    decide = neural_nets.continuous(
        recipe.senses,
        recipe.neurons,
        period_s=recipe.period_s,
        time_constant_s=recipe.time_constant_s,
        speed_limit=recipe.speed_limit,
    )
    return decide, recipe.neurons, recipe.neurons * (2 + sense_count + recipe.neurons)


def _gated(recipe: Gru, sense_count: int) -> tuple[Any, int, int]:
    size = 3 * neural_nets.layer_size(sense_count + recipe.units, recipe.units)
    decide = neural_nets.gated(recipe.senses, recipe.units, speed_limit=recipe.speed_limit)
    return decide, recipe.units, size + neural_nets.layer_size(recipe.units, 2)


def _plastic(recipe: Plastic, sense_count: int) -> tuple[Any, int, int]:
    is_per_synapse = recipe.per == "synapse"
    decide = neural_nets.plastic(
        recipe.senses, recipe.neurons, is_per_synapse=is_per_synapse, speed_limit=recipe.speed_limit
    )
    return decide, *neural_nets.plastic_size(sense_count, recipe.neurons, is_per_synapse=is_per_synapse)


_FUNCTIONS: dict[type[Shape], Callable[[Any, int], tuple[Any, int, int]]] = {
    Linear: _layered,
    Mlp: _layered,
    Elman: _simple_recurrent,
    Ctrnn: _continuous,
    Gru: _gated,
    Plastic: _plastic,
    Policy: _learnt,
}
