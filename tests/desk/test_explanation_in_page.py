"""A page explains readings by the engine in its memory: the same numbers and words as Python, to the last digit."""

import base64
import json
import math
import subprocess
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from shutil import copytree

import numpy as np
import playwright
import pytest
from numpy.typing import NDArray
from tests.at_length import share

from kiks import Arena, ParameterError, Simulation, engine
from kiks.desk.panels.widgets import WEB
from kiks.engine.scene import SCENE
from kiks.export.frames import describe_scene
from kiks.model.robot import RESPONSES, RobotSpec

ENGINE = Path(engine.__file__).parent / "engine.wasm"
NODE = Path(playwright.__file__).parent / "driver" / "node"

EXPLAIN = """
import { readFileSync } from "node:fs";
import { loadEngine } from "./engine.js";
import { explainLight, explainProximity, inWords } from "./explanation.js";

const bytesOf = (text) => Uint8Array.from(Buffer.from(text, "base64"));

/** Put a scene into memory, and the addresses of its arrays into its record. */
function load(engine, image) {
  const record = bytesOf(image.record), view = new DataView(record.buffer);
  for (const [place, text] of Object.entries(image.arrays)) {
    const bytes = bytesOf(text), at = engine.allocate(bytes.length);
    engine.bytes(at, bytes.length).set(bytes);
    view.setBigInt64(Number(place), BigInt(at), true);
  }
  const held = engine.array(record.length, [1]);
  engine.bytes(held.at, record.length).set(record);
  return held;
}

const written = (name, value) => (typeof value !== "number" || Number.isFinite(value) ? value : String(value));
const engine = await loadEngine(readFileSync(process.argv[2]));
const found = JSON.parse(readFileSync("worlds.json", "utf-8")).map(({ image, asked, ...known }) => {
  const top = engine.top, world = { engine, record: load(engine, image), ...known };
  const explained = asked.map(([index, sensor, isLight]) => {
    const why = (isLight ? explainLight : explainProximity)(world, index, sensor);
    return [why, inWords(why, known.scene.responses)];
  });
  engine.release(top);
  return explained;
});
console.log(JSON.stringify(found, written));
"""

WRITE = """
import { readFileSync } from "node:fs";
import { fixed, general } from "./python_numbers.js";

const numbers = new Float64Array(Uint8Array.from(readFileSync("numbers")).buffer);
console.log(JSON.stringify(Array.from(numbers, (x) => [fixed(x, 0), fixed(x, 1), general(x)])));
"""


def node(script: str, folder: Path, *arguments: object) -> object:
    """Return what a program prints in JSON that has the desk's modules beside it."""
    copytree(WEB, folder, dirs_exist_ok=True)
    (folder / "package.json").write_text('{"type": "module"}', "utf-8")
    (folder / "program.js").write_text(script, "utf-8")
    command = [NODE, "program.js", *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def random_simulation(rng: np.random.Generator) -> Simulation:
    """Return some robots on their way among walls of all greys, things and lamps."""
    cells: NDArray[np.uint8] = np.zeros((300, 380), np.uint8)
    cells[:10], cells[-10:], cells[:, :10], cells[:, -10:] = rng.integers(1, 256, 4)[:, None, None]
    for _ in range(4):
        x, y = rng.integers(20, 340), rng.integers(20, 270)
        cells[y : y + rng.integers(2, 25), x : x + rng.integers(2, 25)] = rng.integers(1, 256)
    response = str(rng.choice(RESPONSES))
    kinds = {"curve": "khepera_ii", "reflection": str(rng.choice(["khepera", "epuck"]))}
    kind = RobotSpec.load(kinds.get(response, "khepera"), response=response)
    kind = kind.with_changes(proximity__gain=rng.choice([1.0, 0.75, 1.23456789], 8).tolist())
    sim = Simulation(Arena.from_array(cells), robots=0, seed=int(rng.integers(1 << 40)))
    for _ in range(rng.integers(1, 5)):
        with suppress(ParameterError):
            sim.add_robot(kind)
    for _ in range(rng.integers(0, 4)):
        x, y = rng.uniform(40, 340), rng.uniform(40, 260)
        sim.add_lamp(*rng.uniform(0, 300, 2), rng.choice([0.5, 1, 2.125, 123456.5]), is_on=bool(rng.random() < 0.8))
        with suppress(ParameterError):
            sim.add_ball(x, y, brightness=int(rng.integers(1, 256)))
            sim.add_cylinder(float(y), float(x))
    for robot in range(1, sim.robot_count + 1):
        sim.port(robot).write(b"D,%d,%d\n" % tuple(rng.integers(-20, 21, 2)))
    sim.run(rng.uniform(0.1, 3.0))
    return sim


def image_of(sim: Simulation) -> dict[str, object]:
    """Return a scene as a page can put it into memory: its record, and its arrays by the places of their addresses."""
    scene = sim.world._scene
    arrays = {SCENE.fields[name][1]: array for name, array in scene._arrays.items()}
    return {
        "record": base64.b64encode(scene.record.tobytes()).decode(),
        "arrays": {place: base64.b64encode(array.tobytes()).decode() for place, array in arrays.items()},
    }


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
        worlds.append({
            "image": image_of(sim), "asked": asked, "tick": sim.world.state.tick_count, "time_ns": sim.now_ns,
            "lampCount": len(sim.lamps), "scene": describe_scene(sim, 0),
        })  # fmt: skip
    (tmp_path / "worlds.json").write_text(json.dumps(worlds), "utf-8")
    found = node(EXPLAIN, tmp_path, ENGINE)
    # JSON has neither infinity nor NaN.
    assert found == json.loads(json.dumps(expected), parse_constant=str)


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
