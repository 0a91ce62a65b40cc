"""The seed of the hashes of texts in the process of a program, on which the order of its sets depends.

Python draws one for each process, unless the environment has one. Then two runs of a program that goes through a set of
texts would differ.
"""

from __future__ import annotations

import os

VARIABLE = "PYTHONHASHSEED"

HASH_SEED = "2000"
"""Seed of all programs, unless the user has set another one."""


def hide() -> None:
    """Let a program find the environment that it has without KiKS."""
    if os.environ.get(VARIABLE) == HASH_SEED:
        del os.environ[VARIABLE]
