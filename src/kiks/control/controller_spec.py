"""Recipes: tables in files from which controllers are created or imported.

{"kind": "mlp", "hidden": [6]}          one that comes with KiKS, and its arguments
{"function": "package.module:name"}     a name in a module that Python can import
{"file": "shy.py", "name": "shy"}       a name in a file, which lies in the recipe's folder or below
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag

from kiks.control.controller_kinds import ControllerKind
from kiks.control.senses import SENSES
from kiks.errors import ParameterError, nearest, shown
from kiks.model.atomic_files import program_in
from kiks.model.data_file import Number, OneOf, Rule, Switch, Text, Whole, record

SPEED_LIMIT = 10.0
"""Default speed of an output of 1 [pulses/10 ms]: 80 mm/s."""

LAYERS_MAX, UNITS_MAX = 8, 256
"""Most hidden layers, and most units in one: scratch lies on the stack."""

PERIOD_S, TIME_CONSTANT_S = 0.1, 0.4

PLASTIC_NEURONS_MAX = 64
"""Most neurons of a plastic network: each world keeps the weights of all their synapses."""

POLICY_UNITS_MAX = 512
"""Most units in a hidden layer of a policy; learners take 400 by default at most."""


def _each_once(senses: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(senses)) != len(senses):
        raise ValueError(f"must name each sense once, but they were {', '.join(senses)}.")
    return senses


Senses = Annotated[
    tuple[Annotated[str, OneOf(tuple(SENSES))], ...],
    Field(min_length=1, description="Proximity and ambient light are eight counts each, the camera is sixteen greys."),
    AfterValidator(_each_once),
    BeforeValidator(lambda given: (given,) if isinstance(given, str) else given),
]
SpeedLimit = Annotated[Number, Field(ge=0, le=127, description="Speed of an output of 1 [pulses/10 ms].")]
Units = Annotated[Whole, Field(ge=1, le=UNITS_MAX)]
Feedback = Annotated[Switch, Field(description="Whether its last outputs are inputs, too.")]


@record
class Linear:
    """Arguments of `kiks.controllers.linear`."""

    kind: Literal["linear"]
    senses: Senses = ("proximity",)
    speed_limit: SpeedLimit = SPEED_LIMIT
    feedback: Feedback = False


@record
class Mlp:
    """Arguments of `kiks.controllers.mlp`."""

    kind: Literal["mlp"]
    hidden: Annotated[tuple[Units, ...], Field(max_length=LAYERS_MAX, description="One for each hidden layer.")] = (6,)
    senses: Senses = ("proximity",)
    speed_limit: SpeedLimit = SPEED_LIMIT
    feedback: Feedback = False


@record
class Elman:
    """Arguments of `kiks.controllers.elman`."""

    kind: Literal["elman"]
    units: Annotated[Units, Field(description="Hidden units that feed back to themselves.")] = 4
    senses: Senses = ("proximity",)
    speed_limit: SpeedLimit = SPEED_LIMIT


@record
class Ctrnn:
    """Arguments of `kiks.controllers.ctrnn`."""

    kind: Literal["ctrnn"]
    neurons: Annotated[Whole, Field(ge=2, le=UNITS_MAX, description="The first two are the wheels.")] = 6
    period_s: Annotated[Number, Field(ge=0.001, le=10, description="Time that passes in a call.")] = PERIOD_S
    time_constant_s: Annotated[Number, Field(ge=0.001, le=1000, description="Of a parameter of 0.")] = TIME_CONSTANT_S
    senses: Senses = ("proximity",)
    speed_limit: SpeedLimit = SPEED_LIMIT


@record
class Gru:
    """Arguments of `kiks.controllers.gru`."""

    kind: Literal["gru"]
    units: Annotated[Units, Field(description="Gated recurrent units.")] = 4
    senses: Senses = ("proximity",)
    speed_limit: SpeedLimit = SPEED_LIMIT


@record
class Plastic:
    """Arguments of `kiks.controllers.plastic`."""

    kind: Literal["plastic"]
    neurons: Annotated[Whole, Field(ge=2, le=PLASTIC_NEURONS_MAX, description="The first two are the wheels.")] = 3
    per: Annotated[
        Literal["synapse", "neuron"], Field(description="What has a rule, a sign and a learning rate of its own.")
    ] = "synapse"
    senses: Senses = ("proximity",)
    speed_limit: SpeedLimit = SPEED_LIMIT


@record
class Policy:
    """Arguments of `kiks.controllers.policy`."""

    kind: Literal["policy"]
    hidden: Annotated[
        tuple[Annotated[Whole, Field(ge=1, le=POLICY_UNITS_MAX)], ...],
        Field(max_length=LAYERS_MAX, description="One for each hidden layer."),
    ] = (16, 16)
    activation: Annotated[Literal["tanh", "relu"], Field(description="Of hidden units.")] = "tanh"
    output: Annotated[Literal["clip", "tanh"], Field(description="What keeps outputs within +-1.")] = "clip"
    senses: Senses = ("proximity",)
    speed_limit: SpeedLimit = SPEED_LIMIT


@record
class InModule:
    """A user's own controller, found by importing a module."""

    function: Annotated[Text, Field(pattern=r"^[\w.]+:[\w.]+$"), Rule("'package.module:name'")]


@record
class InFile:
    """A user's own controller, found by running a file that lies in the folder of the recipe's file or below."""

    file: Annotated[Text, Field(pattern=r"\.py$"), Rule("a Python file, *.py, in the folder of this file")]
    name: Annotated[Text, Field(min_length=1)]


Shape = Linear | Mlp | Elman | Ctrnn | Gru | Plastic | Policy

SHAPES: dict[ControllerKind, type[Shape]] = {
    ControllerKind.LINEAR: Linear,
    ControllerKind.MLP: Mlp,
    ControllerKind.ELMAN: Elman,
    ControllerKind.CTRNN: Ctrnn,
    ControllerKind.GRU: Gru,
    ControllerKind.PLASTIC: Plastic,
    ControllerKind.POLICY: Policy,
}
"""The arguments of each kind."""


def _tag(given: Any) -> str | None:
    """Return the kind of a recipe."""
    if not isinstance(given, Mapping):
        return None
    return str(given["kind"]) if "kind" in given else next((key for key in ("function", "file") if key in given), None)


Recipe = Annotated[
    Annotated[Linear, Tag("linear")]
    | Annotated[Mlp, Tag("mlp")]
    | Annotated[Elman, Tag("elman")]
    | Annotated[Ctrnn, Tag("ctrnn")]
    | Annotated[Gru, Tag("gru")]
    | Annotated[Plastic, Tag("plastic")]
    | Annotated[Policy, Tag("policy")]
    | Annotated[InModule, Tag("function")]
    | Annotated[InFile, Tag("file")],
    Discriminator(_tag),
    Rule(f"a table with a kind ({', '.join(ControllerKind)}), or a function, or a file and a name"),
]
"""The recipe of a controller in a file."""


def recipe_of(function: Callable[..., Any]) -> dict[str, Any] | None:
    """Return the recipe of a function: by its module if others can import that, else by its file.

    None if it cannot be imported: it was defined in another function, or typed into a console.
    """
    name = function.__qualname__
    if "<" in name:
        return None
    module = sys.modules.get(function.__module__)
    if module is not None and function.__module__ != "__main__":
        return {"function": f"{function.__module__}:{name}"}
    path = Path(function.__code__.co_filename)
    return {"file": str(path.absolute()), "name": name} if path.is_file() else None


def relative_to(recipe: Mapping[str, Any], folder: str | Path) -> dict[str, Any]:
    """Return a recipe with its file as seen from a folder, if it lies in there."""
    if "file" not in recipe:
        return dict(recipe)
    path, root = Path(recipe["file"]).absolute(), Path(folder).absolute()
    return {**recipe, "file": path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)}


def find(recipe: InModule | InFile, folder: str | Path) -> Any:
    """Return what a recipe of a user's own controller names. The module or file is run, as by `import`."""
    if isinstance(recipe, InFile):
        path = program_in(Path(folder), recipe.file, "the recipe's file")
        return _named(module_in(path), recipe.name, f"file {str(path)!r}")
    module_name, _, name = recipe.function.partition(":")
    try:
        module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise ParameterError(
            f"the recipe's module {shown(module_name)} must be one that Python can import, but: {shown(str(error))}. "
            "Start Python where it lies, or name its file instead."
        ) from None
    return _named(module, name, f"module {shown(module_name)}")


def module_in(path: Path) -> Any:
    """Run a Python file as a module of its own; once, until it has changed."""
    try:
        return _run(path, path.stat().st_mtime_ns)
    except (Exception, SystemExit) as error:
        raise ParameterError(f"{str(path)!r} must be a Python file that runs, but it raised {shown(error)}.") from error


@functools.lru_cache(maxsize=256)
def _run(path: Path, changed_ns: int) -> Any:
    spec = importlib.util.spec_from_file_location(f"kiks file {path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _named(module: Any, name: str, where: str) -> Any:
    """Return the object with a dotted name in a module."""
    found = module
    for part in name.split("."):
        if not hasattr(found, part):
            known = tuple(vars(module))
            raise ParameterError(f"the {where} must define {shown(name)}, but does not.{nearest(name, known)}")
        found = getattr(found, part)
    return found
