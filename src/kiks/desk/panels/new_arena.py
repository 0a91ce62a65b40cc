"""The dialogs for a new box and a new maze."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from kiks.desk.panels.widgets import named
from kiks.errors import KiksError
from kiks.model.arena import Arena
from kiks.model.materials import REFLECTANCES


async def ask_for_box() -> Arena | None:
    """Ask for the dimensions of an empty box and return it; None if the person cancels."""
    with ui.dialog() as dialog, ui.card().classes("w-96"):
        ui.label("New arena").classes("text-h6")
        ui.label("Robots stay; balls, cylinders and lamps are removed. Time starts at 0.").classes("text-body2")
        width_mm = _number("Width in mm, walls included", 1000, "box-width", 100, 8000)
        height_mm = _number("Height in mm, walls included", 800, "box-height", 100, 8000)
        wall_mm = _number("Thickness of the wall in mm", 10, "box-wall", 0, 1000)
        rounded_mm = _number("Radius of the corners in mm", 0, "box-rounded", 0, 4000)
        material = ui.select([*REFLECTANCES], label="Wall of", value="white").props("data-testid=box-material")
        material.classes("w-full").tooltip("The material sets the brightness of the wall")

        def make() -> Arena:
            return Arena.box(
                width_mm(), height_mm(), wall_mm=wall_mm(), rounded_mm=rounded_mm(), brightness=str(material.value)
            )

        _finish(dialog, make)
    return await _answer(dialog)


async def ask_for_maze() -> Arena | None:
    """Ask for the dimensions of a maze and return it; None if the person cancels."""
    with ui.dialog() as dialog, ui.card().classes("w-96"):
        ui.label("Random maze").classes("text-h6")
        ui.label("Robot 1 starts at the entrance, a lamp marks the exit. Time starts at 0.").classes("text-body2")
        columns = _number("Columns", 5, "maze-columns", 1, 100)
        rows = _number("Rows", 5, "maze-rows", 1, 100)
        path_mm = _number("Width of the passages in mm", 120, "maze-path", 79, 10_000)
        wall_mm = _number("Thickness of walls in mm", 10, "maze-wall", 1, 1000)
        seed = _number("Seed (the same seed makes the same maze)", 0, "maze-seed", 0, 2**53)

        def make() -> Arena:
            return Arena.maze(columns=columns(), rows=rows(), path_mm=path_mm(), wall_mm=wall_mm(), seed=seed())

        _finish(dialog, make)
    return await _answer(dialog)


def _number(label: str, value: int, name: str, low: int, high: int) -> Callable[[], int]:
    """Build a field for a whole number and return its getter, which returns -1 for an empty field."""
    field = ui.number(label, value=value, min=low, max=high, precision=0).classes("w-full")
    named(field, name).props("dense")
    return lambda: -1 if field.value is None else int(field.value)


def _finish(dialog: ui.dialog, make: Callable[[], Arena]) -> None:
    """Build the buttons of a dialog, which stays open while its values are invalid."""

    def submit() -> None:
        try:
            dialog.submit(make())
        except KiksError as error:
            ui.notify(str(error), type="negative", multi_line=True, close_button="OK")

    with ui.row().classes("w-full justify-end"):
        ui.button("Cancel", on_click=lambda: dialog.submit(None)).props("flat no-caps data-testid=dialog-cancel")
        ui.button("Create", on_click=submit).props("no-caps data-testid=dialog-ok").mark("dialog-ok")


async def _answer(dialog: ui.dialog) -> Arena | None:
    answer = await dialog
    dialog.delete()
    return answer if isinstance(answer, Arena) else None
