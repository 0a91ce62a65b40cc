"""The arena panel: drawing tools, brush, brightness, undo, new arenas and files."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from nicegui import ui

from kiks.desk.panels.arena_view import ArenaView, Points
from kiks.desk.panels.exercise_dialog import Template
from kiks.desk.panels.files import FilesPanel
from kiks.desk.panels.new_arena import ask_for_box, ask_for_maze
from kiks.desk.panels.properties import PropertiesPanel
from kiks.desk.panels.shortcuts import SHORTCUTS, listen
from kiks.desk.panels.widgets import Panel, lock_note, named, select, text_button, with_props
from kiks.desk.server.desk import Desk
from kiks.desk.server.live_content import Robot
from kiks.desk.server.live_editing import Editing
from kiks.errors import ParameterError
from kiks.model import brush
from kiks.model.arena import Arena
from kiks.model.arena_objects import Ball, Cylinder, Lamp
from kiks.model.materials import REFLECTANCES, brightness_of
from kiks.model.project import ProjectRobot
from kiks.model.robot import robot_names

BRUSH_MAX_MM = 100
SNAPS: dict[float, str] = {0.0: "off", 1.0: "1 mm", 5.0: "5 mm", 10.0: "10 mm", 50.0: "50 mm"}


class _ToolButton(NamedTuple):
    """A tool for the page, and the kind of its strokes."""

    word: str
    icon: str
    hint: str
    pointer: str


TOOLS = {
    "hand": _ToolButton(
        "Hand", "pan_tool", "Drag robots, balls, cylinders and lamps; turn robots by their rim", "hand"
    ),
    "rectangle": _ToolButton("Rectangle", "rectangle", "Draw a box of wall from corner to corner", "rectangle"),
    "line": _ToolButton("Line", "horizontal_rule", "Draw a straight wall as wide as the brush", "line"),
    "disc": _ToolButton("Disc", "circle", "Draw a round wall from its middle to its rim", "disc"),
    "freehand": _ToolButton("Freehand", "gesture", "Draw a freehand wall as wide as the brush", "freehand"),
    "erase": _ToolButton("Erase", "cleaning_services", "Erase walls with the brush", "freehand"),
    "erase-box": _ToolButton("Erase a box", "crop_free", "Erase all walls in a rectangle", "rectangle"),
    "robot": _ToolButton("Robot", "smart_toy", "Add a robot; this restarts the world", "point"),
    "ball": _ToolButton("Ball", "sports_soccer", "Add a ball", "point"),
    "cylinder": _ToolButton("Cylinder", "album", "Add a cylinder", "point"),
    "lamp": _ToolButton("Lamp", "lightbulb", "Add a lamp of 1 W", "point"),
    "remove": _ToolButton(
        "Remove", "delete", "Remove the robot, ball, cylinder, lamp or drawn wall that you click", "point"
    ),
}
"""The tools by name."""


class EditorPanel(Panel):
    """The controls for drawing, opening and saving a world.

    Args:
        desk: The desk.
        editing: Edits its world.
        view: The view in which people draw.
        template: Returns the program in the editor of programs, with which an exercise may begin.
    """

    def __init__(self, desk: Desk, editing: Editing, view: ArenaView, template: Template) -> None:
        super().__init__(desk)
        self._editing, self._view = editing, view
        self._tool = "hand"
        self._buttons: dict[str, ui.button] = {}
        with ui.column().classes("w-full q-pa-md gap-3"):
            lock_note(desk)
            self.properties = PropertiesPanel(desk, editing, view, self.refresh)
            ui.separator()
            self._build_tools()
            self._build_brush()
            self._build_steps()
            if not desk.rights.is_for_others:
                FilesPanel(desk, editing, template)
        self._choose("hand")
        self.refresh()

    def _build_tools(self) -> None:
        with ui.column().classes("w-full gap-1"):
            for is_thing in (False, True):  # a row for walls, and one for what stands between them
                with ui.row().classes("w-full gap-1"):
                    for name, tool in TOOLS.items():
                        if (tool.pointer == "point") == is_thing:
                            self._build_tool(name, tool)
        self._hint = ui.label().classes("text-caption").props("data-testid=tool-hint aria-live=polite")

    def _build_tool(self, name: str, tool: _ToolButton) -> None:
        button = ui.button(icon=tool.icon, on_click=lambda: self._choose(name)).props('dense padding="6px"')
        with named(with_props(button, aria_label=tool.word), f"tool-{name}"):
            ui.tooltip(f"{tool.word}: {tool.hint}")
        self._buttons[name] = button

    def _build_brush(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            ui.label("Brush").classes("w-24")
            self._brush = ui.slider(min=1, max=BRUSH_MAX_MM, value=10, on_change=self._apply_tool)
            self._brush.props('label aria-label="Width of the brush in millimetres" data-testid=brush').classes("col")
            ui.label().bind_text_from(self._brush, "value", lambda width: f"{width:g} mm").classes("w-16")
        with ui.row().classes("w-full items-center no-wrap"):
            ui.label("Brightness").classes("w-24")
            self._brightness = ui.slider(min=1, max=255, value=255, on_change=self._show_brightness)
            self._brightness.props('label aria-label="Brightness of walls, 1 to 255" data-testid=brightness')
            self._brightness.classes("col")
            self._swatch = ui.element("div").props("aria-hidden=true data-testid=swatch")
            self._swatch.style("width: 4rem; height: 1.5rem; border: 1px solid currentColor; border-radius: 4px")
        with ui.row().classes("w-full items-center no-wrap"):
            choices = {"": "other grey"} | {name: name for name in REFLECTANCES}
            tip = "Sets the brightness of the wall to that of a real material"
            self._material = select("Material", "material", choices, "white", tip, self._take_material).classes("col")
            tip = "Corners and ends of walls snap to a grid of this size"
            self._snap = select("Snap to a grid", "snap", SNAPS, 0.0, tip, self._apply_tool).classes("col")
            tip = "The kind of robot that the robot tool adds"
            self._kind = select("Kind of robot", "robot-kind", robot_names(), "khepera", tip).classes("col")
        self._show_brightness()

    def _build_steps(self) -> None:
        editing, undo, redo = self._editing, SHORTCUTS["undo"], SHORTCUTS["redo"]
        acts = {"undo": self.acting(editing.undo), "redo": self.acting(editing.redo)}
        with ui.row().classes("w-full gap-1"):
            self._undo = text_button("Undo", "undo", "undo", f"{undo.label} ({undo.words})", acts["undo"])
            self._redo = text_button("Redo", "redo", "redo", f"{redo.label} ({redo.words})", acts["redo"])
            clear = self.acting(lambda: editing.draw(_without_walls))
            text_button("Clear", "layers_clear", "clear", "Erase all walls; robots and things stay", clear)
        with ui.row().classes("w-full gap-1"):
            box, maze = (self.acting(partial(self._begin, ask)) for ask in (ask_for_box, ask_for_maze))
            text_button("New arena", "add_box", "new-arena", "An empty box of any size", box)
            text_button("Maze", "grid_4x4", "new-maze", "A random maze with a lamp at its exit", maze)
        listen(acts)

    # ---- tools ----

    def set_visible(self, is_visible: bool) -> None:
        """Select the hand tool when a person leaves the panel."""
        super().set_visible(is_visible)
        self.properties.set_visible(is_visible)
        if not is_visible:
            self._choose("hand")

    def _choose(self, name: str) -> None:
        self._tool = name
        for each, button in self._buttons.items():
            is_chosen = each == name
            with_props(button, color="accent" if is_chosen else "primary", aria_pressed=str(is_chosen).lower())
        self._hint.text = TOOLS[name].hint + "."
        self._apply_tool()

    def _apply_tool(self) -> None:
        tool = TOOLS[self._tool]
        size_mm = 55.0 if self._tool == "robot" else 64.0 if self._tool == "ball" else 32.0
        brush_mm = size_mm if tool.pointer == "point" else float(self._brush.value or 1)
        label = "" if self._tool == "hand" else tool.word.lower()
        self._view.set_tool(tool.pointer, brush_mm=brush_mm, snap_mm=float(self._snap.value), label=label)

    def _show_brightness(self) -> None:
        grey = int(self._brightness.value)
        self._swatch.style(f"background: rgb({grey}, {grey}, {grey})")
        names = [name for name in REFLECTANCES if brightness_of(name) == grey]
        self._material.value = names[0] if names else ""

    def _take_material(self) -> None:
        if self._material.value:
            self._brightness.value = brightness_of(self._material.value)

    # ---- steps ----

    async def draw(self, kind: str, points: Points) -> None:
        """Apply a stroke of the selected tool; a person sees an error if that is not possible."""
        await self._drawn(kind, points)
        self.refresh()

    def _drawn(self, kind: str, points: Points) -> Awaitable[None]:
        editing, tool = self._editing, self._tool
        if not points:
            raise ParameterError("A stroke must have a point, but it had none. Draw again.")
        grey = 0 if tool.startswith("erase") else int(self._brightness.value)
        width_mm = float(self._brush.value)
        if kind == "rectangle":
            return editing.draw(lambda arena: brush.rectangle(arena, *points[0], *points[-1], grey))
        if kind == "disc":
            radius_mm = math.dist(points[0], points[-1]) or width_mm / 2
            return editing.draw(lambda arena: brush.disc(arena, points[0], radius_mm, grey))
        if kind in ("line", "freehand"):
            return editing.draw(lambda arena: brush.line(arena, points, width_mm=width_mm, brightness=grey))
        (x_mm, y_mm) = points[0]
        if tool == "remove":
            return editing.remove(x_mm, y_mm)
        if tool == "robot":
            return editing.place(Robot(x_mm, y_mm, math.pi / 2, ProjectRobot(self._kind.value)))
        kinds: dict[str, type[Ball | Cylinder | Lamp]] = {"ball": Ball, "cylinder": Cylinder, "lamp": Lamp}
        return editing.place(kinds[tool](x_mm, y_mm))

    async def _begin(self, ask: Callable[[], Awaitable[Arena | None]]) -> None:
        if (arena := await ask()) is not None:
            await self._editing.begin(arena)

    def refresh(self) -> None:
        """Show whether a step can be undone or redone."""
        self._undo.set_enabled(self._editing.can_undo)
        self._redo.set_enabled(self._editing.can_redo)


def _without_walls(arena: Arena) -> Arena:
    return replace(arena, ground=np.zeros_like(arena.ground), walls=())
