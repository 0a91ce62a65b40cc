"""Every public name is explained: an example that runs, shapes of arrays, units, and errors that exist."""

from __future__ import annotations

import builtins
import dataclasses
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests import forked

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


@pytest.mark.parametrize("name", sorted((NAMES | CALLABLES).keys() - CONSTANTS))
def test_every_name_has_an_example(name: str) -> None:
    # `--doctest-modules` runs them.
    assert ">>> " in ((NAMES | CALLABLES)[name].__doc__ or ""), name


ARRAY = re.compile(r"NDArray|ArrayLike|Floats|Integers")
"""What the annotation of an array contains."""

SHAPE = re.compile(r"\[[\w ,.+]+\]")


def sections_of(name: str) -> dict[str, str]:
    """Return the parts of a docstring by their headings; what stands before the first has the heading ''."""
    text = "\n:\n" + inspect.cleandoc((NAMES | CALLABLES)[name].__doc__ or "")
    return dict(re.findall(r"^([A-Z]\w+|):\n((?:.*\n?)*?)(?=^[A-Z]\w+:\n|\Z)", text, flags=re.MULTILINE))


def entries_of(section: str) -> dict[str, str]:
    return dict(re.findall(r"^    \*{0,2}(\w+): (.*(?:\n {5,}.*)*)", section, flags=re.MULTILINE))


@pytest.mark.parametrize("name", sorted(NAMES.keys() | CALLABLES.keys()))
def test_arrays_have_shapes(name: str) -> None:
    each, sections = (NAMES | CALLABLES)[name], sections_of(name)
    explained = entries_of(sections.get("Args", "")) | entries_of(sections.get("Attributes", ""))
    is_record = dataclasses.is_dataclass(each)
    annotations = getattr(each.__init__ if inspect.isclass(each) and not is_record else each, "__annotations__", {})
    for argument, annotation in annotations.items():
        if ARRAY.search(str(annotation)):
            # A docstring without sections describes arguments and result in its text.
            meaning = sections.get("Returns") if argument == "return" else explained.get(argument)
            assert SHAPE.search(meaning or sections[""]), f"{name}: {argument}"


@pytest.mark.parametrize("name", sorted(NAMES.keys() | CALLABLES.keys()))
def test_quantities_have_units_and_errors_exist(name: str) -> None:
    sections = sections_of(name)
    quantities = entries_of(sections.get("Args", "")) | entries_of(sections.get("Attributes", ""))
    for argument, meaning in quantities.items():
        unit = UNITS.get(argument.rpartition("_")[2])
        if unit and "_" in argument:
            assert re.search(rf"\[({unit})[\];,]|\[[^\]]*\b({unit})\b", meaning), f"{name}: {argument}: {meaning}"
    for error in entries_of(sections.get("Raises", "")):
        assert hasattr(kiks.errors, error) or hasattr(builtins, error), f"{name}: {error}"


@pytest.mark.parametrize("name", MODULES)
def test_a_module_of_names_can_be_imported(name: str) -> None:
    found = forked.run(
        code=f"import kiks.{name}; from kiks.{name} import *; print(dir(kiks.{name})); kiks.{name}.wrong"
    )
    assert found.stdout == f"{dir(MODULES[name])}\n"
    assert "has no attribute 'wrong'" in found.stderr
    assert importlib.import_module(f"kiks.{name}") is MODULES[name]


def test_a_misspelled_name_gets_a_hint() -> None:
    for line, hint in (("kiks.Simulatoin", "Simulation"), ("kiks.measures.contact", "contacts")):
        assert f"Did you mean: {hint!r}?" in forked.run(code=f"import kiks; {line}").stderr


def test_each_object_says_in_one_line_what_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sim = kiks.Simulation(kiks.Arena.load("office"), seed=1)
    with sim.record("run.mcap") as recorder:
        sim.run(1)
    recording, robot = kiks.Recording("run.mcap"), kiks.Khepera(sim.port(1))
    task = kiks.tasks.avoid()
    evolution = kiks.Evolution(task, seed=1, population=4)
    evolution.run(generations=1)
    batch = kiks.Batch(sim.arena, worlds=3)
    rollouts = batch.run(task.controller, [0.0] * 18, seconds=0.1, measures=[kiks.measures.contacts])
    recorded = recording, recording.log, recording.start, recording.project, recording.replay(), recorder
    evolved = evolution, evolution.generations[0], evolution.champion, evolution.archive, evolution.archive.elites[0]
    simulated = sim, sim.arena, sim.spec, sim.port(1), robot, sim.fit(1, "k213"), sim.explain(1, 2), batch, rollouts
    parts = task, task.controller, task.exam, task.sides[0], kiks.measures.contacts, rollouts.table()
    for each in (*recorded, *evolved, *simulated, *parts):
        assert len(repr(each)) < 160, type(each)
        assert not re.search(r"\n| at 0x", repr(each)), type(each)
