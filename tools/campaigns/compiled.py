"""Controllers and measures with random slips: each run has the values of plain Python, or ends in a line.

A case is a function of a few statements, whose indices are right or wrong. It runs on arrays as plain Python and
compiled, and in a batch of one world and of three: what a world does may not depend on its neighbours.
"""

from __future__ import annotations

import linecache
import random
from collections.abc import Callable, Iterator
from typing import Any

import numba
import numpy as np
from tools.campaigns.runner import Broken, Campaign, Play

import kiks
from kiks.errors import KiksError

CASES = 400

SECONDS = 0.5
"""Simulated time of a run [s]."""

INDICES = ("0", "1", "2", "7", "8", "-1", "-3", "10**9", "k", "k + 1", "-k", "int(sensors[0]) % 9", "int(memory[0])")

FORMS = (
    "{to}[{i}] = {of}[{j}] * 0.25",
    "{to}[{i}] += 1.0",
    "{to}[{i}] = helper({of}, {j})",
    "{to}[{i}:] = {of}[{j}]",
    "if {of}[{j}] > 2.0: {to}[{i}] = 3.0",
    "for m in range({j} % 9): {to}[m] = {of}[m]",
)


@numba.njit  # type: ignore[misc, unused-ignore]
def helper(numbers: Any, index: Any) -> Any:
    """Return a number of an array, as a user's helper does."""
    return numbers[index]


def _source(rng: random.Random) -> str:
    """Return the source of a controller."""
    arrays = ("sensors", "memory", "parameters", "wheels")
    lines = []
    for _ in range(rng.randint(1, 3)):
        form = rng.choice(FORMS)
        i, j = rng.choice(INDICES), rng.choice(INDICES)
        lines.append(form.format(to=rng.choice(arrays[1:]), of=rng.choice(arrays), i=i, j=j))
    body = "\n        ".join(lines)
    return (
        f"def decide(sensors, memory, parameters, wheels):\n    for k in range({rng.randint(1, 3)}):\n        {body}\n"
    )


def _function(source: str, helper: Callable[..., Any]) -> Callable[..., Any]:
    path = f"<decides {hash(source)}>"
    linecache.cache[path] = len(source), None, source.splitlines(keepends=True), path
    space: dict[str, Any] = {"helper": helper, "__name__": "decides"}
    exec(compile(source, path, "exec"), space)
    function: Callable[..., Any] = space["decide"]
    return function


def _on_arrays(decide: Callable[..., Any], rng: random.Random) -> list[bytes] | None:
    """Return what a function makes of arrays; None if it says that an index is wrong."""
    draw = np.random.default_rng(rng.getrandbits(32))
    arrays = [draw.integers(0, 9, size).astype(float) for size in (8, 2, 3, 2)]
    try:
        decide(*arrays)
    except (IndexError, KiksError):
        return None
    return [each.tobytes() for each in arrays]


def _play(rng: random.Random) -> int | None:
    source, seed = _source(rng), rng.getrandbits(32)
    controller = kiks.Controller(_function(source, helper), memory=2, parameters=3)
    in_python = _function(source, helper.py_func)
    plain, compiled = (_on_arrays(each, random.Random(seed)) for each in (in_python, controller))
    if plain != compiled:
        raise Broken("lost", f"compiled and plain Python differ for\n{source}", "differs from Python")
    found = []
    for worlds in (1, 3):
        batch = kiks.Batch(kiks.Arena.box(400, 400), worlds=worlds, seed=seed % 1000, threads=1)
        try:
            values = batch.run(controller, [1.0, 2.0, 3.0], seconds=SECONDS, measures=[kiks.measures.path_mm]).values
            found.append((values[0].tobytes(), batch.state_hash(0)))
        except KiksError as error:
            if "\n" in str(error):
                raise Broken("message", str(error), "several lines") from None
            found.append(None)
    # One of three worlds may go wrong where the first does not.
    if None not in found and found[0] != found[1]:
        raise Broken("lost", f"a world depends on its neighbours for\n{source}", "depends on its neighbours")
    return None if None in found else 3


def _prepared() -> Play:
    kiks.Batch(kiks.Arena.box(400, 400), worlds=1).run(kiks.controllers.linear(), [0.0] * 18, seconds=0.1)
    return _play


def campaigns() -> Iterator[Campaign]:
    """Yield the only one."""
    yield Campaign("compiled.slips", CASES, _prepared, limit_s=60.0)
