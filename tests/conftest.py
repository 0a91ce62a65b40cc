"""Setup for all tests: the engine is compiled once, before the workers of xdist start."""

from __future__ import annotations

import signal

import pytest
from hypothesis import settings

# The first example of a test may load the engine, and tests measure no time.
settings.register_profile("kiks", deadline=None)
settings.load_profile("kiks")

# Programs to be run as processes, not modules to be imported.
collect_ignore_glob = ["programs/*"]


def pytest_configure(config: pytest.Config) -> None:
    # A shell that starts something in the background has it ignore Ctrl-C, and all that this starts: tests send it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if not hasattr(config, "workerinput") and not config.option.collectonly:
        from kiks.cli.engine_start import compile_everything

        compile_everything()
