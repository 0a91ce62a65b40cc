"""A virtual screen for programs with windows."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def display() -> Iterator[dict[str, str]]:
    """Yield an environment with a virtual screen."""
    if shutil.which("Xvfb") is None:
        pytest.skip("there is no Xvfb for the program with a window")
    ours, theirs = os.pipe()
    command = ["Xvfb", "-displayfd", str(theirs), "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=[theirs], stderr=subprocess.DEVNULL) as process:
        os.close(theirs)
        try:
            with open(ours) as told:
                number = told.readline().strip()
            yield {**os.environ, "DISPLAY": f":{number}"}
        finally:
            process.terminate()
