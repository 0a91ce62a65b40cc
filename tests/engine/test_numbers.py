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
from kiks.engine.scalar_math import exponential, logarithm, power, sin_cos, uniform

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
