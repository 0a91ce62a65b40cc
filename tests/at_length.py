"""How much the tests do: `make nightly` runs all examples, the other targets a share of them."""

from __future__ import annotations

import os
from typing import TypeVar

import pytest

AT_LENGTH = os.environ.get("KIKS_AT_LENGTH", "") not in ("", "0")
"""`make nightly` sets this variable."""

nightly = pytest.mark.skipif(not AT_LENGTH, reason="make nightly runs it")
"""Marks a test, or a case of one, that only `make nightly` runs."""

T = TypeVar("T")


def share(normally: T, at_length: T) -> T:
    """Return how much a test does: the first value in a normal run, the second in `make nightly`."""
    return at_length if AT_LENGTH else normally
