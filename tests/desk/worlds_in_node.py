"""Worlds for the page's modules in node: random ones, and their images in the engine's memory."""

import base64
import json
import subprocess
from contextlib import suppress
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import playwright
from numpy.typing import NDArray

from kiks import Arena, ParameterError, Simulation
from kiks.desk.panels.widgets import WEB
from kiks.engine.scene import SCENE
from kiks.export.browser_engine import ENGINE
from kiks.export.frames import describe_scene
from kiks.model.robot import RESPONSES, RobotSpec

NODE = Path(playwright.__file__).parent / "driver" / "node"

WORLDS = """
import { readFileSync } from "node:fs";
import { loadEngine } from "./engine.js";

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
const worlds = JSON.parse(readFileSync("worlds.json", "utf-8"));

/** Print what a function makes of each world, alone in memory, and of what is asked of it. */
function printEach(make) {
  const found = worlds.map(({ image, asked, ...known }) => {
    const top = engine.top, made = make({ engine, record: load(engine, image), ...known }, asked);
    engine.release(top);
    return made;
  });
  console.log(JSON.stringify(found, written));
}
"""
"""The beginning of a program that is asked about worlds (`ask_about`)."""


def ask_about(worlds: list[dict[str, Any]], script: str, folder: Path) -> Any:
    """Return what a program says of worlds (`image_of`): what stands behind `WORLDS`."""
    folder.mkdir(exist_ok=True)
    (folder / "worlds.json").write_text(json.dumps(worlds), "utf-8")
    return node(WORLDS + script, folder, ENGINE)


def node(script: str, folder: Path, *arguments: object) -> Any:
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


def image_of(sim: Simulation) -> dict[str, Any]:
    """Return a world as a page has it: the record of its scene, and its arrays by the places of their addresses."""
    arrays = {SCENE.fields[name][1]: array for name, array in sim.world.arrays.items()}
    image = {
        "record": base64.b64encode(sim.world.scene.tobytes()).decode(),
        "arrays": {place: base64.b64encode(array.tobytes()).decode() for place, array in arrays.items()},
    }
    return {
        "image": image,
        "tick": sim.world.state.tick_count,
        "time_ns": sim.now_ns,
        "lampCount": len(sim.lamps),
        "scene": describe_scene(sim, 0),
    }
