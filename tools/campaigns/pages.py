"""Random recordings, made again by the engine of pages in node, Chromium, Firefox and wasmtime: each hash is the same.

A case draws all at once (`tests.recording.random_runs`): up to 20 robots of all kinds, some of files of their own, with
turrets; balls, cylinders, lamps that are switched, zones; what is added, removed, dragged and driven, and other walls.
"""

from __future__ import annotations

import functools
import random
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.desk.conftest import chromium
from tests.desk.firefox_relay import FIREFOX, firefox
from tests.export.made_again import Again, in_node, in_page, in_wasmtime
from tests.recording.random_runs import record_random
from tools.campaigns.runner import Broken, Campaign

from kiks.export.page_run import PageRun

CASES = 200
SECONDS = 2.0, 20.0
"""Shortest and longest recording [s]."""


def _play(rng: random.Random) -> int:
    """Record a run, and make it again everywhere; return how many hashes were compared.

    Raises:
        Broken: If one is not the recorded one.
    """
    with tempfile.TemporaryDirectory(prefix="kiks-pages-") as folder:
        recording = record_random(rng.getrandbits(40), Path(folder, "run.mcap"), seconds=rng.uniform(*SECONDS))
        run = PageRun.of(recording.log)
        text, tried = run.pack(), 0
        if run.replay.differs_ns is not None:
            raise Broken("lost", f"it differs from {run.replay.differs_ns / 1e9} s on", "native")
        for name, make in _hosts().items():
            again = make(text)
            if not again.is_equal:
                raise Broken("lost", f"{again.equal} of {again.count} checkpoints are the same", name)
            tried += again.count
    return tried


@functools.cache
def _hosts() -> dict[str, Callable[[str], Again]]:
    """Start the browsers that are there; return what makes a run again in each host."""
    from playwright.sync_api import sync_playwright

    folder, playwright = Path(tempfile.mkdtemp(prefix="kiks-pages-")), sync_playwright().start()
    hosts = {"wasmtime": in_wasmtime, "node": lambda text: in_node([text], folder / "node")[0]}
    hosts["chromium"] = in_page(chromium(playwright).new_page(), folder / "page")
    if FIREFOX is not None:
        hosts["firefox"] = in_page(firefox(playwright, folder).new_page(), folder / "page")
    return hosts


def campaigns() -> Iterator[Campaign]:
    """Yield the only one."""
    yield Campaign("pages.drawn", CASES, lambda: _play, limit_s=120.0, jobs=1)
