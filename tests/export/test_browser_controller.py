"""A controller for the engine of a page: its module shares the engine's memory."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.desk.worlds_in_node import node

import kiks
from kiks import RobotSpec, Timing
from kiks.export.browser_controller import describe_controller
from kiks.export.browser_engine import ENGINE

TABLE = np.sqrt(np.arange(1.0, 65.0))

ADD = """
import { readFileSync } from "node:fs";
import { loadEngine } from "./engine.js";

const engine = await loadEngine(readFileSync(process.argv[2])), before = engine.bytes(0, engine.about.end).slice();
const added = await engine.add(Uint8Array.from(Buffer.from(readFileSync("module", "utf-8"), "base64")));
const isEqual = engine.bytes(0, engine.about.end).every((byte, k) => byte === before[k]);
console.log(JSON.stringify([Object.keys(added).includes("decide"), isEqual]));
"""


@kiks.controller(parameters=1)
def by_table(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[0] = wheels[1] = TABLE[int(sensors[0]) % 64] * parameters[0]


@pytest.mark.slow
def test_a_module_leaves_the_data_of_the_engine_alone(tmp_path: Path) -> None:
    made = describe_controller(by_table, [0.5], RobotSpec.load("khepera"), Timing(period_s=0.05, baud=None), "By table")
    json.dumps(made, allow_nan=False)
    assert TABLE.tobytes() in base64.b64decode(made["module"])
    (tmp_path / "module").write_text(made["module"], "utf-8")
    assert node(ADD, tmp_path, ENGINE) == [True, True]
