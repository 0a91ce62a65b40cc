"""What KiKS sets in the environment of its processes, and hides from the programs in them.

Python draws a seed for the hashes of texts in each process, unless the environment has one. Then two runs of a program
that goes through a set of texts would differ. And Python imports from the current folder, unless told otherwise.
"""

from __future__ import annotations

import os

HASH_SEED, SAFE_PATH = {"PYTHONHASHSEED": "2000"}, {"PYTHONSAFEPATH": "kiks"}
"""The marks, unless the user has set the same variables."""


def hide() -> None:
    """Let a program find the environment that it has without KiKS."""
    for name, value in (HASH_SEED | SAFE_PATH).items():
        if os.environ.get(name) == value:
            del os.environ[name]
