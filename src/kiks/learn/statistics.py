"""Statistics of results: intervals of shares and of means.

Source: Wilson, Probable inference, the law of succession, and statistical inference, Journal of the American
Statistical Association 22 (1927), for the interval of a share.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.errors import ParameterError

Floats = NDArray[np.float64]

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


def mean_interval(values: ArrayLike, axis: int = 0) -> tuple[Floats, Floats, Floats]:
    """Return means along an axis, and both ends of their 95 % intervals by Student's t; those of one value are itself.

    Args:
        values: Numbers of any shape.
        axis: The axis of what was repeated, such as seeds.

    Example:
        >>> [round(float(each), 2) for each in mean_interval([1.0, 2.0, 3.0])]
        [2.0, -0.48, 4.48]
    """
    from scipy.stats import t

    numbers = np.asarray(values, np.float64)
    count, mean = numbers.shape[axis], numbers.mean(axis=axis)
    if count < 2:
        return mean, mean, mean
    half = t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1) * numbers.std(axis=axis, ddof=1) / np.sqrt(count)
    return mean, mean - half, mean + half
