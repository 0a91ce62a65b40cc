"""Setup for all tests: which of them run, the engine compiled before they start, and how a failed one runs alone."""

import ctypes
import gc
import os
import shlex
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from tests.at_length import AT_LENGTH, share
from tests.surroundings import settle

# Programs to be run as processes, not modules to be imported.
collect_ignore_glob = ["programs/*", "exercises/solutions/*"]


def pytest_configure(config: pytest.Config) -> None:
    # A test draws the same examples each time, unless a seed is given. The first one may load the engine: no deadline.
    is_repeatable = config.option.hypothesis_seed is None
    settings.register_profile("kiks", deadline=None, derandomize=is_repeatable, max_examples=share(30, 100))
    settings.load_profile("kiks")
    settle()
    # Links and sessions of this process are no other's, such as of a server that a person runs.
    runtime = tempfile.TemporaryDirectory(prefix="kiks-tests-", ignore_cleanup_errors=True)
    os.environ["XDG_RUNTIME_DIR"] = runtime.name
    config.add_cleanup(runtime.cleanup)
    if not hasattr(config, "workerinput") and not config.option.collectonly:
        from kiks.cli.engine_start import compile_all
        from kiks.engine.code_cache import is_compiled
        from kiks.engine.compiling import LAST

        if not (is_compiled(LAST) and is_compiled("roll_out")):
            compile_all()
        if config.getoption("numprocesses", None):
            from tests import forked

            forked.address()  # started here, it is shared by all workers


def pytest_collection_finish() -> None:
    # A search for garbage need not look through what stays until the end: the modules and the tests.
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def free_memory_goes_back_to_the_system() -> Iterator[None]:
    """Collect garbage, as a few objects may hold large arenas, and return what the C library would keep.

    What is left stays until the end, as nearly all of it does, so that later searches need not look through it.
    """
    yield
    gc.collect()
    gc.freeze()
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):
        trim(0)


@pytest.fixture(autouse=True)
def hypothesis_in_real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Hypothesis, which measures the collection of garbage, ask the real clock in a program that runs here."""
    from kiks.script import callers

    monkeypatch.setitem(callers._kind_of, "hypothesis", callers.Caller.REAL)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not AT_LENGTH:
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("at_length")])
        items[:] = [item for item in items if not item.get_closest_marker("at_length")]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print for each test that failed the command that runs it alone."""
    reports = [report for outcome in ("failed", "error") for report in terminalreporter.getreports(outcome)]
    if not reports:
        return
    terminalreporter.section("to run a failed test alone")
    seed = config.option.hypothesis_seed
    options = [] if seed is None else [f"--hypothesis-seed={seed}"]
    python = Path(sys.executable)
    if python.is_relative_to(config.rootpath):
        python = python.relative_to(config.rootpath)
    for name in dict.fromkeys(report.nodeid for report in reports):
        command = shlex.join([str(python), "-m", "pytest", *options, name])
        terminalreporter.write_line(f"KIKS_AT_LENGTH=1 {command}" if AT_LENGTH else command)
