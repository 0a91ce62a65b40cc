"""Every public name is explained: an example that runs, shapes of arrays, units, and errors that exist."""

import builtins
import dataclasses
import functools
import importlib
import inspect
import re
from pathlib import Path
from typing import Any

import pytest
from tests import forked

import kiks.errors

MODULES = ("controllers", "measures", "tasks")
CONSTANTS = {"__version__", "tasks.TASKS"}
"""Names of values, which have no docstring of their own."""

UNITS = {"mm": "mm", "s": "s", "rad": "rad", "deg": "degrees?|deg", "ms": "ms", "w": "W", "baud": "bit/s"}
"""For the end of an argument's name its unit as texts have it."""

ARRAY = re.compile(r"NDArray|ArrayLike|Floats|Integers")
"""What the annotation of an array contains."""

SHAPE = re.compile(r"\[[\w ,.+]+\]")


@functools.cache
def public() -> dict[str, Any]:
    """Return all public names with their objects, and the public methods and properties of public classes."""
    from kiks.learn.gymnasium_envs import KheperaEnv, KheperaVectorEnv
    from kiks.learn.pettingzoo_env import KheperaTeam

    names = {name: getattr(kiks, name) for name in kiks.__all__ if name not in MODULES}
    for module in MODULES:
        names |= {f"{module}.{name}": getattr(getattr(kiks, module), name) for name in dir(getattr(kiks, module))}
    names |= {each.__name__: each for each in (KheperaEnv, KheperaVectorEnv, KheperaTeam)}
    for name, each in list(names.items()):
        for member, found in vars(each).items() if inspect.isclass(each) else ():
            inner = found.fget if isinstance(found, property) else getattr(found, "__func__", found)
            if not member.startswith("_") and inspect.isfunction(inner):
                names[f"{name}.{member}"] = inner
    return names


def is_property(name: str) -> bool:
    owner, _, member = name.rpartition(".")
    return isinstance(vars(public().get(owner, object)).get(member), property)


def is_method(name: str) -> bool:
    return inspect.isclass(public().get(name.rpartition(".")[0]))


def is_shown_by_its_class(name: str) -> bool:
    """Return whether the example of a method's class calls it."""
    owner, _, member = name.rpartition(".")
    return f".{member}(" in sections_of(public().get(owner)).get("Example", "")


def sections_of(each: Any) -> dict[str, str]:
    """Return the parts of a docstring by their headings; what stands before the first has the heading ''."""
    text = "\n:\n" + inspect.cleandoc(each.__doc__ or "")
    return dict(re.findall(r"^([A-Z]\w+|):\n((?:.*\n?)*?)(?=^[A-Z]\w+:\n|\Z)", text, flags=re.MULTILINE))


def entries_of(sections: dict[str, str], *headings: str) -> dict[str, str]:
    text = "\n".join(sections.get(heading, "") for heading in headings)
    return dict(re.findall(r"^    \*{0,2}(\w+): (.*(?:\n {5,}.*)*)", text, flags=re.MULTILINE))


def test_every_name_has_an_example() -> None:
    # `--doctest-modules` runs them. The name of a property and of a method without arguments to explain says enough,
    # beside the example of its class; all measures are used alike.
    without = {name for name, each in public().items() if ">>> " not in (each.__doc__ or "")}
    without -= {name for name in without if is_shown_by_its_class(name)}
    without -= {name for name in without if is_method(name) and "Args" not in sections_of(public()[name])}
    without -= {name for name in without if is_property(name) or name.startswith("measures.")}
    without ^= CONSTANTS
    assert not without, "\n".join(without)


def test_arrays_have_shapes_and_quantities_have_units_and_errors_exist() -> None:
    wrong = []
    for name, each in public().items():
        sections = sections_of(each)
        explained = entries_of(sections, "Args", "Attributes")
        is_record = dataclasses.is_dataclass(each)
        annotations = getattr(each.__init__ if inspect.isclass(each) and not is_record else each, "__annotations__", {})
        for argument, annotation in annotations.items():
            # A docstring without sections describes arguments and result in its text.
            meaning = sections.get("Returns") if argument == "return" else explained.get(argument)
            if ARRAY.search(str(annotation)) and not SHAPE.search(meaning or sections[""]):
                wrong.append(f"{name}: {argument}: no shape")
        for argument, meaning in explained.items():
            unit = UNITS.get(argument.rpartition("_")[2]) if "_" in argument else None
            if unit and not re.search(rf"\[({unit})[\];,]|\[[^\]]*\b({unit})\b", meaning):
                wrong.append(f"{name}: {argument}: no unit in {meaning!r}")
        for error in entries_of(sections, "Raises"):
            if not (hasattr(kiks.errors, error) or hasattr(builtins, error)):
                wrong.append(f"{name}: no {error}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", MODULES)
def test_a_module_of_names_can_be_imported(name: str) -> None:
    code = f"import kiks.{name}; from kiks.{name} import *; print(dir(kiks.{name})); kiks.{name}.wrong"
    found = forked.run(code=code)
    assert found.stdout == f"{dir(getattr(kiks, name))}\n"
    assert "has no attribute 'wrong'" in found.stderr
    assert importlib.import_module(f"kiks.{name}") is getattr(kiks, name)


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
