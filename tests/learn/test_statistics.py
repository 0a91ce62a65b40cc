"""Statistics with answers that are known."""

from __future__ import annotations

import pytest

from kiks import ParameterError
from kiks.learn.statistics import wilson_interval


@pytest.mark.parametrize(
    ("count", "total", "known"),
    [(81, 263, (0.2553, 0.3662)), (15, 148, (0.0624, 0.1605)), (0, 20, (0.0, 0.1611)), (1, 29, (0.0061, 0.1718))],
)
def test_wilsons_interval_is_that_of_newcombe(count: int, total: int, known: tuple[float, float]) -> None:
    """Newcombe, Two-sided confidence intervals for the single proportion, Statistics in Medicine 17 (1998), table I."""
    assert wilson_interval(count, total) == pytest.approx(known, abs=5e-5)


@pytest.mark.parametrize(("count", "total"), [(3, 2), (-1, 2), (0, 0)])
def test_a_share_is_of_something(count: int, total: int) -> None:
    with pytest.raises(ParameterError, match=f"from 0 to total.* were {count} and {total}"):
        wilson_interval(count, total)
