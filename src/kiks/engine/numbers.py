"""Sine, power, tanh and random numbers that give the same bits on every machine.

Mathematical libraries differ between systems in the last bit, and a run must not. So these functions use additions,
multiplications, divisions, square roots and roundings only, which IEEE 754 fixes to the bit. Sine, cosine and random
numbers also work on lanes (`kiks.engine.simd.lanes`). Random numbers are counter-based: a pure function of seed,
world, robot, stream, instant and index, so neither order nor threads matter.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import inlined, kernel
from kiks.engine.simd.lanes import floor, number, word
from kiks.engine.simd.masks import choose, everywhere, has_bit

# Pi/2 and ln 2 in two parts: the first has 33 bits, so that its product with a count below 2^20 is exact.
_HALF_PI_HIGH = 1.5707963267341256
_HALF_PI_LOW = 6.077100506506192e-11
_LN2_HIGH = 0.6931471804855391
_LN2_LOW = 7.440617110012397e-11

SMALL_RAD = 0.78
"""Angles below this need no reduction to a quarter of a circle."""

FARTHEST_RAD = 1e9
"""Larger angles are limited to this: its number of quarters fits 32 bits, and the remainder stays below pi/4."""

TANH_IS_1 = 6.297
"""From here on, `tanh` is 1."""

# Arctangents of 0/8 to 8/8 in two parts: the first are multiples of 2^-36, so that their sums with pi/2 are exact.
_ARCS_HIGH = (
    0.0,
    0.12435499455023091,
    0.24497866313322447,
    0.35877067026740406,
    0.4636476089945063,
    0.5585993153363233,
    0.6435011087887688,
    0.7188299996196292,
    0.7853981633961666,
)
_ARCS_LOW = (
    0.0,
    -3.469477832853372e-12,
    -6.360318231443825e-12,
    3.1681633104059955e-12,
    6.29981671855921e-12,
    7.239092754135322e-12,
    4.515625942842951e-12,
    1.995271341467887e-12,
    1.2816720757972595e-12,
)

_RECIPROCALS = (0.0, *(1.0 / k for k in range(1, 22)))  # a multiplication costs a fraction of a division


@kernel
def sine_rest(q: Any) -> Any:
    """Return sin(r)/r - 1 for an angle r within +-pi/4 from its square (Taylor series)."""
    rest = 1.0 / 355687428096000.0
    rest = rest * q - 1.0 / 1307674368000.0
    rest = rest * q + 1.0 / 6227020800.0
    rest = rest * q - 1.0 / 39916800.0
    rest = rest * q + 1.0 / 362880.0
    rest = rest * q - 1.0 / 5040.0
    rest = rest * q + 1.0 / 120.0
    rest = rest * q - 1.0 / 6.0
    return q * rest


@kernel
def sin_cos_of_small(r: Any) -> Any:
    """Return sine and cosine of an angle within +-pi/4 (Taylor series)."""
    q = r * r
    cosine = 1.0 / 20922789888000.0
    cosine = cosine * q - 1.0 / 87178291200.0
    cosine = cosine * q + 1.0 / 479001600.0
    cosine = cosine * q - 1.0 / 3628800.0
    cosine = cosine * q + 1.0 / 40320.0
    cosine = cosine * q - 1.0 / 720.0
    cosine = cosine * q + 1.0 / 24.0
    return r + r * sine_rest(q), 1.0 - q * 0.5 + q * q * cosine


@kernel
def sin_cos(angle_rad: Any) -> Any:
    """Return sine and cosine, each within 2e-16 for angles up to a million radians.

    For other numbers and NaN they belong to some angle: a direction always has length 1, so a ray never leaves the
    raster.
    """
    angle_rad = min(max(-FARTHEST_RAD, angle_rad), FARTHEST_RAD)
    turns = floor(angle_rad * 0.6366197723675814 + 0.5)
    r = (angle_rad - turns * _HALF_PI_HIGH) - turns * _HALF_PI_LOW
    sine, cosine = sin_cos_of_small(r)
    # The quarter is unpredictable, so these are selections without a branch.
    is_swapped, is_second_half = has_bit(turns, 0), has_bit(turns, 1)
    first = choose(is_swapped, cosine, sine)
    second = choose(is_swapped, sine, cosine)
    return choose(is_second_half, -first, first), choose(is_swapped != is_second_half, -second, second)


@kernel
def sinc(angle_rad: Any) -> Any:
    """Return sin(a)/a: the ratio of a chord to its arc of twice that angle."""
    is_small = abs(angle_rad) < SMALL_RAD
    ratio = 1.0 + sine_rest(angle_rad * angle_rad)
    if everywhere(is_small):
        return ratio
    return choose(is_small, ratio, sin_cos(angle_rad)[0] / angle_rad)


@kernel
def halves(x: Any) -> Any:
    """Return a number as the sum of two that have at most 26 bits each (Veltkamp)."""
    scaled = x * 134217729.0
    high = scaled - (scaled - x)
    return high, x - high


@kernel
def exact_product(a: Any, b: Any) -> Any:
    """Return the product of two numbers, and what rounding has taken off it (Dekker)."""
    product, (a_high, a_low), (b_high, b_low) = a * b, halves(a), halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


@kernel
def direction(y: Any, y_low: Any, x: Any) -> Any:
    """Return the angle of (x, y + y_low) from the x-axis, 0 to pi, for y >= 0 and a y_low below its last digit.

    With t the ratio of the smaller to the larger, and c the multiple of 1/8 next to it (0 for 1/8), arctan(t) is
    arctan(c) + arctan(r), where r = (t - c) / (1 + c t) is at most 3/16: then a Taylor series. The last digit would not
    be right without the remainder of that division.
    """
    is_steep, is_back = y > abs(x), x < 0.0
    across, along = (abs(x), y) if is_steep else (y, abs(x))
    across_low, along_low = (0.0, y_low) if is_steep else (y_low, 0.0)
    ratio = across / along
    if not ratio <= 1.0:
        return 0.0
    eighths = math.floor(8.0 * ratio + 0.5)
    if eighths == 1.0:
        eighths = 0.0
    c = 0.125 * eighths
    above, lost = exact_product(c, along)
    above = (across - above) - lost  # exact, as both are within half and twice of each other
    below = along + c * across
    r = above / below
    back, lost = exact_product(r, below)
    rest = (above - back) - lost + (across_low - c * along_low) - r * (along_low + c * across_low)
    q = r * r
    series = 0.0
    for k in range(21, 1, -2):
        series = _RECIPROCALS[k] - q * series
    high, low = _ARCS_HIGH[int(eighths)], _ARCS_LOW[int(eighths)] + (rest / below - r * q * series)
    if is_steep:
        high, r, low = _HALF_PI_HIGH - high, -r, _HALF_PI_LOW - low
    if is_back:
        high, r, low = 2.0 * _HALF_PI_HIGH - high, -r, 2.0 * _HALF_PI_LOW - low
    return high + (r + low)


@kernel
def arctangent2(y: Any, x: Any) -> Any:
    """Return the angle of (x, y) from the x-axis, above -pi to pi, within 0.8 of the last digit; 0 for (0, 0) and NaN.

    For numbers from 1e-290 to 1e290. Zero has no sign here: the angle of (-1, -0.0) is pi.
    """
    angle_rad = direction(abs(y), 0.0, x)
    return -angle_rad if y < 0.0 else angle_rad


@kernel
def arccosine(x: Any) -> Any:
    """Return the angle with this cosine, 0 to pi, within 0.9 of the last digit; numbers beyond 1 and -1 count as these.

    It is the direction of (x, sine), with the digits of the sine that rounding takes off.
    """
    x = min(max(-1.0, x), 1.0)
    sine = math.sqrt((1.0 - x) * (1.0 + x))
    (larger, more), (smaller, less) = exact_product(x, x), exact_product(sine, sine)
    if larger < smaller:
        larger, smaller = smaller, larger
    missing = ((1.0 - larger) - smaller) - (more + less)
    return direction(sine, missing / (2.0 * sine) if sine > 0.0 else 0.0, x)


@kernel
def exponential(x: Any) -> Any:
    """Return e to the power of x; 0 below -700 and for NaN."""
    if not x >= -700.0:
        return 0.0
    x = min(x, 800.0)  # the result is infinite from there on
    shift = math.floor(x * 1.4426950408889634 + 0.5)
    r = (x - shift * _LN2_HIGH) - shift * _LN2_LOW
    total = 1.0
    for k in range(14, 0, -1):
        total = 1.0 + total * r * _RECIPROCALS[k]
    return math.ldexp(total, int(shift))


@kernel
def logarithm(x: Any) -> Any:
    """Return the natural logarithm of a positive number (series of 2 artanh((m-1)/(m+1)))."""
    mantissa, shift = math.frexp(x)
    if mantissa < 0.7071067811865476:
        mantissa *= 2.0
        shift -= 1
    s = (mantissa - 1.0) / (mantissa + 1.0)
    q = s * s
    total = 0.0
    for k in range(21, 0, -2):
        total = total * q + _RECIPROCALS[k]
    return 2.0 * s * total + shift * _LN2_LOW + shift * _LN2_HIGH


@kernel
def power(base: Any, exponent: Any) -> Any:
    """Return a non-negative base to a positive exponent."""
    if base <= 0.0:
        return 0.0
    return exponential(exponent * logarithm(base))


@inlined
def tanh_fraction(x: Any) -> Any:
    """Return the continued fraction of the hyperbolic tangent to the ninth level: within 7e-6 up to 1."""
    q = x * x
    above = (((q + 990.0) * q + 135135.0) * q + 4729725.0) * q + 34459425.0
    below = (((45.0 * q + 13860.0) * q + 945945.0) * q + 16216200.0) * q + 34459425.0
    return x * above / below


@kernel
def tanh(x: Any) -> Any:
    """Return the hyperbolic tangent of a number within 7e-6."""
    if abs(x) >= TANH_IS_1:
        return 1.0 if x > 0.0 else -1.0
    return tanh_fraction(x)


@kernel
def mix(value: Any) -> Any:
    """Mix 64 bits so that each bit of the input flips half of the output (the finalizer of SplitMix64)."""
    z = word(value) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
def stream_of(seed: Any, world: Any, robot: Any, stream: Any) -> Any:
    """Return the origin of the random numbers of a seed, world, robot and stream, for `at_instant`."""
    z = mix(word(seed))
    z = mix(z ^ word(world))
    z = mix(z ^ word(robot))
    return mix(z ^ word(stream))


@kernel
def at_instant(origin: Any, instant: Any) -> Any:
    """Return the origin of the random numbers of a stream at an instant, for `draw`."""
    return mix(origin ^ word(instant))


@kernel
def draw(origin: Any, index: Any) -> Any:
    """Return the random number in [0, 1) of an index at an instant."""
    z = mix(origin ^ word(index))
    return number(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@kernel
def uniform(seed: Any, world: Any, robot: Any, stream: Any, instant: Any, index: Any) -> Any:
    """Return the random number in [0, 1) of a seed, world, robot, stream, instant and index."""
    return draw(at_instant(stream_of(seed, world, robot, stream), instant), index)
