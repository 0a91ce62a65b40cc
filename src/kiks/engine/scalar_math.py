"""The functions of `numbers` for callers in Python: compiled once, and loaded from the cache at the next start.

A kernel that Python calls directly is compiled anew in each process, which takes up to half a second.
"""

from __future__ import annotations

from typing import Any

from kiks.engine import numbers
from kiks.engine.compiling import entry


@entry
def sin_cos(angle_rad: Any) -> Any:
    """Return the sine and the cosine of an angle; see `numbers.sin_cos`."""
    return numbers.sin_cos(angle_rad)


@entry
def arctangent2(y: Any, x: Any) -> Any:
    """Return the angle of a direction; see `numbers.arctangent2`."""
    return numbers.arctangent2(y, x)


@entry
def arccosine(x: Any) -> Any:
    """Return the angle with a cosine; see `numbers.arccosine`."""
    return numbers.arccosine(x)


@entry
def exponential(x: Any) -> Any:
    """Return e to the power of x; see `numbers.exponential`."""
    return numbers.exponential(x)


@entry
def logarithm(x: Any) -> Any:
    """Return the natural logarithm; see `numbers.logarithm`."""
    return numbers.logarithm(x)


@entry
def power(base: Any, exponent: Any) -> Any:
    """Return a power of a positive number; see `numbers.power`."""
    return numbers.power(base, exponent)


@entry
def uniform(seed: Any, world: Any, robot: Any, stream: Any, instant: Any, index: Any) -> Any:
    """Return a random number from 0 to 1; see `numbers.uniform`."""
    return numbers.uniform(seed, world, robot, stream, instant, index)
