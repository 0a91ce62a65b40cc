"""The engine's own mathematics agrees with the library's, and its random numbers are random."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share

from kiks.engine import numbers
from kiks.engine.compiling import entry
from kiks.engine.scalar_math import arccosine, arctangent2, exponential, logarithm, power, sin_cos, uniform

sinc = entry(numbers.sinc.py_func)

LAW = settings(derandomize=True, max_examples=share(150, 500))


@LAW
@given(st.floats(-1e6, 1e6))
def test_sine_and_cosine(angle_rad):
    sine, cosine = sin_cos(angle_rad)
    assert sine == pytest.approx(math.sin(angle_rad), rel=0, abs=4e-16)
    assert cosine == pytest.approx(math.cos(angle_rad), rel=0, abs=4e-16)
    assert sin_cos(-angle_rad) == (-sine, cosine)


@LAW
@given(st.floats(-1e4, 1e4), st.floats(-700.0, 700.0), st.floats(1e-300, 1e300))
def test_sinc_exponential_and_logarithm(angle_rad, exponent, number):
    expected = math.sin(angle_rad) / angle_rad if angle_rad else 1.0
    assert sinc(angle_rad) == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert sinc(-angle_rad) == sinc(angle_rad)
    assert exponential(exponent) == pytest.approx(math.exp(exponent), rel=1e-14)
    assert logarithm(number) == pytest.approx(math.log(number), rel=1e-14, abs=1e-15)
    assert exponential(-701.0) == 0.0
    assert exponential(0.0) == 1.0


MIDDLING = st.one_of(st.floats(-1e3, 1e3), st.floats(-1e280, 1e280), st.just(0.0))


@LAW
@given(MIDDLING, MIDDLING)
def test_arctangent_is_within_one_of_the_last_digit(y, x):
    angle_rad = arctangent2(y, x)
    expected_rad = math.atan2(y + 0.0, x + 0.0)
    assert abs(angle_rad - expected_rad) <= math.ulp(expected_rad)
    if y:
        assert arctangent2(-y, x) == -angle_rad


@LAW
@given(st.one_of(st.floats(-1.0, 1.0), st.floats(0.0, math.pi).map(math.cos), st.sampled_from((-1.0, 1.0))))
def test_arccosine_is_within_one_of_the_last_digit(cosine):
    expected_rad = math.acos(cosine)
    assert abs(arccosine(cosine) - expected_rad) <= math.ulp(expected_rad)


@LAW
@given(st.integers(0, 8), st.floats(1.0, 2.0), st.floats(-1e-9, 1e-9), st.sampled_from((-1.0, 1.0)), st.booleans())
def test_arctangent_has_no_jump_where_its_series_changes(sixteenths, x, shift, sign, is_steep):
    y, x = (2 * sixteenths + 1) / 16 * x * (1 + shift), sign * x
    if is_steep:
        x, y = y, abs(x)
    assert abs(arctangent2(y, x) - math.atan2(y, x)) <= math.ulp(math.atan2(y, x))


def test_angles_at_the_ends():
    """Nothing reads beyond the table of arctangents, whatever comes."""
    assert [arccosine(cosine) for cosine in (1.0, 1.5, -1.0, -math.inf)] == [0.0, 0.0, math.pi, math.pi]
    assert [arctangent2(0.0, 0.0), arctangent2(0.0, 5.0), arctangent2(-0.0, -5.0)] == [0.0, 0.0, math.pi]
    for y, x in product((math.nan, math.inf, -math.inf, 1.0), repeat=2):
        assert not abs(arctangent2(y, x)) > math.pi


@LAW
@given(st.floats(0.0, 1e6), st.floats(0.01, 20.0))
def test_power(base, exponent):
    assert power(base, exponent) == pytest.approx(base**exponent, rel=1e-12, abs=1e-300)


@entry
def _sample(seed, world, robot, stream, instant, index, axis, count):
    drawn = np.empty(count)
    for k in range(count):
        shift = (axis == np.arange(6)) * k
        drawn[k] = uniform(
            seed + shift[0], world + shift[1], robot + shift[2], stream + shift[3], instant + shift[4], index + shift[5]
        )
    return drawn


@pytest.mark.slow
@pytest.mark.parametrize("axis", range(6), ids=("seed", "world", "robot", "stream", "instant", "index"))
def test_uniform_is_flat_along_each_argument_and_neighbours_do_not_know_each_other(axis):
    count, bins = 100_000, 100
    drawn = _sample(3, 1, 2, 1, 77, 5, axis, count)
    assert drawn.min() >= 0.0
    assert drawn.max() < 1.0
    observed = np.bincount((drawn * bins).astype(int), minlength=bins)
    chi_square = ((observed - count / bins) ** 2 / (count / bins)).sum()
    assert 45 < chi_square < 175  # 99 degrees of freedom: 5.4 standard deviations to each side
    drawn -= 0.5
    for lag in (1, 2, 8, 64):
        correlation = (drawn[lag:] * drawn[:-lag]).mean() * 12
        assert abs(correlation) < 5 / math.sqrt(count)


def test_arguments_do_not_stand_for_each_other():
    """Six small numbers in any order are another draw: no sum or exclusive or of the arguments decides."""
    drawn = {uniform(*arguments) for arguments in product(range(4), repeat=6)}
    assert len(drawn) == 4**6
