"""What a page needs to show a run, beside where everything is: the messages of a desk, and from when on each holds."""

from __future__ import annotations

import base64
from typing import Any

from kiks.export.frames import arena_picture
from kiks.model.arena import Arena
from kiks.units import TICK_NS

PERIOD_NS = 4 * TICK_NS
"""Time between two frames [ns], that of a desk."""


class ShownRun:
    """A run on a page.

    Attributes:
        begin_ns: When it begins [ns].
        end_ns: When it ends [ns].
        period_ns: Time between two frames [ns]; the last one may come earlier.
        scenes: Messages of `describe_scene`; `picture` of the arena is an index of the pictures.
        shapes: Messages of `describe_shapes`, and from which frame on each holds.
    """

    def __init__(self, begin_ns: int, end_ns: int) -> None:
        self.begin_ns, self.end_ns, self.period_ns = begin_ns, end_ns, PERIOD_NS
        self.scenes: list[dict[str, Any]] = []
        self.shapes: list[tuple[int, dict[str, Any]]] = []
        self._pictures: list[bytes] = []

    def add_picture(self, arena: Arena) -> int:
        """Return the index of the picture of an arena's walls, which is added if it is not there."""
        if (picture := arena_picture(arena)) not in self._pictures:
            self._pictures.append(picture)
        return self._pictures.index(picture)

    def messages(self) -> dict[str, Any]:
        """Return the messages, for JSON."""
        return {
            "scenes": self.scenes,
            "shapes": self.shapes,
            "pictures": [f"data:image/png;base64,{base64.b64encode(each).decode()}" for each in self._pictures],
        }
