"""The page: the arena on the left, time controls above and below it, and tabs with panels on the right."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from nicegui import ui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.arena_view import ArenaView, Place, Points, ScoreBoard
from kiks.desk.panels.editor import EditorPanel
from kiks.desk.panels.exercise import ExercisePanel
from kiks.desk.panels.kept_text import KeptText, kept_of
from kiks.desk.panels.monitor import MonitorPanel
from kiks.desk.panels.octave import OctavePanel
from kiks.desk.panels.programs import ProgramsPanel
from kiks.desk.panels.remembered import remember, remembered
from kiks.desk.panels.settings import SettingsPanel
from kiks.desk.panels.shortcuts import pass_on_keys
from kiks.desk.panels.time_bar import TimeBar
from kiks.desk.panels.time_controls import TimePanel
from kiks.desk.panels.view import ViewPanel
from kiks.desk.panels.widgets import WEB, Panel, heading, icon_button, named, show_error, with_props
from kiks.desk.panels.wire import WirePanel
from kiks.desk.server.desk import Desk
from kiks.desk.server.live_editing import Editing
from kiks.ports.program_command import ProgramCommand

AnyPanel = TypeVar("AnyPanel", bound=Panel)

PRIMARY, ACCENT, POSITIVE = "#174a63", "#b85c00", "#1b7a34"
"""Background colours for white text, with contrasts of 9.4, 4.7 and 5.4 to 1. On dark pages, text in these colours is
lighter: see `web/page.css`."""

HINTS = {
    "desk": "Drag a robot to move it, its rim to turn it. Click it to see its readings.",
    "locked": "Click a robot to see its readings.",
    "recording": "Space plays the recording. Drag the bar to any time; its marks say what happened.",
}
"""The line below the arena, which a browser shows until a person closes it."""

SPLIT, SPLITS, SPLIT_STEP = 64.0, (30, 100), 2.0
"""How much of the width the arena has at first, how much it may have, and by how much a key changes it [%]."""

MEMORY = """<script>
try {
  sessionStorage.length;
} catch {
  Object.defineProperty(window, "sessionStorage", { value: {} });
}
</script>"""
"""Replacement for the session storage in which NiceGUI keeps a tab's id: in a notebook that has another host name, such
as localhost for 127.0.0.1, Chromium denies access to it, and no button would work."""

NOTE_HEADER = """
    const note = ([{ target }]) => document.body.style.setProperty("--desk-top", `${target.offsetHeight}px`);
    new ResizeObserver(note).observe(document.querySelector(".q-header"));
"""
"""Tells the style sheet how high the bar above the arena is, which wraps on phones."""

NEWS_S = 0.5
"""Period at which new messages are shown [s]."""


class Page:
    """The page of a desk, for one browser.

    Args:
        desk: The desk.
        editing: Edits its world.
        number: Its number in this process.
    """

    def __init__(self, desk: Desk, editing: Editing, number: int) -> None:
        self._desk = desk
        self._editing = editing
        self._next_news, self._logged = desk.news.count, desk.log.count
        feed = f"{number}/feed"
        ui.on_exception(show_error)
        ui.colors(primary=PRIMARY, accent=ACCENT, positive=POSITIVE)
        ui.add_head_html(MEMORY)
        ui.add_css(WEB / "page.css")
        with ui.header(elevated=True).classes("items-center q-py-none q-px-md no-wrap gap-2"):
            heading("KiKS", "text-h6 desk-from-1200", level=1)
            ui.run_javascript(NOTE_HEADER)
            TimePanel(desk, feed)
            ui.space()
            tools = ui.row().classes("items-center no-wrap gap-1")
        self._kept = KeptText().on("offer", self._take_kept) if desk.rights.is_for_others else None
        known = remembered("split")  # other servers of the computer may have set anything
        split = float(known) if known.replace(".", "", 1).isdecimal() else SPLIT
        split = min(max(split, SPLITS[0]), SPLITS[1])
        with ui.splitter(value=split, limits=SPLITS, on_change=self._note_split).classes("desk-body") as self._halves:
            with self._halves.before, ui.column().classes("desk-stage"):
                board = ScoreBoard(feed, "board.css")
                with ui.element("div").classes("desk-arena"):
                    self._view = ArenaView(
                        feed, on_pick=self._pick, on_edit=self._edit, on_draw=self._draw, on_remove=self._remove
                    )
                self._build_hint("locked" if desk.is_locked else "desk" if desk.past is None else "recording")
                TimeBar(desk, feed)
            with self._halves.after, ui.column().classes("w-full gap-0 no-wrap"):
                self._build_tabs(feed)
            with self._halves.separator:
                self._build_edge()
        with tools:
            ViewPanel(desk, self._view, board)
        pass_on_keys()
        ui.timer(NEWS_S, self._show_news)

    def _build_hint(self, name: str) -> None:
        """Build the line below the arena, unless it was closed in this browser."""

        def close() -> None:
            self._hint_row.set_visibility(False)
            remember(f"hint-{name}", "closed")

        with ui.row().classes("desk-hint items-center no-wrap w-full") as self._hint_row:
            self._hint = ui.label(HINTS[name]).classes("col")
            icon_button("close", "Close the hint", "close-hint", close, look="flat round dense size=sm")
        self._hint_row.set_visibility(not remembered(f"hint-{name}"))

    def _build_edge(self) -> None:
        """Build the edge between arena and panels, which keys move, too."""
        words = "Width of the arena: the left and right arrow keys change it"
        edge = ui.element("div").classes("desk-edge").props("role=separator tabindex=0 aria-orientation=vertical")
        self._edge = named(with_props(edge, aria_label=words, aria_valuemin="30", aria_valuemax="100"), "edge")
        for key, sign in (("left", -1), ("right", 1)):
            self._edge.on(f"keydown.{key}.prevent", partial(self._move_edge, sign * SPLIT_STEP))
        self._note_split()

    def _move_edge(self, by: float) -> None:
        self._halves.value = min(max(self._halves.value + by, SPLITS[0]), SPLITS[1])

    def _note_split(self) -> None:
        """Let the browser remember the width, and tell the style sheet, for the tooltips beside the arena."""
        split = round(self._halves.value, 1)
        with_props(self._edge, aria_valuenow=f"{split:.0f}")
        remember("split", split)
        ui.query("body").style(f"--desk-split: {split}")

    def _build_tabs(self, feed: str) -> None:
        """Build the tabs beside the arena; the panel of each is built when it is first opened."""
        desk = self._desk
        tabs: list[tuple[str, str, Callable[[], Panel]]] = [
            ("exercise", "Exercise", lambda: ExercisePanel(desk, self._program, self._template)),
            ("robot", "Robot", lambda: MonitorPanel(desk, feed)),
            ("wire", "Wire", lambda: WirePanel(desk)),
            ("arena", "Arena", lambda: EditorPanel(desk, self._editing, self._view, self._template)),
            ("programs", "Programs", lambda: ProgramsPanel(desk, self._kept)),
            ("settings", "Settings", lambda: SettingsPanel(desk)),
        ]
        if desk.outside.interpreters():
            tabs.insert(-1, ("octave", "Octave", lambda: OctavePanel(desk)))
        self._builders = {name: build for name, _, build in tabs}
        self._panels: dict[str, Panel] = {}
        look = "dense no-caps align=justify active-color=accent"
        with ui.tabs().props(look).classes("w-full desk-tabs") as heads:
            heads_of = {name: named(ui.tab(name, word), f"tab-{name}") for name, word, _ in tabs}
        self._exercise, self._exercise_tab = desk.project.exercise, heads_of["exercise"]
        with ui.tab_panels(heads, animated=False).classes("desk-panels w-full") as self._tabs:
            self._places = {name: ui.tab_panel(name) for name in self._builders}
        self._tabs.on_value_change(lambda event: self._open(event.value))
        self._show_exercise()

    def _show_exercise(self) -> None:
        """Show the tab of the exercise, if the project is one; else that of the robot."""
        is_exercise = self._exercise is not None
        self._exercise_tab.set_visibility(is_exercise)
        if is_exercise or self._tabs.value in (None, "exercise"):
            self._tabs.value = "exercise" if is_exercise else "robot"

    def _panel(self, name: str, kind: type[AnyPanel]) -> AnyPanel:
        """Return a panel of a kind, which is built when it is first needed."""
        if name not in self._panels:
            with self._places[name]:
                self._panels[name] = self._builders[name]()
        panel = self._panels[name]
        assert isinstance(panel, kind)
        return panel

    async def _program(self) -> ProgramCommand | None:
        """Save the program in the editor, and return it."""
        return await self._panel("programs", ProgramsPanel).command()

    def _template(self) -> str:
        """Return the program in the editor; nothing without an editor."""
        editor = self._panel("programs", ProgramsPanel).editor
        return "" if editor is None else editor.text

    def _open(self, name: str) -> None:
        """Show a panel, and let the others rest."""
        self._panel(name, Panel)
        for each, panel in self._panels.items():
            panel.set_visible(each == name)

    async def _pick(self, what: str, index: int, sensor: int, place: Place) -> None:
        """Show the robot or sensor that was clicked; where walls are drawn, the properties of anything else."""
        panel = self._panels.get(self._tabs.value)
        if self._desk.past is None and what not in ("robot", "sensor") and isinstance(panel, EditorPanel):
            await panel.properties.show(await self._editing.select(what, index, *place))
        if what in ("robot", "sensor"):
            self._tabs.value = "robot"
            monitor = self._panel("robot", MonitorPanel)
            monitor.show_robot(index + 1)
            if what == "sensor":
                await monitor.explain(sensor)

    async def _edit(self, what: str, index: int, place: Place) -> None:
        """Show the properties of a thing or a wall; a double click on the floor shows all of the arena."""
        if self._desk.past is not None or (selected := await self._editing.select(what, index, *place)) is None:
            self._view.run_method("fit")
            return
        self._tabs.value = "arena"
        await self._panel("arena", EditorPanel).properties.show(selected, has_focus=True)

    async def _take_kept(self, event: GenericEventArguments) -> None:
        """Take a program that was typed while the connection was away, and show it."""
        editor = self._panel("programs", ProgramsPanel).editor
        if (kept := kept_of(event.args)) is not None and editor is not None:
            with self._places["programs"]:
                is_new = await editor.take(kept)
            if is_new:
                self._tabs.value = "programs"

    async def _draw(self, kind: str, points: Points) -> None:
        """Pass a stroke to the editor."""
        if isinstance(editor := self._panels.get("arena"), EditorPanel):
            await editor.draw(kind, points)

    async def _remove(self, x_mm: float, y_mm: float) -> None:
        """Remove the selected thing."""
        await self._editing.remove(x_mm, y_mm)

    def _show_news(self) -> None:
        """Show what has happened: messages, and another exercise, which may have been opened on another page."""
        if (exercise := self._desk.project.exercise) != self._exercise:
            self._exercise = exercise
            self._show_exercise()
        first, news = self._desk.news.since(self._next_news)
        self._next_news = first + len(news)
        for text in news:
            ui.notify(text, multi_line=True, close_button="OK", timeout=8000)
        _, lines = self._desk.log.since(max(self._logged, self._desk.log.count - 1))
        if lines and self._desk.outside.interpreters():
            # The last line of the log stands there, as in the window of KiKS 2.2.0.
            self._hint.set_text(lines[-1])
            self._hint_row.set_visibility(True)
