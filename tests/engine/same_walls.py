"""Arenas that differ in what stands in them, not in their walls."""

from dataclasses import replace
from typing import Any

from kiks.model.arena import Arena


def with_things(arena: Arena, **things: Any) -> Arena:
    """Return an arena with other starts, lamps, balls or cylinders.

    It shares what the other one has computed of its walls: for a floor of 2 m that takes a third of a second.
    """
    changed = replace(arena, **things)
    object.__setattr__(changed, "_tables", arena._tables)
    return changed
