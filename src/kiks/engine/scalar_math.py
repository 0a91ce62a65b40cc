"""The functions of `numbers` for callers in Python: compiled once, and loaded from the cache at the next start.

A kernel that Python calls directly is compiled anew in each process, which takes up to half a second.
"""

from __future__ import annotations

from kiks.engine import numbers
from kiks.engine.compiling import entry

sin_cos, exponential, logarithm, power, uniform = (
    entry(kernel.py_func)
    for kernel in (numbers.sin_cos, numbers.exponential, numbers.logarithm, numbers.power, numbers.uniform)
)
