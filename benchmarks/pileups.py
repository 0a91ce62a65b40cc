"""Pile-ups by the thousand: 8 robots, 8 balls and 8 cylinders in a box, 60 s each, and the worst of every tick of them.

Run: python benchmarks/pileups.py [--count 1000] [--jobs 2] [--json]. Robots go at full speed and change their minds now
and then for 50 s; then they are switched off, and all bodies roll out from up to 1 m/s. Exit code 1: a disc overlapped
another one or a wall by more than 0.5 mm, bodies gained energy, or a robot that was switched off went farther than its
share of the rest of an overlap. The oracle is `tests/piles.py`.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.piles import DEEPEST_MM, SHOVED_MM, Pile, calm, rush

from calibration import report

RUSH_TICKS, CALM_TICKS = 5000, 1000


def worst_of(number: int) -> tuple[float, float, float]:
    """Return the deepest overlap, the deepest place in a wall, and how far a robot came that was switched off [mm]."""
    pile = Pile.make(number)
    overlap_mm, depth_mm = rush(pile, RUSH_TICKS)
    calm_overlap_mm, calm_depth_mm, moved_mm = calm(pile, CALM_TICKS)
    return max(overlap_mm, calm_overlap_mm), max(depth_mm, calm_depth_mm), moved_mm


def main() -> int:
    """Run them all and report; return the exit code."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--count", type=int, default=1000, help="pile-ups")
    arguments.add_argument("--first", type=int, default=0, help="number of the first one")
    arguments.add_argument("--jobs", type=int, default=2, help="processes")
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    options = arguments.parse_args()
    numbers = range(options.first, options.first + options.count)
    with ProcessPoolExecutor(options.jobs) as pool:
        found = list(pool.map(worst_of, numbers, chunksize=10))
    overlaps_mm, depths_mm, moved_mm = zip(*found, strict=True)
    rows = [
        ("pileups.worst_overlap", max(overlaps_mm), "mm"),
        ("pileups.worst_depth_in_wall", max(depths_mm), "mm"),
        ("pileups.farthest_without_motor", max(moved_mm), "mm"),
        ("pileups.count", float(len(found)), "1"),
    ]
    report(rows, as_json=options.json)
    for number, (overlap, depth, moved) in zip(numbers, found, strict=True):
        if max(overlap, depth) > DEEPEST_MM or moved > SHOVED_MM:
            print(
                f"pile-up {number}: overlap {overlap:.3f}, in a wall {depth:.3f}, shoved {moved:.3f}", file=sys.stderr
            )
    return int(max(*overlaps_mm, *depths_mm) > DEEPEST_MM or max(moved_mm) > SHOVED_MM)


if __name__ == "__main__":
    sys.exit(main())
