"""Every public name is explained: an example that runs, shapes of arrays, units, and errors that exist."""

from __future__ import annotations

import builtins
import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest

import kiks.errors
from kiks.learn.gymnasium_envs import KheperaEnv, KheperaVectorEnv
from kiks.learn.pettingzoo_env import KheperaTeam

MODULES = {"controllers": kiks.controllers, "measures": kiks.measures, "tasks": kiks.tasks}
CONSTANTS = {"__version__", "tasks.TASKS"}
"""Names of values, which have no docstring of their own."""

NAMES = {name: getattr(kiks, name) for name in kiks.__all__ if name not in MODULES} | {
    f"{module}.{name}": getattr(there, name) for module, there in MODULES.items() for name in dir(there)
}
NAMES |= {each.__name__: each for each in (KheperaEnv, KheperaVectorEnv, KheperaTeam)}

UNITS = {"mm": "mm", "s": "s", "rad": "rad", "deg": "degrees?|deg", "ms": "ms", "w": "W", "baud": "bit/s"}
"""For the end of an argument's name its unit as texts have it."""


def callables() -> Iterator[tuple[str, Any]]:
    """Yield public functions, and the public methods and properties of public classes."""
    for name, each in NAMES.items():
        if inspect.isfunction(each):
            yield name, each
        elif inspect.isclass(each):
            for member, found in vars(each).items():
                inner = found.fget if isinstance(found, property) else getattr(found, "__func__", found)
                if not member.startswith("_") and inspect.isfunction(inner):
                    yield f"{name}.{member}", inner


CALLABLES = dict(callables())


@pytest.mark.parametrize("name", sorted(NAMES.keys() - CONSTANTS))
def test_every_name_has_an_example(name: str) -> None:
    # `--doctest-modules` runs them.
    assert ">>> " in (NAMES[name].__doc__ or ""), name


@pytest.mark.parametrize("name", sorted(CALLABLES))
def test_returned_arrays_have_shapes(name: str) -> None:
    if "NDArray" in str(CALLABLES[name].__annotations__.get("return", "")):
        assert re.search(r"\[[\w ,.+]+\]", CALLABLES[name].__doc__ or ""), name


@pytest.mark.parametrize("name", sorted(NAMES.keys() | CALLABLES.keys()))
def test_arguments_have_units_and_errors_exist(name: str) -> None:
    text = inspect.cleandoc((NAMES | CALLABLES)[name].__doc__ or "")
    sections = dict(re.findall(r"^(Args|Raises):\n((?: .*\n?|\n)+)", text, flags=re.MULTILINE))
    for argument, meaning in re.findall(r"^    (\w+): (.*(?:\n {5,}.*)*)", sections.get("Args", ""), re.MULTILINE):
        unit = UNITS.get(argument.rpartition("_")[2])
        if unit and "_" in argument:
            assert re.search(rf"\[({unit})[\];,]|\[[^\]]*\b({unit})\b", meaning), f"{name}: {argument}: {meaning}"
    for error in re.findall(r"^    (\w+): ", sections.get("Raises", ""), flags=re.MULTILINE):
        assert hasattr(kiks.errors, error) or hasattr(builtins, error), f"{name}: {error}"
