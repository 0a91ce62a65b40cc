"""Runs that the engine of pages makes again, in node and in browsers: each checkpoint's hash is compared."""

import base64
import json
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from shutil import copytree
from typing import Any, NamedTuple

from tests.desk.worlds_in_node import node
from tests.recording.engines import Wasmtime
from tests.recording.played import played

from kiks.desk.panels.widgets import WEB
from kiks.export.browser_engine import ENGINE
from kiks.export.bundle import bundle

MODULE = """
import { Comparison } from "./comparison.js";
import { loadEngine } from "./engine.js";
import { readInputs } from "./engine_inputs.js";
import { EngineWorld } from "./engine_world.js";
import { unpackText } from "./packed_text.js";

let engine;
globalThis.takeEngine = async (text) => {
  engine = await loadEngine(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
};
globalThis.makeAgain = async (text) => {
  const { head, rest } = await unpackText(text), top = engine.top;
  const comparison = new Comparison(new EngineWorld(engine, readInputs(head.inputs, rest)));
  await comparison.run();
  engine.release(top);
  return [comparison.count, comparison.equal];
};
"""

PROGRAM = """
import { readFileSync } from "node:fs";
import "./again.js";

const { engine, runs } = JSON.parse(readFileSync("runs.json", "utf-8")), made = [];
await takeEngine(engine);
for (const run of runs) made.push(await makeAgain(run));
console.log(JSON.stringify(made));
"""


class Again(NamedTuple):
    """What came of a run: how many checkpoints it has, and how many are equal."""

    count: int
    equal: int

    @property
    def is_equal(self) -> bool:
        """Whether all checkpoints are, of which there are some."""
        return self.count > 0 and self.equal == self.count


def in_node(runs: Sequence[str], folder: Path) -> list[Again]:
    """Make runs again (`PageRun.pack`) in node, in a folder for its files."""
    folder.mkdir(exist_ok=True)
    (folder / "again.js").write_text(MODULE, "utf-8")
    (folder / "runs.json").write_text(json.dumps({"engine": _engine(), "runs": runs}), "utf-8")
    return [Again(*made) for made in node(PROGRAM, folder)]


def in_page(page: Any, folder: Path) -> Callable[[str], Again]:
    """Return what makes a run again in a browser's page, which opens a file of a folder."""
    copytree(WEB, folder, dirs_exist_ok=True)
    (folder / "again.js").write_text(MODULE, "utf-8")
    (folder / "again.html").write_text(f"<!doctype html><script>{bundle(folder / 'again.js')}</script>", "utf-8")
    page.goto((folder / "again.html").as_uri())
    page.evaluate("(text) => takeEngine(text)", _engine())
    return lambda run: Again(*page.evaluate("(text) => makeAgain(text)", run))


def in_wasmtime(run: str) -> Again:
    """Make a run again in wasmtime."""
    result = played(zlib.decompress(base64.b64decode(run)), Wasmtime())
    return Again(len(result.own), sum(map(str.__eq__, result.own, result.recorded)))


def _engine() -> str:
    return base64.b64encode(ENGINE.read_bytes()).decode()
