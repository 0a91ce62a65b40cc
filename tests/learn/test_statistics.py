"""Statistics with answers that are known."""

from itertools import combinations
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from tests.at_length import at_length
from tests.learn.small import refused

from kiks.learn import statistics


def test_wilsons_interval_is_that_of_newcombe() -> None:
    """Newcombe, Two-sided confidence intervals for the single proportion, Statistics in Medicine 17 (1998), table I."""
    known = {(81, 263): (0.2553, 0.3662), (15, 148): (0.0624, 0.1605), (0, 20): (0, 0.1611), (1, 29): (0.0061, 0.1718)}
    for (count, total), interval in known.items():
        assert statistics.wilson_interval(count, total) == pytest.approx(interval, abs=5e-5)
    refused("count must be a whole number from 0 to 2, but it was 3", statistics.wilson_interval, 3, 2)
    refused("count must be a whole number from 0 to 2, but it was -1", statistics.wilson_interval, -1, 2)
    refused("count must be a whole number from 0 to 3, but it was 1.5", statistics.wilson_interval, 1.5, 3)
    refused("total must be a whole number from 1 to .*, but it was 0", statistics.wilson_interval, 0, 0)


def test_the_bootstrap_covers_the_median_as_often_as_it_says() -> None:
    """Of 5 values, the interval from the least to the greatest misses the median with a chance of 2 / 2**5."""
    assert statistics.median_interval([3.0]) is None
    found = statistics.median_interval([5.0, 1.0, 4.0, 2.0, 3.0])
    assert found == statistics.median_interval([5.0, 1.0, 4.0, 2.0, 3.0]) == (1.0, 5.0)
    rng = np.random.default_rng(1)
    intervals = [statistics.median_interval(rng.standard_normal(25).tolist()) for _ in range(60)]
    covered = sum(each is not None and each.low <= 0.0 <= each.high for each in intervals)
    assert statistics.wilson_interval(covered, 60).high > 0.95 > statistics.wilson_interval(covered, 60).low


def test_the_exact_p_is_that_of_the_tables_and_a_counts_pairs() -> None:
    """U of 5 and 5 values is at most 2 in 4 of 252 orders: two-sided p is 0.0317 (Mann and Whitney 1947, table I)."""
    found = statistics.mann_whitney([1.0, 2.0, 3.0, 4.0, 7.0], [5.0, 6.0, 8.0, 9.0, 10.0])
    assert (found.method, found.statistic) == (statistics.MANN_WHITNEY_EXACT, 2.0)
    assert found.p == pytest.approx(8 / 252)
    rng = np.random.default_rng(1)
    for sizes in ((1, 1), (3, 5), (10, 10)):
        first, second = (rng.integers(0, 6, size).astype(float).tolist() for size in sizes)
        (found,) = statistics.compare({"a": first, "b": second}).pairs
        wins = sum((one > two) + (one == two) / 2 for one in first for two in second)
        assert (found.test.statistic, found.a) == (wins, wins / (len(first) * len(second)))
        (other,) = statistics.compare({"b": second, "a": first}).pairs
        assert (other.a, other.p) == (pytest.approx(1 - found.a), pytest.approx(found.p))
        assert found.a_interval.low <= found.a <= found.a_interval.high


def test_the_interval_of_a_is_that_of_newcombe() -> None:
    """The first is the example of R's package scda, to the 1e-4 of its search; the others are looked for step by step.

    An A belongs to the interval if the A found is within 1.96 standard deviations of Newcombe's method 5.
    """
    assert statistics.a_interval(38.5 / 42, 6, 7) == pytest.approx((0.5973406, 0.9860176), abs=1e-4)
    truths = np.linspace(0, 1, 200_001)
    for a, m, n in ((0.0, 5, 5), (1.0, 5, 5), (1.0, 1, 1), (0.5, 5, 5), (0.31, 3, 8), (0.999, 100, 40), (1e-9, 4, 4)):
        more = (m + n) / 2 - 1
        variances = truths * (1 - truths) / (m * n)
        variances *= 1 + more * (1 - truths) / (2 - truths) + more * truths / (1 + truths)
        inside = truths[np.abs(a - truths) <= 1.959964 * np.sqrt(variances)]
        low, high = statistics.a_interval(a, m, n)
        assert (low, high) == pytest.approx((inside.min(), inside.max()), abs=1e-5)
        assert 0 <= low <= a <= high <= 1
        assert high - low > 0.01
        assert statistics.a_interval(1 - a, m, n) == pytest.approx((1 - high, 1 - low))


@at_length
def test_the_interval_of_a_covers_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    for m, n, shift in ((5, 5, 0.0), (5, 5, 2.5), (3, 8, 1.0), (20, 20, 1.5)):
        truth = NormalDist().cdf(shift / 2**0.5)
        one, other = rng.standard_normal((4000, m, 1)) + shift, rng.standard_normal((4000, 1, n))
        ends = np.array([statistics.a_interval(each, m, n) for each in (one > other).mean(axis=(1, 2)).tolist()])
        assert 0.93 < ((ends[:, 0] <= truth) & (truth <= ends[:, 1])).mean() < 0.99


def test_the_interval_of_a_mean_ends_where_no_value_can_be() -> None:
    contacts = [0.0, 0.0, 1.2, 0.1, 0.0]
    mean, low, high = statistics.mean_interval(contacts)
    assert low < 0 < mean < high
    assert statistics.mean_interval(contacts, within=(0, np.inf)) == (mean, 0, high)
    assert statistics.mean_interval([0.9, 1.0], within=(0, 1))[2] == 1


def test_effects_have_names() -> None:
    for first, second, a, effect in (
        ([1.0] * 5, [1.0] * 5, 0.5, "negligible"),
        ([2.0] * 5, [1.0] * 5, 1.0, "large"),
        ([0.0] * 5, [1.0] * 5, 0.0, "large"),
        ([1.0, 2.0, 2.0, 2.0, 3.0], [1.0, 2.0, 2.0, 2.0, 2.0], 0.58, "small"),
        ([1.0] * 71 + [-1.0] * 29, [0.0], 0.71, "large"),
        ([1.0] * 29 + [-1.0] * 71, [0.0], 0.29, "large"),
    ):
        (found,) = statistics.compare({"a": first, "b": second}).pairs
        assert (found.a, found.effect, found.test.method) == (pytest.approx(a), effect, statistics.MANN_WHITNEY)


@pytest.mark.parametrize("bad", [[1.0, float("nan")], [], ["a"], [[1.0]]])
def test_a_sample_without_values_or_with_others_than_numbers_is_an_error(bad: Any) -> None:
    good = [1.0, 2.0]
    for wrong in (
        lambda: statistics.compare({"a": good, "b": bad}),
        lambda: statistics.compare({"a": good, "b": good, "c": bad}),
        lambda: statistics.mann_whitney(bad, good),
        lambda: statistics.median_interval(bad),
        lambda: statistics.survival(statistics.Solved(bad, (True,) * len(bad))),
    ):
        refused("a sample must", wrong)
    refused("p must be from 0 to 1", statistics.holm, [0.5, float("nan")])


def test_all_settings_together_and_each_two() -> None:
    """H of ranks 1 to 12 in order is 9.846 (12 / (12 x 13) x (10**2 + 26**2 + 42**2) / 4 - 3 x 13)."""
    samples = {"a": [1.0, 2.0, 3.0, 4.0], "b": [5.0, 6.0, 7.0, 8.0], "c": [9.0, 10.0, 11.0, 12.0]}
    found = statistics.compare(samples)
    assert found.omnibus.method == statistics.KRUSKAL_WALLIS
    assert found.omnibus.statistic == pytest.approx(9.846, abs=1e-3)
    assert found.omnibus.p == pytest.approx(np.exp(-9.846 / 2), abs=1e-5)  # of chi squared with two degrees of freedom
    assert [(each.first, each.second) for each in found.pairs] == list(combinations("abc", 2))
    assert [each.test.p for each in found.pairs] == pytest.approx([2 / 70] * 3)
    assert [each.p for each in found.pairs] == pytest.approx([6 / 70] * 3)
    assert found.correction == "Holm"
    same = statistics.compare({name: [1.0, 1.0] for name in samples})
    assert same.omnibus.p == 1.0
    two = statistics.compare({name: samples[name] for name in "ab"})
    assert (two.omnibus, two.correction, two.pairs[0].p) == (None, "", two.pairs[0].test.p)


def test_holms_correction() -> None:
    """The smallest p counts as many times as there are tests; none becomes smaller than the one before it."""
    assert statistics.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert (statistics.holm([0.9, 0.8]), statistics.holm([])) == ([1.0, 1.0], [])


TREATED = statistics.Solved(
    (6, 6, 6, 6, 7, 9, 10, 10, 11, 13, 16, 17, 19, 20, 22, 23, 25, 32, 32, 34, 35),
    tuple(bool(int(each)) for each in "111010100110001100000"),
)
PLACEBO = statistics.Solved((1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23), (True,) * 21)
"""Weeks of remission with 6-mercaptopurine and without (Freireich et al., Blood 21, 1963)."""


def test_survival_and_the_log_rank_test_are_those_of_the_textbooks() -> None:
    """Kalbfleisch and Prentice, The statistical analysis of failure time data, table 1.1 and section 1.4.

    Chi squared of these data is 16.79.
    """
    found = statistics.survival(TREATED)
    steps = np.searchsorted(found.evaluations, [6, 7, 10, 13, 16, 22, 23, 35])
    known = [0.857, 0.807, 0.753, 0.690, 0.627, 0.538, 0.448, 0.448]
    assert 1 - found.share[steps] == pytest.approx(known, abs=5e-4)
    assert (found.low[steps] < found.share[steps]).all()
    assert (found.share[steps] < found.high[steps]).all()
    assert statistics.survival(PLACEBO).share[-1] == 1.0
    (found,) = statistics.compare_solved({"treated": TREATED, "placebo": PLACEBO}).pairs
    assert found.test.statistic**2 == pytest.approx(16.79, abs=5e-3)
    assert found.p == pytest.approx(4.17e-5, abs=1e-7)
    assert (found.a, found.effect) == (None, "")


def test_evolutions_that_never_solve_a_task_do_not_differ() -> None:
    never = statistics.Solved((10, 10), (False, False))
    assert statistics.survival(never).share.tolist() == [0.0, 0.0]
    pairs = statistics.compare_solved({"a": never, "b": never, "c": statistics.Solved((5,), (True,))}).pairs
    assert pairs[0].p == 1.0
    assert pairs[1].test.p < 1.0
