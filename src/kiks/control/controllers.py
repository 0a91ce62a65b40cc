"""Controllers that come with KiKS: shapes whose parameters evolution or a person fills in.

Parameters are numbers of about 1: normally distributed around 0 with a deviation of 1 they are a sensible start.
Sensors come in as shares of 1023 counts, speeds go out as shares of `speed_limit`. `N` inputs are those of the senses:
eight proximity counts, eight ambient ones (500 in the dark, less in the light), in the order of `senses`. Matrices are
[input, unit], row by row. The same arguments return the same controller.
"""

from __future__ import annotations

import functools
import inspect
import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control import networks, recipes
from kiks.control.controller import Controller, check_senses
from kiks.errors import ParameterError, nearest, shown
from kiks.model.ranges import check_count, check_number
from kiks.model.robot import SENSOR_COUNT

SPEED_LIMIT = 10.0
"""Speed that an output of 1 stands for, unless another is given [pulses/10 ms]: 80 mm/s."""

HIDDEN_LIMIT, UNIT_LIMIT = 8, 256
"""Most hidden layers, and most units in one: scratch lies on the stack."""

PERIOD_S, TIME_CONSTANT_S = 0.1, 0.4


def linear(
    *, senses: Sequence[str] = ("proximity",), speed_limit: float = SPEED_LIMIT, feedback: bool = False
) -> Controller:
    """Return a Braitenberg vehicle: each wheel a weighted sum of the sensors, cut to +-1.

    Parameters: 2 biases, a matrix [N, 2]; with feedback [N + 2, 2], the last two inputs being the last outputs.

    Args:
        senses: What it senses: 'proximity', 'ambient' or both.
        speed_limit: The speed of an output of 1 [pulses/10 ms].
        feedback: Whether its last outputs are inputs.

    Raises:
        ParameterError: If an argument is out of range.

    Example:
        >>> import kiks
        >>> kiks.controllers.linear().parameter_count
        18
    """
    return _linear(check_senses(senses), _speed_limit(speed_limit), bool(feedback))


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
        senses: What it senses: 'proximity', 'ambient' or both.
        speed_limit: The speed of an output of 1 [pulses/10 ms].
        feedback: Whether its last outputs are inputs, after the sensors.

    Raises:
        ParameterError: If an argument is out of range.

    Example:
        >>> import kiks
        >>> kiks.controllers.mlp(hidden=(6,)).parameter_count
        68
    """
    if not isinstance(hidden, list | tuple) or len(hidden) > HIDDEN_LIMIT:
        raise ParameterError(
            f"hidden must be the units of up to {HIDDEN_LIMIT} layers, like (6,), but it was {shown(hidden)}."
        )
    counts = tuple(check_count("hidden units", count, 1, UNIT_LIMIT) for count in hidden)
    return _mlp(counts, check_senses(senses), _speed_limit(speed_limit), bool(feedback))


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
        neurons: How many, 2 at least.
        period_s: The time that passes in a call [s]: the period of the control loop.
        time_constant_s: T of a parameter of 0 [s].
        senses: What it senses: 'proximity', 'ambient' or both.
        speed_limit: The highest speed [pulses/10 ms].

    Raises:
        ParameterError: If an argument is out of range.
    """
    return _ctrnn(
        check_count("neurons", neurons, 2, UNIT_LIMIT),
        check_number("period_s", period_s, 0.001, 10),
        check_number("time_constant_s", time_constant_s, 0.001, 1000),
        check_senses(senses),
        _speed_limit(speed_limit),
    )


def gru(*, units: int = 4, senses: Sequence[str] = ("proximity",), speed_limit: float = SPEED_LIMIT) -> Controller:
    """Return gated recurrent units h and a layer of tanh from them to the wheels.

    z and r are logistic units of the inputs s and of h; then h becomes z h + (1 - z) tanh(units of s and of r h)
    (Cho et al., Learning phrase representations using RNN encoder-decoder, 2014, equations 5 to 8).

    Parameters: layers as in `mlp`. Of z and r together, [1 + N + units, 2 units]; of what is new, [1 + N + units,
    units]; of the wheels, [1 + units, 2].

    Args:
        units: How many.
        senses: What it senses: 'proximity', 'ambient' or both.
        speed_limit: The highest speed [pulses/10 ms].

    Raises:
        ParameterError: If an argument is out of range.
    """
    return _gru(check_count("units", units, 1, UNIT_LIMIT), check_senses(senses), _speed_limit(speed_limit))


KINDS: dict[str, Callable[..., Controller]] = {"linear": linear, "mlp": mlp, "ctrnn": ctrnn, "gru": gru}
"""What a recipe's `kind` may be; its other entries are the arguments."""


def from_recipe(recipe: Mapping[str, Any], folder: str | Path = ".") -> Controller:
    """Return the controller of a recipe, as `Controller.recipe` has it.

    A recipe of a user's own controller names a module or a file, and that is run: load only what you trust.

    Args:
        recipe: {"kind": "mlp", "hidden": [6], ...}, {"function": "module:name"} or {"file": "my.py", "name": "shy"}.
        folder: Where a relative file is looked for.

    Raises:
        ParameterError: If it is no recipe, or what it names is not there or no controller.

    Example:
        >>> import kiks
        >>> kiks.controllers.from_recipe({"kind": "gru", "units": 3}) is kiks.controllers.gru(units=3)
        True
    """
    if not isinstance(recipe, Mapping):
        raise ParameterError(f"a recipe must be a table of names and values, but it was {recipe!r:.80}.")
    if "kind" not in recipe:
        found = recipes.find(recipe, folder)
        if not isinstance(found, Controller):
            raise ParameterError(
                f"the recipe {dict(recipe)} must name a controller, but it names {found!r:.80}. "
                "Write @kiks.controller over the function."
            )
        return found
    make = KINDS.get(str(recipe["kind"]))
    if make is None:
        raise ParameterError(
            f"kind in a recipe must be one of {', '.join(KINDS)}, but it was {recipe['kind']!r}."
            f"{nearest(str(recipe['kind']), tuple(KINDS))}"
        )
    given = {name: value for name, value in recipe.items() if name != "kind"}
    known = tuple(inspect.signature(make).parameters)
    for name in given:
        if name not in known:
            raise ParameterError(
                f"a recipe of the kind {recipe['kind']!r} must have none but {', '.join(known)}, but it had {name!r}."
                f"{nearest(str(name), known)}"
            )
    return make(**given)


def recipe_for(controller: Controller, folder: str | Path = ".") -> dict[str, Any]:
    """Return the recipe of a controller for a file in a folder: JSON-able, with paths relative to there.

    Raises:
        ParameterError: If the controller has none.
    """
    if controller.recipe is None:
        raise ParameterError(
            f"the controller {controller.name!r} must be defined at the top of a module or file to be found again, but "
            "it was defined inside another function or typed into a console."
        )
    return recipes.relative_to(controller.recipe, folder)


def random_parameters(controller: Controller, count: int, *, seed: int) -> NDArray[np.float64]:
    """Return parameters to begin with, normally distributed around 0 with a deviation of 1, float64 [count, parameter].

    Raises:
        ParameterError: If the controller takes any number of parameters, or `count` or `seed` is out of range.
    """
    if controller.parameter_count is None:
        raise ParameterError(
            f"the controller {controller.name!r} must say how many parameters it has, but takes any number. "
            "Write @kiks.controller(parameters=...)."
        )
    check_count("seed", seed, most=2**63 - 1)
    return np.random.default_rng(seed).standard_normal((check_count("count", count), controller.parameter_count))


# ---- one object for the same arguments: what is compiled for it is compiled once ----


@functools.lru_cache(maxsize=256)
def _linear(senses: tuple[str, ...], speed_limit: float, feedback: bool) -> Controller:
    recipe = {"kind": "linear", "senses": list(senses), "speed_limit": speed_limit, "feedback": feedback}
    return _feed_forward((), senses, speed_limit, feedback, recipe)


@functools.lru_cache(maxsize=256)
def _mlp(hidden: tuple[int, ...], senses: tuple[str, ...], speed_limit: float, feedback: bool) -> Controller:
    recipe = {"kind": "mlp", "hidden": list(hidden), "senses": list(senses)}
    return _feed_forward(
        hidden, senses, speed_limit, feedback, recipe | {"speed_limit": speed_limit, "feedback": feedback}
    )


def _feed_forward(
    hidden: tuple[int, ...], senses: tuple[str, ...], speed_limit: float, feedback: bool, recipe: dict[str, Any]
) -> Controller:
    counts = (SENSOR_COUNT * len(senses) + 2 * feedback, *hidden, 2)
    decide = networks.feed_forward(
        counts, has_feedback=feedback, is_cut=recipe["kind"] == "linear", speed_limit=speed_limit
    )
    size = sum(networks.layer_size(*pair) for pair in itertools.pairwise(counts))
    return _ready_made(decide, senses, 2 * feedback, size, recipe)


@functools.lru_cache(maxsize=256)
def _ctrnn(
    neurons: int, period_s: float, time_constant_s: float, senses: tuple[str, ...], speed_limit: float
) -> Controller:
    sense_count = SENSOR_COUNT * len(senses)
    decide = networks.continuous(
        sense_count, neurons, period_s=period_s, time_constant_s=time_constant_s, speed_limit=speed_limit
    )
    recipe = {
        "kind": "ctrnn",
        "neurons": neurons,
        "period_s": period_s,
        "time_constant_s": time_constant_s,
        "senses": list(senses),
        "speed_limit": speed_limit,
    }
    return _ready_made(decide, senses, neurons, neurons * (2 + sense_count + neurons), recipe)


@functools.lru_cache(maxsize=256)
def _gru(units: int, senses: tuple[str, ...], speed_limit: float) -> Controller:
    sense_count = SENSOR_COUNT * len(senses)
    size = 3 * networks.layer_size(sense_count + units, units) + networks.layer_size(units, 2)
    recipe = {"kind": "gru", "units": units, "senses": list(senses), "speed_limit": speed_limit}
    return _ready_made(networks.gated(sense_count, units, speed_limit=speed_limit), senses, units, size, recipe)


def _ready_made(
    decide: Callable[..., Any], senses: tuple[str, ...], memory: int, parameters: int, recipe: dict[str, Any]
) -> Controller:
    decide.__name__ = decide.__qualname__ = recipe["kind"]
    return Controller(decide, senses=senses, memory=memory, parameters=parameters, recipe=recipe)


def _speed_limit(speed_limit: object) -> float:
    return check_number("speed_limit", speed_limit, 0, 127)
