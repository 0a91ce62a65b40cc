"""Statistics of results: intervals, tests of several settings with their effect sizes, and survival curves.

Sources: Wilson, Probable inference, the law of succession, and statistical inference (1927), for the interval of a
share; Mann and Whitney (1947) for U; Kruskal and Wallis (1952) for H; Vargha and Delaney, A critique and improvement of
the CL common language effect size statistics (2000), section 5, for the effect size A and its names; Newcombe,
Confidence intervals for an effect size measure based on the Mann-Whitney statistic, part 2, Statistics in Medicine 25
(2006), method 5, for the interval of A; Holm, A simple sequentially rejective multiple test procedure (1979); Kaplan
and Meier (1958) for curves with evolutions that ended unsolved, and Mantel (1966) for the log-rank test of two of them.
SciPy calculates all but Holm's correction and Newcombe's interval.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.errors import ParameterError
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_count, check_number

Floats = NDArray[np.float64]

CONFIDENCE = 0.95
"""Level of all intervals."""

RESAMPLES = 9999
"""Number of samples of a bootstrap."""

EFFECTS = ((0.06, "negligible"), (0.14, "small"), (0.21, "medium"), (0.5, "large"))
"""Names of effect sizes: largest |A - 0.5|, and the name."""

EXACT_MAX = 50
"""Largest sample for which the distribution of U is counted out."""

MANN_WHITNEY_EXACT, MANN_WHITNEY = "Mann-Whitney (exact)", "Mann-Whitney (normal approximation, because of ties)"
MANN_WHITNEY_LARGE, KRUSKAL_WALLIS = "Mann-Whitney (normal approximation)", "Kruskal-Wallis (chi-squared approximation)"
LOG_RANK, HOLM = "log-rank (normal approximation)", "Holm"
"""Methods, as they are named beside each p."""


class Interval(NamedTuple):
    """An interval of 95 %."""

    low: float
    high: float


def wilson_interval(count: int, total: int) -> Interval:
    """Return Wilson's interval, of 95 %, for the share that a count is of a total.

    Args:
        count: The count.
        total: The total, at least 1.

    Example:
        >>> low, high = wilson_interval(8, 10)
        >>> round(low, 3), round(high, 3)
        (0.49, 0.943)
    """
    from scipy.stats import binomtest

    total = check_count("total", total, 1)
    count = check_count("count", count, 0, total)
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, "wilson")
    return Interval(float(interval.low), float(interval.high))


def mean_interval(
    values: ArrayLike, axis: int = 0, *, within: tuple[float, float] = (-math.inf, math.inf)
) -> tuple[Floats, Floats, Floats]:
    """Return means along an axis, and both ends of their 95 % intervals by Student's t; those of one value are itself.

    Args:
        values: Numbers of any shape.
        axis: The axis of what was repeated, such as seeds.
        within: The least and the greatest possible value, such as 0 and 1 for shares. Intervals end there.

    Example:
        >>> [round(float(each), 2) for each in mean_interval([1.0, 2.0, 3.0])]
        [2.0, -0.48, 4.48]
    """
    from scipy.stats import t

    numbers = check_numbers("values", values)
    if not numbers.size:
        raise ParameterError("values must be at least one number, but there were none.")
    count, mean = numbers.shape[axis], numbers.mean(axis=axis)
    if count < 2:
        return mean, mean, mean
    half = t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1) * numbers.std(axis=axis, ddof=1) / np.sqrt(count)
    return mean, np.maximum(mean - half, within[0]), np.minimum(mean + half, within[1])


def median_interval(values: Sequence[float]) -> Interval | None:
    """Return the interval, of 95 %, of the median of a sample, by the percentiles of its bootstrap.

    The same sample gives the same interval. None if it has one value only.

    Example:
        >>> median_interval([1.0, 2.0, 3.0, 4.0, 5.0])
        Interval(low=1.0, high=5.0)
    """
    from scipy.stats import bootstrap

    sample = _sample(values)
    if len(sample) < 2:
        return None
    drawing: dict[str, Any] = {"n_resamples": RESAMPLES, "random_state": np.random.default_rng(0), "vectorized": True}
    found = bootstrap([sample], np.median, method="percentile", confidence_level=CONFIDENCE, **drawing)
    return Interval(*map(float, found.confidence_interval))


def a_interval(a: float, first: int, second: int) -> Interval:
    """Return Newcombe's interval, of 95 %, for Vargha and Delaney's A. It has a width also where A is 0 or 1.

    It holds each A that the one found is no farther away from than 1.96 standard deviations: by Hanley and McNeil's
    formula, with the mean size of both samples in the place of either.

    Args:
        a: The A found.
        first: Size of the first sample.
        second: Size of the second sample.

    Example:
        >>> low, high = a_interval(1.0, 5, 5)
        >>> round(low, 3), high
        (0.643, 1.0)
    """
    from scipy.optimize import brentq
    from scipy.special import ndtri

    z, others = float(ndtri(0.5 + 0.5 * CONFIDENCE)), 0.5 * (first + second) - 1.0

    def lower_end(a: float) -> float:
        def beyond(truth: float) -> float:
            spread = 1.0 + others * ((1.0 - truth) / (2.0 - truth) + truth / (1.0 + truth))
            return float((a - truth) ** 2 - z**2 * truth * (1.0 - truth) * spread / (first * second))

        # Of an A of 1, 1 is an end as well: the upper one.
        return float(brentq(beyond, 0.0, min(a, 1.0 - 1e-9))) if a > 0.0 else 0.0

    return Interval(lower_end(a), 1.0 - lower_end(1.0 - a))


def _sample(values: Sequence[float]) -> Floats:
    """Return a sample as an array, float64 [value]."""
    sample = check_numbers("a sample", values, (None,))
    if not len(sample):
        raise ParameterError("a sample must have at least one value, but it had none.")
    return sample


# ---- tests ----


@dataclass(frozen=True)
class Finding:
    """What a test says.

    Attributes:
        method: The test, and how its p was calculated.
        statistic: The test's statistic.
        p: Two-sided p.
    """

    method: str
    statistic: float
    p: float


@dataclass(frozen=True)
class Pair:
    """What is said about two settings.

    Attributes:
        first: Name of the first.
        second: Name of the second.
        test: The test of the two alone.
        p: Its p, corrected by Holm's method for the number of pairs.
        a: Vargha and Delaney's A: the probability that one of the first exceeds one of the second, ties half; None if
            that is not asked.
        a_interval: Interval of A; None as above.
    """

    first: str
    second: str
    test: Finding
    p: float
    a: float | None = None
    a_interval: Interval | None = None

    @property
    def effect(self) -> str:
        """The name of the effect size; empty if there is none."""
        if self.a is None:
            return ""
        away = round(abs(self.a - 0.5), 9)  # so that A and 1 - A have one name
        return next(name for least, name in EFFECTS if away < least or least == EFFECTS[-1][0])


@dataclass(frozen=True)
class Comparison:
    """What tests say about two or more settings.

    Attributes:
        pairs: All pairs.
        omnibus: The test of all settings together; None of two.
        correction: How the p of pairs are corrected; empty of two settings.
    """

    pairs: tuple[Pair, ...]
    omnibus: Finding | None = None
    correction: str = ""


def compare(samples: Mapping[str, Sequence[float]]) -> Comparison:
    """Return what tests say about samples, by their names: each two, and all together if there are more.

    Args:
        samples: Values of each setting by its name, such as the fitness of the champion of each seed.

    Example:
        >>> (pair,) = compare({"cma": [3.0, 4.0, 5.0], "ga": [1.0, 2.0, 2.5]}).pairs
        >>> pair.test.method, round(pair.p, 3), pair.a, pair.effect
        ('Mann-Whitney (exact)', 0.1, 1.0, 'large')
    """
    from scipy.stats import kruskal

    pairs = []
    for names in combinations(samples, 2):
        first, second = (samples[name] for name in names)
        test = mann_whitney(first, second)
        a = test.statistic / (len(first) * len(second))
        pairs.append(Pair(*names, test, test.p, a, a_interval(a, len(first), len(second))))
    omnibus = None
    if len(samples) > 2:
        is_constant = len({value for sample in samples.values() for value in sample}) == 1
        found = (0.0, 1.0) if is_constant else kruskal(*samples.values())
        omnibus = Finding(KRUSKAL_WALLIS, float(found[0]), float(found[1]))
    return _corrected(pairs, omnibus)


def mann_whitney(first: Sequence[float], second: Sequence[float]) -> Finding:
    """Return what the Mann-Whitney test says about two samples; its statistic is U of the first.

    Example:
        >>> mann_whitney([3.0, 4.0, 5.0], [1.0, 2.0, 3.0]).statistic
        8.5
    """
    from scipy.stats import mannwhitneyu

    values = [*_sample(first), *_sample(second)]
    if len(set(values)) == 1:
        return Finding(MANN_WHITNEY, len(first) * len(second) / 2, 1.0)
    has_ties, is_small = len(set(values)) < len(values), max(len(first), len(second)) <= EXACT_MAX
    method = MANN_WHITNEY if has_ties else MANN_WHITNEY_EXACT if is_small else MANN_WHITNEY_LARGE
    found = mannwhitneyu(first, second, method="exact" if method == MANN_WHITNEY_EXACT else "asymptotic")
    return Finding(method, float(found.statistic), float(found.pvalue))


def holm(ps: Sequence[float]) -> list[float]:
    """Return p of several tests, each corrected by Holm's method for their number.

    Example:
        >>> holm([0.01, 0.04, 0.03])
        [0.03, 0.06, 0.06]
    """
    ps = [check_number("p", p, 0, 1) for p in ps]
    corrected, least = [0.0] * len(ps), 0.0
    for rank, number in enumerate(sorted(range(len(ps)), key=ps.__getitem__)):
        least = max(least, min((len(ps) - rank) * ps[number], 1.0))
        corrected[number] = least
    return corrected


def _corrected(pairs: Sequence[Pair], omnibus: Finding | None = None) -> Comparison:
    ps = holm([each.test.p for each in pairs])
    corrected = tuple(replace(each, p=p) for each, p in zip(pairs, ps, strict=True))
    return Comparison(corrected, omnibus, HOLM if len(pairs) > 1 else "")


# ---- survival ----


class Solved(NamedTuple):
    """When evolutions of one setting solved their task.

    Attributes:
        evaluations: Number of evaluations until then; of an evolution that did not, of all.
        is_solved: Whether each did.
    """

    evaluations: tuple[int, ...]
    is_solved: tuple[bool, ...]


class Survival(NamedTuple):
    """The share of evolutions that have solved their task after a number of evaluations, by Kaplan and Meier.

    Attributes:
        evaluations: Numbers of evaluations, from 0, float64 [step].
        share: The share that has solved it from there on, float64 [step].
        low: Lower end of its interval of 95 %, by the log-log transform, float64 [step]; NaN where there is none.
        high: Upper end.
    """

    evaluations: Floats
    share: Floats
    low: Floats
    high: Floats


def survival(solved: Solved) -> Survival:
    """Return the share of evolutions that have solved their task, over evaluations.

    Args:
        solved: When they did.

    Example:
        >>> found = survival(Solved((100, 200, 200, 400), (True, True, False, True)))
        >>> found.evaluations.tolist(), found.share.tolist()
        ([0.0, 100.0, 200.0, 400.0], [0.0, 0.25, 0.5, 1.0])
    """
    from scipy.stats import ecdf

    curve = ecdf(_censored(solved)).sf
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # where no evolution, or each, has solved it: no interval
        interval = curve.confidence_interval(CONFIDENCE, method="log-log")
    columns = [curve.probabilities, interval.high.probabilities, interval.low.probabilities]
    share, low, high = (np.concatenate([[0.0], 1.0 - each]) for each in columns)
    return Survival(np.concatenate([[0.0], curve.quantiles]), share, low, high)


def compare_solved(groups: Mapping[str, Solved]) -> Comparison:
    """Return what the log-rank test says about when settings solved a task: each two, corrected by Holm's method.

    Args:
        groups: When evolutions of each setting did, by its name.

    Example:
        >>> early, late = Solved((10, 20, 30), (True,) * 3), Solved((40, 50, 60), (True, True, False))
        >>> compare_solved({"early": early, "late": late}).pairs[0].test.method
        'log-rank (normal approximation)'
    """
    from scipy.stats import logrank

    pairs = []
    for names in combinations(groups, 2):
        first, second = (groups[name] for name in names)
        test = Finding(LOG_RANK, 0.0, 1.0)
        if any((*first.is_solved, *second.is_solved)):
            with np.errstate(all="ignore"):
                found = logrank(_censored(first), _censored(second))
            if np.isfinite(found.pvalue):
                test = Finding(LOG_RANK, float(found.statistic), float(found.pvalue))
        pairs.append(Pair(*names, test, test.p))
    return _corrected(pairs)


def _censored(solved: Solved) -> Any:
    from scipy.stats import CensoredData

    evaluations, is_solved = _sample(solved.evaluations), np.array(solved.is_solved, np.bool_)
    return CensoredData.right_censored(evaluations, ~is_solved)
