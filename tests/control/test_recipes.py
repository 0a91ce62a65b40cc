"""Recipes: what a file says of a controller makes the same one again."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import pytest

import kiks

SHY = """
import kiks

@kiks.controller(memory=2, parameters=1)
def shy(sensors, memory, parameters, wheels):
    wheels[0] = wheels[1] = 5.0 - parameters[0] * sensors[2]

def plain(sensors):
    pass
"""


@pytest.mark.parametrize(
    "controller",
    [
        kiks.controllers.linear(speed_limit=5, feedback=True),
        kiks.controllers.mlp(hidden=[4, 3], senses=("ambient", "proximity")),
        kiks.controllers.ctrnn(neurons=3, period_s=0.05, time_constant_s=1.0),
        kiks.controllers.gru(units=5, senses="ambient"),
    ],
    ids=lambda each: each.name,
)
def test_the_same_again(controller: kiks.Controller) -> None:
    assert controller.recipe is not None
    recipe = json.loads(json.dumps(controller.recipe))
    assert kiks.controllers.from_recipe(recipe) is controller
    assert recipe["kind"] == controller.name


def test_a_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(SHY)
    made = runpy.run_path(str(path), run_name="__main__")["shy"]
    assert made.recipe == {"file": str(path), "name": "shy"}
    recipe = kiks.controllers.recipe_for(made, tmp_path)
    assert recipe == {"file": "mine.py", "name": "shy"}
    found = kiks.controllers.from_recipe(recipe, tmp_path)
    assert (found.name, found.memory_count, found.parameter_count) == ("shy", 2, 1)
    assert kiks.controllers.from_recipe(recipe, tmp_path) is found
    assert found.recipe == made.recipe
    elsewhere = kiks.controllers.recipe_for(made, tmp_path / "deeper")
    assert elsewhere == made.recipe
    assert kiks.controllers.from_recipe(elsewhere) is found


def test_a_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "kiks_recipe_mine.py").write_text(SHY)
    monkeypatch.syspath_prepend(str(tmp_path))
    recipe = {"function": "kiks_recipe_mine:shy"}
    found = kiks.controllers.from_recipe(recipe)
    assert found.recipe == recipe
    assert kiks.controllers.recipe_for(found, tmp_path) == recipe


def test_nobody_finds_what_is_inside_a_function() -> None:
    @kiks.controller
    def inner(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        wheels[0] = 1.0

    assert inner.recipe is None
    with pytest.raises(kiks.ParameterError, match="'inner' must be defined at the top of a module or file"):
        kiks.controllers.recipe_for(inner)


@pytest.mark.parametrize(
    ("recipe", "message"),
    [
        ("mlp", "a recipe must be a table"),
        ({}, "a recipe must have a kind, or a function, or a file and a name, but it had nothing"),
        ({"file": "mine.py"}, "but it had file"),
        ({"file": "mine.py", "name": 3}, "texts for function, file and name"),
        ({"kind": "mpl"}, "kind in a recipe must be one of linear, mlp, ctrnn, gru, but it was 'mpl'. Did you mean"),
        ({"kind": ["mlp"]}, "kind in a recipe must be one of"),
        ({"kind": "mlp", "hiden": [3]}, "but it had 'hiden'. Did you mean 'hidden'"),
        ({"kind": "mlp", "hidden": [3.5]}, "hidden units must be a whole number"),
        ({"function": "shy"}, "function in a recipe must be 'module:name'"),
        ({"function": "no_such_module_here:shy"}, "module 'no_such_module_here' must be one that Python can import"),
        ({"function": "kiks.errors:shy"}, "the module 'kiks.errors' must define 'shy', but does not"),
        ({"function": "kiks.errors:nearest"}, "must name a controller, but it names <function nearest"),
        ({"file": "nowhere.py", "name": "shy"}, "the recipe's file must exist, but there was none at .*nowhere.py"),
        ({"file": "mine.py", "name": "shi"}, "must define 'shi', but does not. Did you mean 'shy'"),
        ({"file": "mine.py", "name": "plain"}, "Write @kiks.controller over the function"),
        ({"file": "mine.txt", "name": "shy"}, "must be a Python program"),
    ],
)
def test_what_is_no_recipe(recipe: Any, message: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(SHY)
    (tmp_path / "mine.txt").write_text(SHY)
    with pytest.raises(kiks.ParameterError, match=message):
        kiks.controllers.from_recipe(recipe, tmp_path)
