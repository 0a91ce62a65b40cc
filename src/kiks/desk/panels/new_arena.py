"""The dialogs for a new box and a new maze."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from nicegui import ui

from kiks.desk.panels.widgets import NumberField, answer, dialog, finish, select
from kiks.model.arena import Arena
from kiks.model.materials import REFLECTANCES


async def ask_for_box() -> Arena | None:
    """Ask for the dimensions of an empty box and return it; None if the person cancels."""
    with dialog("New arena") as asked:
        ui.label("Robots stay; balls, cylinders and lamps are removed. Time starts at 0.").classes("text-body2")
        width_mm = _whole("Width in mm, walls included", "box-width", 1000, 100, 8000)
        height_mm = _whole("Height in mm, walls included", "box-height", 800, 100, 8000)
        wall_mm = _whole("Thickness of the wall in mm", "box-wall", 10, 0, 1000)
        rounded_mm = _whole("Radius of the corners in mm", "box-rounded", 0, 0, 4000)
        tip = "The material sets the brightness of the wall"
        material = select("Wall of", "box-material", [*REFLECTANCES], "white", tip).classes("w-full")

        def make() -> Arena:
            return Arena.box(
                width_mm(), height_mm(), wall_mm=wall_mm(), rounded_mm=rounded_mm(), brightness=str(material.value)
            )

        finish(asked, "Create", make)
    return cast("Arena | None", await answer(asked))


async def ask_for_maze() -> Arena | None:
    """Ask for the dimensions of a maze and return it; None if the person cancels."""
    with dialog("Random maze") as asked:
        ui.label("Robot 1 starts at the entrance, a lamp marks the exit. Time starts at 0.").classes("text-body2")
        columns = _whole("Columns", "maze-columns", 5, 1, 100)
        rows = _whole("Rows", "maze-rows", 5, 1, 100)
        path_mm = _whole("Width of the passages in mm", "maze-path", 120, 79, 10_000)
        wall_mm = _whole("Thickness of walls in mm", "maze-wall", 10, 1, 1000)
        seed = _whole("Seed (the same seed makes the same maze)", "maze-seed", 0, 0, 2**53)

        def make() -> Arena:
            return Arena.maze(columns=columns(), rows=rows(), path_mm=path_mm(), wall_mm=wall_mm(), seed=seed())

        finish(asked, "Create", make)
    return cast("Arena | None", await answer(asked))


def _whole(label: str, name: str, value: int, low: int, high: int) -> Callable[[], int]:
    """Build a field for a whole number and return its getter."""
    return NumberField(label, name, value, is_whole=True, min=low, max=high).classes("w-full").read
