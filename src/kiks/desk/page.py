"""The page: the arena on the left, time above it, and beside it what there is to be looked at and done."""

from __future__ import annotations

from nicegui import ui

from kiks.desk.arena_view import ArenaView, Pick
from kiks.desk.desk import Desk
from kiks.desk.time_panel import TimePanel
from kiks.desk.view_panel import ViewPanel

STYLE = """
.nicegui-content { padding: 0; gap: 0 }
.desk-body { width: 100%; height: calc(100dvh - 58px) }
.desk-tabs { min-height: 40px }
.desk-panel { height: calc(100dvh - 58px - 41px); overflow: auto }
*:focus-visible { outline: 3px solid var(--q-accent); outline-offset: 1px }
"""

PRIMARY, ACCENT = "#174a63", "#d9730d"
"""Colours that can be read with white on them, by all and on a wall: contrast 9 and 3.4 to 1."""

NEWS_S = 0.5
"""How often people are told what is new [s]."""


class Page:
    """The page of a desk, for one browser.

    Args:
        desk: The desk.
        number: Its number in this process.
    """

    def __init__(self, desk: Desk, number: int) -> None:
        self._desk = desk
        self._told = desk.news.count
        ui.colors(primary=PRIMARY, accent=ACCENT)
        ui.add_css(STYLE)
        with ui.header(elevated=True).classes("items-center q-py-none q-px-md no-wrap gap-2").style("height: 58px"):
            ui.label("KiKS").classes("text-h6 gt-sm")
            TimePanel(desk)
            ui.space()
            tools = ui.row().classes("items-center no-wrap gap-1")
        with ui.splitter(value=66, limits=(30, 100)).classes("desk-body") as halves:
            with halves.before:
                view = ArenaView(f"/desk/{number}/feed", on_pick=self._pick)
            with halves.after:
                self._build_panels(view)
        with tools:
            ViewPanel(desk, view)
        ui.timer(NEWS_S, self._tell_news)

    def _build_panels(self, view: ArenaView) -> None:
        """Build the tabs beside the arena."""

    def _pick(self, pick: Pick) -> None:
        """Show what was clicked at."""

    def _tell_news(self) -> None:
        first, news = self._desk.news.since(self._told)
        self._told = first + len(news)
        for text in news:
            ui.notify(text, multi_line=True, close_button="OK", timeout=8000)
