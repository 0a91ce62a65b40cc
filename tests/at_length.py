"""How much the tests do: `make test` and `.ci/run` test each feature once, `make test-all` everything."""

import os
from collections.abc import Iterable
from typing import Any, TypeVar

import pytest

AT_LENGTH = os.environ.get("KIKS_AT_LENGTH", "") not in ("", "0")
"""`make test-all` sets this variable."""

at_length = pytest.mark.at_length
"""Marks a test, or a case of one, that `make test` leaves out."""

T = TypeVar("T")


def share(normally: T, at_length: T) -> T:
    """Return how much a test does: the first value in `make test`, the second in `make test-all`."""
    return at_length if AT_LENGTH else normally


def cases(values: Iterable[Any], normally: int = 1) -> list[Any]:
    """Return the values of a parametrized test: `make test` runs the first few, `make test-all` all of them."""
    listed = [value if isinstance(value, tuple) else (value,) for value in values]
    return [pytest.param(*each, marks=at_length if number >= normally else ()) for number, each in enumerate(listed)]
