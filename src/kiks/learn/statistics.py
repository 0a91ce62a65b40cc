"""Statistics of results: intervals of shares.

Source: Wilson, Probable inference, the law of succession, and statistical inference, Journal of the American
Statistical Association 22 (1927), for the interval of a share.
"""

from __future__ import annotations

from kiks.errors import ParameterError

CONFIDENCE = 0.95
"""Level of all intervals."""


def wilson_interval(count: int, total: int) -> tuple[float, float]:
    """Return Wilson's interval, of 95 %, for the share that a count is of a total.

    Example:
        >>> low, high = wilson_interval(8, 10)
        >>> round(low, 3), round(high, 3)
        (0.49, 0.943)
    """
    from scipy.stats import binomtest

    if not 0 <= count <= total or total < 1:
        raise ParameterError(f"count must be from 0 to total, and total at least 1, but they were {count} and {total}.")
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, "wilson")
    return float(interval.low), float(interval.high)
