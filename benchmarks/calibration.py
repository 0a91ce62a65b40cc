"""A fixed piece of plain Python to measure computers by, so that figures from different days can be compared."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable


def calibration_loops_per_s(clock: Callable[[], float] = time.perf_counter) -> float:
    """Return how often a second this computer does a fixed piece of work (a third of a millisecond or so).

    Args:
        clock: Tells the seconds; `time.process_time` leaves out what other programs take.
    """

    def work() -> int:
        total = 0
        for k in range(5000):
            total = (total * 31 + k) % 65521
        return total

    rates = []
    for _ in range(7):
        start_s = clock()
        for _ in range(50):
            work()
        rates.append(50 / (clock() - start_s))
    return statistics.median(rates)


def median_of(repeats: int, measure: Callable[[], float]) -> float:
    """Return the median of some measurements."""
    return statistics.median(measure() for _ in range(repeats))


def report(rows: list[tuple[str, float, str]], *, as_json: bool) -> None:
    """Print the figures, one JSON object a line or as a table."""
    for name, value, unit in rows:
        if as_json:
            print(json.dumps({"name": name, "value": round(value, 4), "unit": unit}))
        else:
            print(f"{name:32} {value:14,.2f} {unit}")
