"""Another user of this computer, who has no rights here."""

from __future__ import annotations

import os
from collections.abc import Callable

import pytest

STRANGER = 65534
"""The user number of `nobody`."""

needs_root = pytest.mark.skipif(os.getuid() != 0, reason="only the superuser can act as another user")


def as_stranger(act: Callable[[], object]) -> str:
    """Do something as another user, in a process that ends with it; return what came of it as a text."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setgroups([])
            os.setgid(STRANGER)
            os.setuid(STRANGER)
            outcome = repr(act())
        except BaseException as error:
            outcome = type(error).__name__
        os.write(writing, outcome.encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as told:
        outcome = told.read()
    os.waitpid(child, 0)
    return outcome
