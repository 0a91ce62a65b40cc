"""What the page of a run costs: its size, the time to its first picture, and how fast it makes the run again.

Run: python benchmarks/page.py [--json] [--repeats N]. Needs Chromium, and Firefox as firefox-esr or firefox.

`page.hour_mb` is the page of an hour of one robot that reads and drives at 9600 baud without a pause, and
`page.first_picture_s` the time from its address to its first picture with walls, in a browser that runs already.

`page.advance` is how fast kernels let time pass there, over native kernels: the same calls of `advance`, between the
same changes, in runs of 1, 5 and 20 robots that avoid each other. `page.whole` is the same with the changes, which a
page makes by itself and here a loop of Python. Both are ratios of processor time, of browsers with all their processes;
each is a median. `page.pictures_per_s` counts the pictures of a page that plays, without a GPU, and
`page.ms_per_picture` is the processor time of all the browser's processes for one.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import copytree
from statistics import median
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.desk.firefox_relay import FIREFOX, firefox
from tests.desk.worlds_in_node import NODE
from tests.recording.engines import Native
from tests.recording.played import _scene, unpacked

import kiks
from calibration import report
from kiks.engine import step
from kiks.export.browser_engine import ENGINE
from kiks.export.page import save_page
from kiks.export.page_run import PageRun

WEB = Path(kiks.__file__).parent / "desk" / "web"
HOUR_S, PLAYED_S = 3600.0, 4.0
SIZES_S = {1: 1800.0, 5: 900.0, 20: 300.0}
"""How long the run of so many robots is [s]."""

SETTLED_MS = 2000
"""How long a page is left alone at first [ms]."""

ROUNDS = 12
"""How often a run is made in a measurement."""

FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--enable-unsafe-swiftshader"]

MAKE = """
/** Make a run some times, with or without what the kernels do. */
function makeAgain(World, engine, inputs, rounds, isBare) {
  for (let k = 0; k < rounds; k++) {
    const top = engine.top, world = new World(engine, inputs);
    if (isBare) world.pass = (tickCount) => { world.tick += tickCount; };
    world.advanceTo(inputs.ticks.at(-1));
    engine.release(top);
  }
}
"""

IN_NODE = f"""
import {{ readFileSync }} from "node:fs";
import {{ loadEngine }} from "./engine.js";
import {{ readInputs }} from "./engine_inputs.js";
import {{ EngineWorld }} from "./engine_world.js";
import {{ unpackText }} from "./packed_text.js";
{MAKE}
const {{ head, rest }} = await unpackText(readFileSync("run.txt", "utf-8"));
const engine = await loadEngine(readFileSync(process.argv[2])), inputs = readInputs(head.inputs, rest);
const rounds = Number(process.argv[3]), took_s = [];
for (const isBare of [false, true, false, true]) {{
  const before = process.cpuUsage();
  makeAgain(EngineWorld, engine, inputs, rounds, isBare);
  const {{ user, system }} = process.cpuUsage(before);
  took_s.push((user + system) / 1e6);
}}
console.log(JSON.stringify(took_s.slice(2))); // all is compiled
"""

FIRST = """
const look = () => {
  const { stage } = window.kiksPage ?? {};
  // Pictures before the walls are there do not count.
  if (!stage?._raster) window.before = stage?.frames_drawn;
  if (stage?._raster && stage.frames_drawn > (window.before ?? 0)) window.firstPicture_ms = performance.now();
  else requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""


class Took(NamedTuple):
    """Processor time of runs, with and without what the kernels do [s]."""

    whole_s: float
    bare_s: float


def record(file: Path, robots: int, seconds: float) -> kiks.Recording:
    """Record robots that read and drive: one without a pause, several in turn."""
    size_mm = 600 if robots == 1 else 1000
    sim = kiks.Simulation(kiks.Arena.box(size_mm, size_mm), robots=robots, seed=1)
    drivers = [kiks.Khepera(sim.port(number)) for number in range(1, robots + 1)]
    with sim.record(file):
        while sim.time_s < seconds:
            for driver in drivers:
                values = driver.proximity()
                left, right, noise = sum(values[:3]), sum(values[3:6]), values[2] % 3
                if max(left, right) > 400:
                    driver.set_speed(*((5 + noise, -5) if left >= right else (-5, 5 + noise)))
                else:
                    driver.set_speed(8 + noise, 8 + values[3] % 3)
            if robots > 1:
                sim.run(0.02)
    return kiks.Recording(file)


# ---- how fast a run is made again ----


class NativeRun:
    """A run for native kernels, with all changes ready."""

    def __init__(self, packed: str) -> None:
        self._head, moments, self._contents = unpacked(zlib.decompress(base64.b64decode(packed)))
        self._moments: list[tuple[int, list[Any]]] = []
        for tick, what, given in moments[1:]:
            changes: dict[int, list[tuple[int, int]]] = {}
            for array, word, value in given if what > 1 else ():
                changes.setdefault(array, []).append((word, value))
            columns = [(array, *np.array(pairs, np.uint32).T) for array, pairs in changes.items()]
            self._moments.append((tick, columns))

    def took(self, rounds: int) -> Took:
        """Return how long it takes to make it."""
        return Took(*(self._took_s(rounds, advance) for advance in (step.advance, lambda *call: None)))

    def _took_s(self, rounds: int, advance: Callable[..., None]) -> float:
        took_s, engine, world = 0.0, Native(), np.zeros(1, np.int64)
        for _ in range(rounds):
            record, held = _scene(self._head["segments"][0], self._contents, engine)
            arrays = [held[name].reshape(-1).view(np.uint32) for name in ("robots", "bodies", "lamps", "shown")]
            engine.enter_worlds(record, world)
            now, start_s = 0, time.process_time()
            for tick, changes in self._moments:
                if tick > now:
                    advance(record, now, tick - now)
                    now = tick
                for array, words, values in changes:
                    arrays[array][words] = values
                if changes:
                    engine.enter_worlds(record, world)
            took_s += time.process_time() - start_s
        return took_s


def took_in_node(packed: str, rounds: int) -> Took:
    """Return how long node takes to make a run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copytree(WEB, folder, dirs_exist_ok=True)
        for file, text in (("run.txt", packed), ("package.json", '{"type": "module"}'), ("program.js", IN_NODE)):
            (folder / file).write_text(text, "utf-8")
        command = [NODE, "program.js", str(ENGINE), str(rounds)]
        return Took(*json.loads(subprocess.run(command, cwd=folder, capture_output=True, check=True).stdout))


def took_in_page(page: Any, rounds: int) -> Took:
    """Return how long the open page of a run takes to make it."""
    took_s = []
    for is_bare in (False, True, False, True):
        before_s = cpu_s()
        page.evaluate(
            f"""([rounds, isBare]) => {{
              {MAKE}
              const {{ world }} = kiksPage.feed;
              makeAgain(world.constructor, world.engine, world.inputs, rounds, isBare);
            }}""",
            [rounds, is_bare],
        )
        took_s.append(cpu_s() - before_s)
    return Took(*took_s[2:])


def cpu_s() -> float:
    """Return the processor time of all processes that this one has started, and theirs [s]."""
    parents, times_s = {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue  # it has ended
            parents[int(entry.name)] = int(fields[1])
            times_s[int(entry.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def is_own(number: int | None) -> bool:
        while number is not None and number != os.getpid():
            number = parents.get(number)
        return number is not None

    return sum(time_s for number, time_s in times_s.items() if number != os.getpid() and is_own(number))


# ---- browsers ----


@contextmanager
def browsers(folder: Path) -> Iterator[dict[str, Any]]:
    """Start the browsers that are there; yield them by name."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = {"chromium": playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)}
        if FIREFOX is not None:
            started["firefox"] = firefox(playwright, folder)
        yield started
        for browser in started.values():
            browser.close()


@contextmanager
def opened(browser: Any, file: Path) -> Iterator[Any]:
    """Open a page, and wait until it has compared its run."""
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.add_init_script(FIRST)
    page.goto(file.as_uri())
    # What is evaluated brings code of Playwright's into the page, which would wait for it.
    page.wait_for_timeout(SETTLED_MS)
    # The page's policy lets Playwright evaluate, and not wait for what it evaluates.
    while not page.evaluate("window.firstPicture_ms && kiksPage.comparison.isOver"):
        page.wait_for_timeout(50)
    assert page.evaluate("kiksPage.comparison.equal === kiksPage.comparison.count")
    yield page
    page.close()


def first_picture_s(browser: Any, file: Path) -> float:
    """Return the time to the first picture of a page [s]."""
    with opened(browser, file) as page:
        return float(page.evaluate("firstPicture_ms")) / 1000


def pictures(page: Any) -> tuple[float, float]:
    """Return the pictures a second of a page that plays, and the processor time of one [ms]."""
    page.locator("#play").click()
    page.wait_for_timeout(1000)
    before, before_s, start_s = page.evaluate("kiksPage.stage.frames_drawn"), cpu_s(), time.perf_counter()
    page.wait_for_timeout(1000 * PLAYED_S)
    count = page.evaluate("kiksPage.stage.frames_drawn") - before
    return count / (time.perf_counter() - start_s), 1000 * (cpu_s() - before_s) / count


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--repeats", type=int, default=5, help="measurements of each figure")
    options = arguments.parse_args()
    figures = [("page.engine_kb", len(zlib.compress(ENGINE.read_bytes(), 9)) / 1000, "kB, packed")]
    shares: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as name, browsers(Path(name)) as started:
        hour = Path(name, "hour.html")
        save_page(record(Path(name, "hour.mcap"), 1, HOUR_S), hour)
        figures.append(("page.hour_mb", hour.stat().st_size / 1e6, "MB"))
        for kind, browser in started.items():
            first_s = median(first_picture_s(browser, hour) for _ in range(options.repeats))
            figures.append((f"page.first_picture_s.{kind}", first_s, "s"))
        for robots, seconds in SIZES_S.items():
            file = Path(name, f"{robots}.html")
            recording = record(file.with_suffix(".mcap"), robots, seconds)
            save_page(recording, file)
            packed = PageRun.of(recording.log).pack()
            native = NativeRun(packed)
            for _ in range(options.repeats):
                own, took = native.took(ROUNDS), {"node": took_in_node(packed, ROUNDS)}
                for kind, browser in started.items():
                    with opened(browser, file) as page:
                        took[kind] = took_in_page(page, ROUNDS)
                        for figure, value in zip(("pictures_per_s", "ms_per_picture"), pictures(page), strict=True):
                            shares.setdefault(f"page.{figure}.{kind}.{robots}", []).append(value)
                for kind, (whole_s, bare_s) in took.items():
                    whole, alone = own.whole_s / whole_s, (own.whole_s - own.bare_s) / (whole_s - bare_s)
                    shares.setdefault(f"page.whole.{kind}.{robots}", []).append(whole)
                    shares.setdefault(f"page.advance.{kind}.{robots}", []).append(alone)
    units = {"pictures_per_s": "1/s", "ms_per_picture": "ms"}
    for name, values in sorted(shares.items()):
        figures.append((name, median(values), units.get(name.split(".")[1], "of native speed")))
    report(figures, as_json=options.json)


if __name__ == "__main__":
    main()
