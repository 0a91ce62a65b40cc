"""What KiKS sets in the environment of its processes, and hides from the programs in them.

Python draws a seed for the hashes of texts in each process, unless the environment has one. Then two runs of a program
that goes through a set of texts would differ. And Python imports from the current folder, unless told otherwise.
"""

from __future__ import annotations

import os
import sys

HASH_SEED, SAFE_PATH = {"PYTHONHASHSEED": "2000"}, {"PYTHONSAFEPATH": "kiks"}
"""The marks, unless the user has set the same variables."""


def is_child_debugged() -> bool:
    """Return whether a program had better run in a process of its own: a debugger follows that one, too.

    The order of sets is settled when a process starts, and the debugger has started this one.
    """
    setup = getattr(getattr(sys.modules.get("pydevd"), "SetupHolder", None), "setup", None) or {}
    return bool(setup.get("multiprocess")) and not HASH_SEED.keys() & os.environ.keys()


def hide() -> None:
    """Let a program find the environment that it has without KiKS."""
    for name, value in (HASH_SEED | SAFE_PATH).items():
        if os.environ.get(name) == value:
            del os.environ[name]
