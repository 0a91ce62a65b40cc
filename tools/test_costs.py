"""What the tests cost: `python tools/test_costs.py [ARGUMENTS OF PYTEST]` runs them and prints tables.

Each worker notes for each test its processor time, that of the processes that it has waited for, the time in the
compiler, the pages that it opened and its memory. Every second, the memory of the whole run is added up, with its
browsers and programs; what processes share counts once (PSS). Linux only.
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
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
NOTES = "KIKS_TEST_COSTS"
"""The variable of the environment that names the folder for the notes of the workers."""

Rows = dict[str, dict[str, float]]

PERIOD_S = 1.0
SHOWN = 40
"""Rows of a table."""

NOTED = ("tests", "wall_s", "own_s", "children_s", "compile_s", "pages", "grew_mb")
"""Columns of a table: processor time of the process, and of those that it has waited for; the compiler's part of the
first; pages that a browser opened; by how much the process grew."""


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
        """Note what collecting costs."""
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
            depth = 0  # the lock is taken again by what is compiled within

            def on_start(self, event: Any) -> None:
                costs._compiling_s -= 0.0 if self.depth else time.thread_time()
                self.depth += 1

            def on_end(self, event: Any) -> None:
                self.depth -= 1
                costs._compiling_s += 0.0 if self.depth else time.thread_time()

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
        """Note what a test costs."""
        before = self._spent()
        result = yield
        spent = (after - since for since, after in zip(before, self._spent(), strict=True))
        self._note(test=item.nodeid, rss_mb=rss_mb(), **dict(zip(NOTED[1:6], spent, strict=True)))
        return result

    def _spent(self) -> tuple[float, float, float, float, int]:
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        children_s = children.ru_utime + children.ru_stime
        return time.monotonic(), time.process_time(), children_s, self._compiling_s, self._page_count


def pytest_configure(config: pytest.Config) -> None:
    """Begin."""
    config.pluginmanager.register(Costs(Path(os.environ[NOTES])))


def rss_mb() -> float:
    """Return the resident memory of this process [MB]."""
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
        """Take no more samples."""
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


def row(name: str, values: Iterable[object]) -> str:
    """Return a row of a table: a name, cut on the left if it is long, and numbers."""
    texts = (f"{value:.1f}" if isinstance(value, float) else str(value) for value in values)
    return f"{name[-80:]:80s}" + "".join(f"{text:>11s}" for text in texts)


def print_table(title: str, rows: Rows, by: str = "wall_s") -> None:
    """Print the dearest rows."""
    print(f"\n{row(title, NOTED)}")
    for name, costs in sorted(rows.items(), key=lambda each: -each[1][by])[:SHOWN]:
        print(row(name, (costs[each] for each in NOTED)))


def report(folder: Path) -> None:
    """Print what the notes of all workers say."""
    whole: Rows = {}
    files: Rows = {}
    tests: Rows = {}
    print(f"\n{row('worker', ('collect_s', 'first_mb', 'last_mb', 'most_mb'))}")
    for path in sorted(folder.glob("gw*.jsonl")) or folder.glob("*.jsonl"):
        collecting, *notes = [json.loads(line) for line in path.read_text().splitlines()]
        sizes_mb = [note["rss_mb"] for note in (collecting, *notes)]
        print(row(path.stem, (collecting["collecting_s"], sizes_mb[0], sizes_mb[-1], max(sizes_mb))))
        for note, before_mb in zip(notes, sizes_mb, strict=False):
            note |= {"tests": 1, "grew_mb": note["rss_mb"] - before_mb}
            for rows, name in ((whole, "all"), (files, note["test"].partition("::")[0]), (tests, note["test"])):
                costs = rows.setdefault(name, dict.fromkeys(NOTED, 0))
                for each in NOTED:
                    costs[each] += note[each]
    print_table("", whole)
    print_table("file", files)
    print_table("file, by what it leaves in memory", files, "grew_mb")
    print_table("test", tests)


def main() -> None:
    """Run the tests and print what they cost."""
    options = sys.argv[1:] or ["-n", "3", "--dist", "worksteal"]
    with tempfile.TemporaryDirectory() as name:
        began_s = time.monotonic()
        path = os.pathsep.join(filter(None, (str(Path(__file__).parent), os.environ.get("PYTHONPATH"))))
        command = [sys.executable, "-m", "pytest", "-p", "test_costs", *options]
        process = subprocess.Popen(command, cwd=ROOT, env={**os.environ, NOTES: name, "PYTHONPATH": path})
        memory = Memory(process.pid)
        exit_code = process.wait()
        memory.end()
        report(Path(name))
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    took_s, used_s = time.monotonic() - began_s, spent.ru_utime + spent.ru_stime
    print(f"\n{took_s:.0f} s, {used_s:.0f} s of processor time; at most {memory.peak_mb:.0f} MB:")
    parts = sorted(memory.parts_mb.items(), key=lambda each: -each[1])[:8]
    print(", ".join(f"{part} {size_mb:.0f}" for part, size_mb in parts))
    sys.exit(exit_code)


if __name__ == "__main__":
    main()
