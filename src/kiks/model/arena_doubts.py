"""What is probably not meant in the arena of a file: each doubt is a warning of one line, and no error."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError
from kiks.model.arena import MOSTLY_WALL, PAD, TURN_ROUND, Arena

LEAST_SHARE = 0.45
"""Share of the floor below which a start draws a warning: two rooms that are drawn alike differ by some cells."""

_BLACK_IS_FLOOR = f"black (0) is floor, and all else wall. {TURN_ROUND}"

_log = logging.getLogger("kiks.model")


def check_has_floor(is_wall: npt.NDArray[np.bool_], rule: str) -> None:
    """Raise if all of a picture is wall by a rule, which the message names."""
    if is_wall.all():
        raise ArenaError(f"a picture must have floor, but all of it is wall: {rule}")


def doubt_colours(arena: Arena, path: Path, rule: str | None = None) -> None:
    """Warn if a picture makes no wall at all; or nearly nothing else, if it follows the usual rule.

    Args:
        arena: The arena.
        path: Its file.
        rule: What is wall in it; all but black if None, where people may have drawn it the other way round.
    """
    share = float((arena.brightness > 0).mean())
    if share == 0:
        _log.warning("%r has no wall: %s", str(path), rule or _BLACK_IS_FLOOR)
    elif rule is None and share > MOSTLY_WALL:
        _log.warning("%.0f %% of %r is wall: %s", 100 * share, str(path), _BLACK_IS_FLOOR)


def doubt_starts(arena: Arena, path: Path, radius_mm: float) -> None:
    """Warn of starts from which a robot of a radius [mm] cannot reach most of the floor."""
    from scipy.ndimage import label

    has_room = arena.clearance[PAD:-PAD, PAD:-PAD] - 0.5 * arena.mm_per_cell >= radius_mm
    room = int(np.count_nonzero(has_room))
    parts: npt.NDArray[Any] = label(has_room)[0]
    for number, pose in enumerate(arena.starts or (arena.widest_place(),), start=1):
        part = parts[int(pose.y_mm / arena.mm_per_cell), int(pose.x_mm / arena.mm_per_cell)]
        if part == 0:
            continue  # it does not fit, as other messages say
        if (share := np.count_nonzero(parts == part) / room) < LEAST_SHARE:
            _log.warning(
                "%s of %r, (%g, %g) mm, lies in a part with %.0f %% of the floor, from which a Khepera reaches no "
                "other one. %s",
                f"Start {number}" if arena.starts else "The roomiest place",
                str(path),
                *pose[:2],
                100 * share,
                "Move it, or open a way." if arena.starts else "Robots start there: give a [[start]], or open a way.",
            )
