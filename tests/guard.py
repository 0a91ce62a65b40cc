"""The time limit of all waits of tests: only what hangs reaches it, however busy the computer is."""

import time
from collections.abc import Callable
from typing import TypeVar

GUARD_S = 100.0

Fact = TypeVar("Fact")


def wait_until(fact: Callable[[], Fact]) -> Fact:
    """Poll a condition until it is true."""
    end_s = time.monotonic() + GUARD_S
    while not (found := fact()):
        assert time.monotonic() < end_s, "it never was so"
        time.sleep(0.002)
    return found
