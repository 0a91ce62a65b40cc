"""What the tests cost: `python tools/test_costs.py [ARGUMENTS OF PYTEST]` runs them and prints tables.

Each worker notes for each test its processor time, that of the processes that it has waited for, the time in the compiler, the pages that it
opened and its memory. Every second, the memory of the whole run is added up, with its browsers and programs: a page that processes share
counts once (PSS). Linux only.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
NOTES = "KIKS_TEST_COSTS"
"""The variable of the environment that names the folder for the notes of the workers."""

PERIOD_S = 1.0
SHOWN = 40
"""Rows of a table."""


# ---- in the processes that run tests ----


class Costs:
    """Notes what each test costs, as a plugin of pytest."""

    def __init__(self, folder: Path) -> None:
        self._file = (folder / f"{os.environ.get('PYTEST_XDIST_WORKER', 'main')}.jsonl").open("w")
        self._compiling_s = 0.0
        self._page_count = 0

    def _note(self, **note: Any) -> None:
        print(json.dumps(note), file=self._file, flush=True)

    @pytest.hookimpl(wrapper=True)
    def pytest_collection(self) -> Iterator[None]:
        began_s = time.process_time()
        result = yield
        self._note(collecting_s=time.process_time() - began_s, rss_mb=rss_mb())
        self._watch()
        return result

    def _watch(self) -> None:
        """Count the time in the compiler, and the pages that open in a browser."""
        from numba.core import event

        costs = self

        class Compiling(event.Listener):
            def on_start(self, event: Any) -> None:
                costs._compiling_s -= time.thread_time()

            def on_end(self, event: Any) -> None:
                costs._compiling_s += time.thread_time()

        event.register("numba:compiler_lock", Compiling())
        with contextlib.suppress(ImportError):
            from playwright.sync_api import Page

            goto = Page.goto

            def counted(page: Page, *arguments: Any, **options: Any) -> Any:
                costs._page_count += 1
                return goto(page, *arguments, **options)

            Page.goto = counted

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        before, began_s = self._spent(), time.monotonic()
        result = yield
        spent = [after - since for since, after in zip(before, self._spent(), strict=True)]
        names = ("own_s", "children_s", "compiling_s", "pages")
        self._note(test=item.nodeid, wall_s=time.monotonic() - began_s, rss_mb=rss_mb(), **dict(zip(names, spent, strict=True)))
        return result

    def _spent(self) -> tuple[float, float, float, int]:
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time(), children.ru_utime + children.ru_stime, self._compiling_s, self._page_count


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Costs(Path(os.environ[NOTES])))


def rss_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


# ---- in the process that starts them ----


class Memory:
    """The memory of a process and all that it has started, sampled."""

    def __init__(self, pid: int) -> None:
        self.peak_mb = 0.0
        self.parts_mb: dict[str, float] = {}
        """What it consisted of at the peak."""
        self._pid = pid
        self._has_ended = threading.Event()
        self._thread = threading.Thread(target=self._sample)
        self._thread.start()

    def end(self) -> None:
        self._has_ended.set()
        self._thread.join()

    def _sample(self) -> None:
        while not self._has_ended.wait(PERIOD_S):
            parts: dict[str, float] = defaultdict(float)
            for pid in descendants(self._pid):
                with contextlib.suppress(OSError, IndexError, ValueError):
                    name = Path(f"/proc/{pid}/comm").read_text().strip()
                    rows = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
                    parts[name] += next(int(row.split()[1]) for row in rows if row.startswith("Pss:")) / 1e3
            if sum(parts.values()) > self.peak_mb:
                self.peak_mb, self.parts_mb = sum(parts.values()), dict(parts)


def descendants(pid: int) -> set[int]:
    """Return a process and its children, their children, and so on."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
    found, added = set(), {pid}
    while added:
        found |= added
        added = {each for each, parent in parents.items() if parent in added} - found
    return found


def table(title: str, rows: dict[str, dict[str, float]], by: str) -> None:
    """Print the dearest rows."""
    print(f"\n{title:88s} {'tests':>6s} {'wall':>7s} {'own':>7s} {'children':>8s} {'compiling':>9s} {'pages':>5s} {'grew MB':>7s}")
    for name, row in sorted(rows.items(), key=lambda each: -each[1][by])[:SHOWN]:
        numbers = (row["wall_s"], row["own_s"], row["children_s"], row["compiling_s"], row["pages"], row["grew_mb"])
        print(f"{name[-88:]:88s} {row['tests']:6.0f} {'{:7.1f} {:7.1f} {:8.1f} {:9.1f} {:5.0f} {:7.0f}'.format(*numbers)}")


def report(folder: Path) -> None:
    """Print what the notes of all workers say."""
    files: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    tests: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    print("\nworker  collecting [s]  at first [MB]  at last  most")
    for path in sorted(folder.glob("*.jsonl")):
        collecting, *notes = [json.loads(line) for line in path.read_text().splitlines()] or [{"collecting_s": 0.0, "rss_mb": 0.0}]
        sizes_mb = [note["rss_mb"] for note in (collecting, *notes)]
        print(f"{path.stem:6s} {collecting['collecting_s']:15.1f} {sizes_mb[0]:14.0f} {sizes_mb[-1]:8.0f} {max(sizes_mb):5.0f}")
        for note, before_mb in zip(notes, sizes_mb, strict=False):
            for row in (files[note["test"].partition("::")[0]], tests[note["test"]]):
                row["tests"] += 1
                row["grew_mb"] += note["rss_mb"] - before_mb
                for name in ("wall_s", "own_s", "children_s", "compiling_s", "pages"):
                    row[name] += note[name]
    total: dict[str, float] = defaultdict(float)
    for row in files.values():
        for name, value in row.items():
            total[name] += value
    table("all", {"all": total}, "wall_s")
    table("file", files, "wall_s")
    table("file, by what it leaves in memory", files, "grew_mb")
    table("test", tests, "wall_s")


def main() -> None:
    """Run the tests and print what they cost."""
    with tempfile.TemporaryDirectory() as name:
        began_s = time.monotonic()
        path = os.pathsep.join(filter(None, (str(Path(__file__).parent), os.environ.get("PYTHONPATH"))))
        command = [sys.executable, "-m", "pytest", "-p", "test_costs", *(sys.argv[1:] or ["-n", "3", "--dist", "worksteal"])]
        process = subprocess.Popen(command, cwd=ROOT, env={**os.environ, NOTES: name, "PYTHONPATH": path})
        memory = Memory(process.pid)
        exit_code = process.wait()
        memory.end()
        spent = resource.getrusage(resource.RUSAGE_CHILDREN)
        report(Path(name))
        print(f"\n{time.monotonic() - began_s:.0f} s, {spent.ru_utime + spent.ru_stime:.0f} s of processor time; at most {memory.peak_mb:.0f} MB:")
        print(", ".join(f"{part} {size_mb:.0f}" for part, size_mb in sorted(memory.parts_mb.items(), key=lambda each: -each[1])[:8]))
    sys.exit(exit_code)


if __name__ == "__main__":
    main()
