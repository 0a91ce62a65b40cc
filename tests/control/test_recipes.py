"""Recipes: what a file says of a controller makes the same one again."""

import json
import runpy
from pathlib import Path
from typing import Any

import pytest
from tests.learn.small import SHY, refused

import kiks


@pytest.mark.parametrize(
    "controller",
    [
        kiks.controllers.linear(speed_limit=5, feedback=True),
        kiks.controllers.mlp(hidden=[4, 3], senses=("ambient", "proximity")),
        kiks.controllers.ctrnn(neurons=3, period_s=0.05, time_constant_s=1.0),
        kiks.controllers.gru(units=5, senses="ambient"),
        kiks.controllers.elman(units=2, speed_limit=3),
        kiks.controllers.plastic(neurons=2, per="neuron"),
        kiks.controllers.policy(hidden=(3,), activation="relu"),
    ],
    ids=lambda each: each.name,
)
def test_the_same_again(controller: kiks.Controller) -> None:
    recipe = json.loads(json.dumps(controller.recipe))
    assert kiks.controllers.from_recipe(recipe) is controller
    assert recipe["kind"] == controller.name


def test_a_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(SHY)
    made = runpy.run_path(str(path), run_name="__main__")["shy"]
    assert made.recipe == {"function": f"{path}:shy"}
    recipe = kiks.controllers.recipe_for(made, tmp_path)
    assert recipe == {"function": "mine.py:shy"}
    found = kiks.controllers.from_recipe(recipe, tmp_path)
    assert (found.name, found.memory_count, found.parameter_count) == ("shy", 2, 1)
    assert kiks.controllers.from_recipe(recipe, tmp_path) is found
    assert found.recipe == made.recipe
    elsewhere = kiks.controllers.recipe_for(made, tmp_path / "deeper")
    assert elsewhere == made.recipe
    refused("must lead to a file in the", kiks.controllers.from_recipe, elsewhere, tmp_path)


def test_a_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "kiks_recipe_mine.py").write_text(SHY)
    monkeypatch.syspath_prepend(str(tmp_path))
    recipe = {"function": "kiks_recipe_mine:shy"}
    found = kiks.controllers.from_recipe(recipe)
    assert found.recipe == recipe
    assert kiks.controllers.recipe_for(found, tmp_path) == recipe


def test_a_controller_or_sense_inside_a_function_cannot_be_named() -> None:
    @kiks.controller
    def inner(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        wheels[0] = 1.0

    assert inner.recipe is None
    refused("'inner' must be defined at the top of a module or file", kiks.controllers.recipe_for, inner)

    @kiks.sense(command="N", readings=8, most=1023)
    def inner(view: Any, readings: Any) -> None:
        readings[:] = 0.0

    with pytest.raises(kiks.ParameterError, match=r"senses must be defined at the top of a module or file.* of inner"):
        kiks.controllers.recipe_for(kiks.controllers.linear(senses=(inner,)))


def test_wrong_recipes_are_errors(tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "folder", tmp_path / "elsewhere"
    for place in (elsewhere, folder / ".git"):
        place.mkdir(parents=True)
        (place / "mine.py").write_text(SHY)
    for name in ("mine.py", "mine.txt"):
        (folder / name).write_text(SHY)
    (folder / "bad.py").write_text("1 / 0\n")
    (folder / "link.py").symlink_to(elsewhere / "mine.py")
    for recipe, message in (
        ("mlp", "must be a table with a kind .* or a function, but it was 'mlp'"),
        ({}, "must be a table with a kind .* or a function, but it was {}"),
        ({"function": 3}, "function must be 'package.module:name' or 'file.py:name', but it was 3"),
        ({"kind": "mpl"}, "Did you mean 'mlp'"),
        ({"kind": ["mlp"]}, "must be one of 'linear'"),
        ({"kind": "mlp", "hiden": [3]}, "but it has 'hiden'. Did you mean 'hidden'"),
        ({"function": "shy"}, "function must be 'package.module:name' or 'file.py:name', but it was 'shy'"),
        ({"function": "no_such_module_here:shy"}, "module 'no_such_module_here' must be one that Python can import"),
        ({"function": "kiks.errors:shy"}, "the module 'kiks.errors' must define 'shy', but does not"),
        ({"function": "kiks.meant:nearest"}, "must name a controller, but it names <function nearest"),
        ({"function": "nowhere.py:shy"}, "must be a Python file that runs, but it raised FileNotFoundError"),
        ({"function": "mine.py:shi"}, "must define 'shi', but does not. Did you mean 'shy'"),
        ({"function": "mine.py:plain"}, "Write @kiks.controller over the function"),
        ({"function": "mine.txt:shy"}, "module 'mine.txt' must be one that Python can import"),
        ({"function": "bad.py:shy"}, r"must be a Python file that runs, but it raised ZeroDivisionError\("),
        ({"function": ".git/mine.py:shy"}, "in no folder whose name begins with a dot, but it was '.git/mine.py'"),
        ({"function": "../mine.py:shy"}, "must lead to a file in the"),
        ({"function": "link.py:shy"}, "must lie in the folder of the file that names it"),
    ):
        refused(message, kiks.controllers.from_recipe, recipe, folder)
