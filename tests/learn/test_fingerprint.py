"""Laws of fingerprints: they differ if and only if something differs on which values depend."""

import functools
import itertools
import json
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from tests import forked

import kiks
from kiks.learn.evaluation import _evaluate_chunk, _identity
from kiks.learn.fingerprint import differing, fingerprints
from kiks.model.robot import RobotSpec


def of(value: object) -> str:
    return fingerprints({"": value})[""]


def defined(code: str, name: str = "f") -> Any:
    """Return what code defines, as in a file of its own."""
    names: dict[str, Any] = {"__name__": "own"}
    exec(code, names)
    return names[name]


HELPED = """
GAIN = 2.0
def helper(values):
    return [GAIN * value for value in values if value in {"left", "right", 2}]
def f(values, power=2):
    return helper(values) ** power
"""


def changed(*pairs: tuple[str, str]) -> str:
    """Return the fingerprint of the code with changes."""
    code = HELPED
    for now, then in pairs:
        assert now in code
        code = code.replace(now, then)
    return of(defined(code))


def test_lines_comments_and_what_is_not_used_do_not_count() -> None:
    doc = ("    return [", '    """Return much."""\n    return [')
    comment = ("    return [", "    # slowly\n    return [")
    assert changed() == of(defined(HELPED)) == changed(("GAIN = 2.0", "\n\n\nGAIN = 2.0"), comment)
    assert changed() == changed(("GAIN = 2.0", "import math\nGAIN = 2.0"), doc)
    assert changed() == changed(("GAIN = 2.0", "GAIN = 1 + 1.0"), ("value for", "value\nfor"))


def test_code_constants_and_defaults_count_however_deep() -> None:
    assert changed(("GAIN * value for", "GAIN + value for")) != changed()
    for gain in ("GAIN = 2", "GAIN = 3.0", "def GAIN(): return 2.0"):
        assert changed(("GAIN = 2.0", gain)) != changed(), gain
    assert changed(("power=2", "power=3")) != changed()
    assert changed(('"left"', '"lift"')) != changed()
    assert changed(("f(values, power=2)", "f(values, *power)")) != changed()


class Scaled:
    """A callable object."""

    def __init__(self, scale: float) -> None:
        self.scale = scale

    def __call__(self, values: Any) -> Any:
        return self.scale * values


def scaled(scale: float) -> Callable[[Any], Any]:
    return lambda values: scale * values


def decorated(scale: float) -> Any:
    @functools.wraps(np.mean)
    def mean(values: Any) -> Any:
        return scale * np.mean(values)

    return mean


KINDS: dict[str, Callable[[float], Any]] = {
    "closure": scaled,
    "partial": lambda scale: functools.partial(np.multiply, scale),
    "callable object": Scaled,
    "method": lambda scale: Scaled(scale).__call__,
    "cached": lambda scale: functools.lru_cache(scaled(scale)),
    "vectorized": lambda scale: np.vectorize(scaled(scale)),
    "compiled": lambda scale: numba.njit(scaled(scale)),
    "named like a library's": decorated,
    "array": lambda scale: np.arange(3) * scale,
    "list": lambda scale: [scale],
    "measure": lambda scale: kiks.measures.goal_mm(scale, 300),
    "result of a measure": lambda scale: kiks.measures.coverage(kiks.Arena.box(500 * scale, 500)),
    "controller": lambda scale: kiks.controllers.mlp(hidden=(int(scale),)),
    "speed limit": lambda scale: kiks.controllers.plastic(speed_limit=scale),
    "random state": lambda scale: np.random.default_rng(int(scale)),
    "robot": lambda scale: RobotSpec.load("khepera").with_changes(motor__left_gain=1 / scale),
}


@pytest.mark.parametrize("make", KINDS.values(), ids=KINDS)
def test_what_a_function_holds_counts(make: Callable[[float], Any]) -> None:
    assert of(make(1.0)) == of(make(1.0)) != of(make(2.0))


def test_different_things_differ_and_equal_ones_are_equal_whether_they_are_one_or_two() -> None:
    numbers = [1, 1.0, "1", True, None, (1,), [1], {1: 1}, {1}]
    things = [*numbers, np.mean, np.sum, len, int, kiks, np, of, Scaled, Scaled(1)]
    assert all(of(one) != of(other) for one, other in itertools.combinations(things, 2))
    one, two = [1.5], [1.5]
    assert of([one, one]) == of([one, two])


def test_what_a_task_says_of_itself_does_not_count() -> None:
    task = kiks.tasks.avoid(seconds=1)
    named = tuple(replace(arena, name="other") for arena in task.arenas)
    other = task.with_changes(arenas=named, file="other.py", population=9, seconds=1.0)
    assert other.digest() == task.digest()
    assert differing(task.with_changes(robot="khepera_ii").digest(), task.digest()) == "robot"
    assert differing(task.with_changes(exam=None, fitness=None).digest(), task.digest()) == "fitness, exam"


def own_task(home: Path, helper: str, seed: str = "") -> Any:
    """Return the digest of a task whose file imports a helper beside it, in another process, maybe with a hash seed."""
    home.mkdir(exist_ok=True)
    (home / "helper.py").write_text(helper)
    (home / "task.py").write_text(TASK)
    # Compiled, a helper of the same size in the same second would be the one before.
    code = "import sys\nsys.dont_write_bytecode = True\nimport kiks, json\n"
    code += f"print(json.dumps(kiks.tasks.load({str(home / 'task.py')!r}).digest()))"
    if seed:
        surroundings = {**os.environ, "PYTHONHASHSEED": seed}
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, env=surroundings, capture_output=True, text=True, check=False)
    else:
        done = forked.run(code=code)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


TASK = """
import pathlib, sys
sys.path.insert(0, str(pathlib.Path(__file__).parent))
import kiks, helper
GAIN = helper.GAIN

@kiks.controller(parameters=2)
def drive(sensors, memory, parameters, wheels):
    wheels[0] = GAIN * parameters[0]
    wheels[1] = parameters[1] if sensors[0] in (1, 2) else 0.0

def fitness(values):
    from helper import counted
    if task.seconds > 3 and set(values) & {"path_mm", "net_mm", "contacts"}:
        return helper.score(values["path_mm"])
    return counted(values)

task = kiks.Task("own", [kiks.Arena.box(400, 400)], drive, [kiks.measures.path_mm], fitness, seconds=1)
"""
HELPER = "GAIN = 1.0\nWEIGHT = 2.0\nOTHER = 3\ndef score(x): return WEIGHT * x\ndef counted(x): return len(x)\n"


@pytest.mark.slow
def test_a_helper_beside_a_task_counts_and_its_folder_and_process_do_not(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    first = own_task(here, HELPER, "2")
    assert own_task(there, HELPER) == first
    assert differing(own_task(there, HELPER.replace("GAIN = 1.0", "GAIN = 0.0")), first) == "controller, fitness"
    assert differing(own_task(there, HELPER.replace("2.0", "3.0")), first) == "fitness"
    assert differing(own_task(there, HELPER.replace("len", "sum")), first) == "fitness"


def test_a_sense_counts_the_same_when_it_was_used() -> None:
    @kiks.sense(command="N", readings=8, most=1023.0)
    def dark(view: Any, readings: Any) -> None:
        readings[0] = 0.0

    one = of(kiks.controllers.linear(senses=(dark,)))
    vars(dark)["address"] = 1  # as the first use keeps it
    assert of(kiks.controllers.linear(senses=(dark,))) == one


USES = {
    "a function through another module": "import passing\ndef f(x): return passing.score(x)",
    "a constant through another module": "import passing\ndef f(x): return passing.WEIGHT * x",
    "a module of a package": "import package.inner\ndef f(x): return package.inner.score(x)",
    "a module of a folder": "import folder.inner\ndef f(x): return folder.inner.score(x)",
    "an import in the function": "def f(x):\n    import passing\n    return passing.score(x)",
    "its code beside a missing module": "def f(x):\n    try: import missing\n    except ImportError: return WEIGHT * x",
}
MODULES = {
    "passing.py": "from origin import WEIGHT, score",
    "origin.py": "WEIGHT = 2.0\ndef score(x): return 2.0 * x",
    "package/__init__.py": "",
    "package/inner.py": "def score(x): return 2.0 * x",
    "folder/inner.py": "def score(x): return 2.0 * x",
}


@pytest.mark.parametrize("code", USES.values(), ids=USES)
def test_what_a_function_reaches_through_modules_counts(
    code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def made(folder: Path, weight: str) -> str:
        for name, text in MODULES.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text.replace("2.0", weight))
        with monkeypatch.context() as patch:
            patch.syspath_prepend(folder)
            for name in ("passing", "origin", "package.inner", "package", "folder.inner", "folder"):
                patch.delitem(sys.modules, name, raising=False)
            return of(defined(f"WEIGHT = {weight}\n{code}"))

    first = made(tmp_path / "first", "2.0")
    assert made(tmp_path / "same", "2.0") == first != made(tmp_path / "other", "3.0")


@pytest.mark.slow
def test_a_worker_gets_what_was_sent_or_says_what_differs() -> None:
    code = (
        "import pickle, sys\nfrom kiks.learn.evaluation import _identity\n"
        "for work, identity in pickle.load(sys.stdin.buffer):\n    assert _identity(work) == identity\n"
    )
    arena = kiks.Arena.box(400, 400)
    own = kiks.Task("own", [arena], kiks.controllers.linear(), [kiks.measures.path_mm], scaled(2.0))
    sent = [(work, _identity(work)) for work in (own, kiks.tasks.follow(), kiks.tasks.pursuit())]
    subprocess.run([sys.executable, "-c", code], input=pickle.dumps(sent), check=True)
    with pytest.raises(kiks.ParameterError, match=r"the same modules of yours, but on one these differ: fitness\."):
        _evaluate_chunk(own, _identity(own) | {"fitness": "0"}, np.zeros((1, 18)), np.zeros(1, np.int64))
