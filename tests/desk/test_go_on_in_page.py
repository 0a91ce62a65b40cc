"""A page goes on with controllers as a batch does: each robot, to the bit, from a start and from within a recording."""

import base64
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.at_length import share
from tests.desk.worlds_in_node import WORLDS, node

from kiks import Arena, Batch, Controller, Recording, Simulation, Timing, controllers
from kiks.batch.batch import UNLIMITED
from kiks.engine.scene import SCENE, Scene, enter_worlds
from kiks.export.browser_controller import describe_controller
from kiks.export.browser_engine import ENGINE
from kiks.export.page_run import PageRun
from kiks.model.arena import Ball, Lamp
from kiks.model.robot import RobotSpec

GO_ON = """
import { makeDriver } from "./go_on.js";
import { readInputs } from "./engine_inputs.js";
import { EngineWorld } from "./engine_world.js";
import { unpackText } from "./packed_text.js";

const STEPS = 7;
// All are there at once, as on a page.
const drivers = [], runs = [];
for (const { asked } of worlds) {
  drivers.push(await makeDriver(engine, asked.driver));
  runs.push(asked.run ? await unpackText(asked.run) : null);
}

printEach(({ record, image }, { robots, speeds, begin_ns, end_ns }) => {
  const driver = drivers.shift(), run = runs.shift();
  let tick = 0;
  if (run) {
    const world = new EngineWorld(engine, readInputs(run.head.inputs, run.rest));
    world.goTo(begin_ns);
    [record, tick] = [world.record, world.tick];
  }
  driver.begin(record, tick, begin_ns, robots, speeds);
  let made;
  for (let k = 1; k <= STEPS; k++) made = driver.passTo(begin_ns + Math.round(((end_ns - begin_ns) * k) / STEPS));
  const view = new DataView(engine.memory.buffer), at = record.at + engine.about.layouts.SCENE.fields.robots[0];
  const size = engine.about.layouts.ROBOT.size * robots.length;
  return [...made, Buffer.from(engine.bytes(Number(view.getBigInt64(at, true)), size)).toString("base64")];
});
"""

LINE, NO_LINE = Timing(), Timing(period_s=0.05, baud=None)


class Drive(NamedTuple):
    """A controller and the world that it drives in."""

    kind: str
    controller: Controller
    timing: Timing
    robots: int


DRIVES = [
    Drive("khepera", controllers.linear(), LINE, 1),
    Drive("khepera", controllers.linear(), NO_LINE, 2),
    Drive("epuck", controllers.elman(senses=("proximity", "ambient")), LINE, 3),
    Drive("khepera", controllers.collector(), LINE, 1),
    Drive("khepera", controllers.mlp(hidden=(6,)), NO_LINE, 3),
    Drive("khepera", controllers.elman(senses=("proximity", "speeds")), LINE, 2),
    Drive("epuck", controllers.mlp(senses=("ambient", "ground")), NO_LINE, 1),
    Drive("epuck", controllers.linear(), LINE, 2),
][: share(4, 8)]

ARENA = replace(
    Arena.box(520, 450),
    balls=(Ball(260, 100), Ball(150, 330)),
    lamps=(Lamp(400, 80, 10.0), Lamp(60, 60, 1.0, False)),
)
SEED, SECONDS = 5, 12.0


def image_of(scene: Scene) -> dict[str, Any]:
    arrays = {SCENE.fields[name][1]: _text(array) for name, array in scene.arrays.items()}
    return {"record": _text(scene.record), "arrays": arrays}


def _text(array: NDArray[Any]) -> str:
    return base64.b64encode(array.tobytes()).decode()


def made(drive: Drive, parameters: NDArray[np.float64]) -> tuple[Batch, dict[str, Any]]:
    """Return a batch, and what a page asks for where its robots are driven."""
    spec, robots = RobotSpec.load(drive.kind), drive.robots
    batch = Batch(ARENA, 1, robot=spec, robots=robots, seed=SEED, timing=drive.timing)
    driver = describe_controller(drive.controller, list(parameters), spec, drive.timing, "it")
    asked = {"driver": driver, "robots": [True] * robots, "speeds": [[0, 0]] * robots, "begin_ns": 0}
    return batch, asked | {"end_ns": round(SECONDS * 1e9)}


def result_of(batch: Batch, worlds: Any) -> list[Any]:
    return [int(worlds.ticks[0]), int(worlds.begins_ns[0]), _text(batch.state.robots)]


def go_on(worlds: list[dict[str, Any]], folder: Path) -> Any:
    folder.mkdir(exist_ok=True)
    (folder / "worlds.json").write_text(json.dumps(worlds), "utf-8")
    return node(WORLDS + GO_ON, folder, ENGINE)


def parameters_of(controller: Controller) -> NDArray[np.float64]:
    return controllers.random_parameters(controller, 1, seed=3)[0]


@pytest.mark.slow
def test_a_page_drives_as_a_batch_does(tmp_path: Path) -> None:
    worlds, expected = [], []
    for drive in DRIVES:
        parameters = parameters_of(drive.controller)
        batch, asked = made(drive, parameters)
        batch._begin(drive.controller, parameters)
        worlds.append({"image": image_of(batch._scenes[0]), "asked": asked})
        batch, _ = made(drive, parameters)
        loops, _, roll = batch._begin(drive.controller, parameters)
        roll(0, UNLIMITED, asked["end_ns"])
        expected.append(result_of(batch, loops))
    assert go_on(worlds, tmp_path / "page") == expected


@pytest.mark.slow
def test_a_page_goes_on_within_a_recording(tmp_path: Path) -> None:
    """The world that the page has made up to a time becomes that of a batch there."""
    worlds, expected = [], []
    for drive in DRIVES:
        recording = recorded(drive, tmp_path / "run.mcap")
        parameters, sim = parameters_of(drive.controller), recording.world_at(1.2345)
        batch, asked = made(drive, parameters)
        loops, _, roll = batch._begin(drive.controller, parameters)
        scene, now = batch._scenes[0], sim.world._scene
        for name in ("robots", "bodies", "lamps", "seeds", "kinds"):
            scene.arrays[name][:] = now.arrays[name]
        loops.ticks[:] = sim.world.state.tick_count
        for times_ns in (loops.begins_ns, loops.watched_ns, loops.sensed_ns):
            times_ns[:] = sim.now_ns
        enter_worlds(scene.record, np.zeros(1, np.int64))
        asked |= {"run": PageRun.of(recording.log).pack(), "begin_ns": sim.now_ns}
        worlds.append({"image": image_of(scene), "asked": asked})
        roll(0, UNLIMITED, asked["end_ns"])
        expected.append(result_of(batch, loops))
    assert go_on(worlds, tmp_path / "page") == expected


def recorded(drive: Drive, file: Path) -> Recording:
    """Record robots on their way."""
    sim = Simulation(ARENA, robots=drive.robots, robot=drive.kind, seed=SEED)
    if drive.controller == controllers.collector():
        sim.fit(1, "gripper")
    with sim.record(file):
        for number in range(1, drive.robots + 1):
            sim.port(number).write(b"D,%d,%d\n" % (3 + number, 7 - number))
        sim.run(2.0)
    return Recording(file)
