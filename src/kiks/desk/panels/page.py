"""The page: the arena on the left, time controls above and below it, and tabs with panels on the right."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from kiks.desk.panels.arena_view import ArenaView, Pick, Stroke
from kiks.desk.panels.editor import EditorPanel
from kiks.desk.panels.monitor import MonitorPanel
from kiks.desk.panels.octave import OctavePanel
from kiks.desk.panels.programs import ProgramsPanel
from kiks.desk.panels.settings import SettingsPanel
from kiks.desk.panels.time_bar import TimeBar
from kiks.desk.panels.time_controls import TimePanel
from kiks.desk.panels.view import ViewPanel
from kiks.desk.panels.widgets import told, with_props
from kiks.desk.panels.wire import WirePanel
from kiks.desk.server.desk import Desk
from kiks.desk.server.live_editing import Editing

STYLE = Path(__file__).parents[1] / "web" / "page.css"

PRIMARY, ACCENT, POSITIVE = "#174a63", "#b85c00", "#1b7a34"
"""Background colours for white text, with contrasts of 9.4, 4.7 and 5.4 to 1. On dark pages, text in these colours is
lighter: see `STYLE`."""

HINT = "Drag a robot to move it, its rim to turn it. Click it to see its readings."

PAST_HINT = "Space plays the recording. Drag the bar to any time; its marks say what happened."

MEMORY = """<script>
try {
  sessionStorage.length;
} catch {
  Object.defineProperty(window, "sessionStorage", { value: {} });
}
</script>"""
"""Replacement for the session storage in which NiceGUI keeps a tab's id: in a notebook that has another host name, such
as localhost for 127.0.0.1, Chromium denies access to it, and no button would work."""

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
        self._told, self._logged = desk.news.count, desk.log.count
        feed = f"{number}/feed"
        ui.colors(primary=PRIMARY, accent=ACCENT, positive=POSITIVE)
        ui.add_head_html(MEMORY)
        ui.add_css(STYLE)
        with ui.header(elevated=True).classes("items-center q-py-none q-px-md no-wrap gap-2").style("height: 58px"):
            ui.label("KiKS").classes("text-h6 gt-sm")
            TimePanel(desk, feed)
            ui.space()
            tools = ui.row().classes("items-center no-wrap gap-1")
        with ui.splitter(value=64, limits=(30, 100)).classes("desk-body") as halves:
            with halves.before, ui.column().classes("desk-stage"):
                with ui.element("div").classes("desk-arena"):
                    self._view = ArenaView(feed, on_pick=self._pick, on_draw=self._draw, on_remove=self._remove)
                    self._hint = ui.label(HINT if desk.past is None else PAST_HINT).classes("desk-hint")
                TimeBar(desk, feed)
            with halves.after, ui.column().classes("w-full gap-0 no-wrap"):
                self._build_tabs(feed)
        with tools:
            ViewPanel(desk, self._view)
        ui.timer(NEWS_S, self._tell_news)

    def _build_tabs(self, feed: str) -> None:
        """Build the tabs beside the arena; the content of each is built when it is first opened."""
        desk = self._desk
        self._unbuilt: dict[str, Callable[[], object]] = {}
        self._monitor: MonitorPanel | None = None
        self._editor: EditorPanel | None = None
        self._sleepers: dict[str, WirePanel | ProgramsPanel] = {}
        tabs: list[tuple[str, str, Callable[[], object]]] = [
            ("robot", "Robot", lambda: self._build_monitor(feed)),
            ("wire", "Wire", lambda: self._build_sleeper("wire", WirePanel)),
            ("arena", "Arena", self._build_editor),
            ("programs", "Programs", lambda: self._build_sleeper("programs", ProgramsPanel)),
            ("settings", "Settings", lambda: SettingsPanel(desk)),
        ]
        if desk.outside.interpreters():
            tabs.insert(-1, ("octave", "Octave", lambda: OctavePanel(desk)))
        with (
            ui.tabs().props("dense no-caps align=justify active-color=accent").classes("w-full desk-tabs") as self._tabs
        ):
            for name, word, _ in tabs:
                with_props(ui.tab(name, word), data_testid=f"tab-{name}")
        self._panels = ui.tab_panels(self._tabs, animated=False).classes("desk-panels w-full")
        self._places: dict[str, ui.tab_panel] = {}
        with self._panels:
            for name, _, build in tabs:
                self._places[name] = ui.tab_panel(name)
                self._unbuilt[name] = build
        self._panels.on_value_change(lambda event: self._build(event.value))
        self._panels.value = "robot"

    def _build(self, name: str) -> None:
        if self._editor is not None and name != "arena":
            self._editor.put_down()
        build = self._unbuilt.pop(name, None)
        if build is not None:
            with self._places[name]:
                build()
        for own, sleeper in self._sleepers.items():
            sleeper.set_visible(own == name)

    def _build_sleeper(self, name: str, kind: type[WirePanel | ProgramsPanel]) -> None:
        """Build a panel that is inactive while it is hidden."""
        self._sleepers[name] = kind(self._desk)

    def _build_monitor(self, feed: str) -> None:
        self._monitor = MonitorPanel(self._desk, feed)

    def _build_editor(self) -> None:
        self._editor = EditorPanel(self._desk, self._editing, self._view)

    async def _pick(self, pick: Pick) -> None:
        """Show the robot or sensor that was clicked."""
        if pick.what in ("robot", "sensor"):
            self._panels.value = "robot"
            if self._monitor is not None and pick.what == "robot":
                self._monitor.show_robot(pick.index)
            elif self._monitor is not None:
                await self._monitor.show_sensor(pick.index, pick.sensor)

    async def _draw(self, stroke: Stroke) -> None:
        """Pass a stroke to the editor."""
        if self._editor is not None:
            await self._editor.draw(stroke)

    @told
    async def _remove(self, x_mm: float, y_mm: float) -> None:
        """Remove the selected thing."""
        await self._editing.remove(x_mm, y_mm)

    def _tell_news(self) -> None:
        first, news = self._desk.news.since(self._told)
        self._told = first + len(news)
        for text in news:
            ui.notify(text, multi_line=True, close_button="OK", timeout=8000)
        _, lines = self._desk.log.since(max(self._logged, self._desk.log.count - 1))
        if lines and self._desk.outside.interpreters():
            # The last line of the log stands there, as in the window of KiKS 2.2.0.
            self._hint.set_text(lines[-1])
