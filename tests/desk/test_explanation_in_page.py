"""A page explains readings by the engine in its memory: the same numbers and words as Python, to the last digit."""

import json
import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from tests.at_length import share
from tests.desk.worlds_in_node import ask_about, image_of, node, random_simulation

EXPLAIN = """
import { explainLight, explainProximity, inWords } from "./explanation.js";

printEach((world, asked) => asked.map(([index, sensor, isLight]) => {
  const why = (isLight ? explainLight : explainProximity)(world, world.scene, index, sensor);
  return [why, inWords(why, world.scene.responses)];
}));
"""

WRITE = """
import { readFileSync } from "node:fs";
import { fixed, general } from "./python_numbers.js";

const numbers = new Float64Array(Uint8Array.from(readFileSync("numbers")).buffer);
console.log(JSON.stringify(Array.from(numbers, (x) => [fixed(x, 0), fixed(x, 1), general(x)])));
"""


@pytest.mark.slow
def test_explanations_of_the_page_equal_those_of_python(tmp_path: Path) -> None:
    worlds, expected, rng = [], [], np.random.default_rng(7)
    for _ in range(share(10, 50)):
        sim = random_simulation(rng)
        asked = [[int(rng.integers(sim.robot_count)), int(rng.integers(8)), k % 2] for k in range(20)]
        explained = [
            (sim.explain_light if is_light else sim.explain)(index + 1, sensor) for index, sensor, is_light in asked
        ]
        expected.append([[asdict(why), why.text()] for why in explained])
        worlds.append(image_of(sim) | {"asked": asked})
    # JSON has neither infinity nor NaN.
    assert ask_about(worlds, EXPLAIN, tmp_path) == json.loads(json.dumps(expected), parse_constant=str)


def test_the_page_writes_numbers_as_python_does(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    halves = [
        *rng.integers(-4000, 4000, 2000) / 2,
        *rng.integers(-4000, 4000, 2000) / 4,
        *rng.integers(0, 10**8, 2000) / 8,
    ]
    others = [*rng.normal(0, 100, 1000), *rng.normal(0, 1, 1000) * 10.0 ** rng.integers(-9, 12, 1000)]
    ends = [
        0.0,
        -0.0,
        -0.04,
        math.inf,
        -math.inf,
        math.nan,
        0.0001,
        0.00009999995,
        999999.5,
        99999.95,
        123456.5,
        1234565.0,
    ]
    numbers = np.array([*halves, *others, *ends])
    numbers.tofile(tmp_path / "numbers")
    assert node(WRITE, tmp_path) == [[f"{x:.0f}", f"{x:.1f}", f"{x:g}"] for x in numbers.tolist()]
