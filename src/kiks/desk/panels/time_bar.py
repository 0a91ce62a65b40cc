"""The time bar below the arena: back to any time of the run, to what happened, and on from there."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path

from nicegui import ui

from kiks.desk.panels.shortcuts import SHORTCUTS, listen
from kiks.desk.panels.widgets import FeedElement, icon_button, named, told, with_props
from kiks.desk.server.desk import Desk
from kiks.units import clock_text

_WEB = Path(__file__).parents[1] / "web"

SHORT_S, LONG_S = 0.1, 1.0
"""Steps of the buttons [s]."""

REFRESH_S = 0.25
"""Period at which changes by other browsers are shown [s]."""

HAPPENING_S = 0.02
"""Longest time between an event and the time at which it is told of [s]."""

NOT_OWN = "Another program owns this world, so it cannot be replaced here"

GO_ON = (
    "Time is paused first, so that you can change something: drag a robot, draw a wall, start a program. The programs "
    "that drove the robots have hung up, and each robot carries on with its last command."
)


class TimeSlider(FeedElement, component=_WEB / "time_bar.js", esm={"kiks-desk": str(_WEB)}):
    """The slider of the time bar."""


class TimeBar:
    """The slider with its buttons.

    Args:
        desk: The desk.
        feed: Address of the WebSocket that frames come from, seen from the page.
    """

    def __init__(self, desk: Desk, feed: str) -> None:
        self._desk = desk
        looking = desk.looking
        self._acts: dict[str, Callable[[], Awaitable[None]]] = {}
        with ui.element("div").classes("desk-bar").props('role="group" aria-label="Time bar"') as self._bar:
            TimeSlider(feed, _WEB / "time_bar.css")
            with ui.row().classes("desk-bar-buttons items-center no-wrap gap-1"):
                self._add("first_page", "event-before", lambda: self._jump(is_before=True))
                self._add("keyboard_double_arrow_left", "back-long", lambda: looking.move_by(-LONG_S))
                self._add("keyboard_arrow_left", "back-short", lambda: looking.move_by(-SHORT_S))
                self._play = self._add("play_arrow", "play", self._toggle)
                self._onwards = [
                    self._add("keyboard_arrow_right", "on-short", lambda: looking.move_by(SHORT_S)),
                    self._add("keyboard_double_arrow_right", "on-long", lambda: looking.move_by(LONG_S)),
                    self._add("last_page", "event-after", lambda: self._jump(is_before=False)),
                ]
                self._state = ui.label().classes("desk-bar-state q-ml-sm").props("data-testid=bar-state")
                self._event = ui.label().classes("desk-bar-event col ellipsis text-caption")
                named(self._event, "bar-event").props("aria-live=polite")
                self._now = _long_button("Back to now", "update", "back-to-now", self._back_to_now)
                self._now.tooltip("Show the present world again; it goes on as if nothing had been")
                self._branch = _long_button("Go on from here", "call_split", "go-on-from-here", self._ask)
                self._branch.props("unelevated color=accent")
                with self._branch:
                    self._branch_tip = ui.tooltip("")
        with ui.dialog() as self._dialog, ui.card().classes("gap-3").style("max-width: 620px"):
            self._build_dialog()
        listen(self._acts, is_for_buttons=True)
        ui.timer(REFRESH_S, self.refresh)
        self.refresh()

    def _add(self, icon: str, name: str, act: Callable[[], Awaitable[object]]) -> ui.button:
        async def acted() -> None:
            if self._desk.looking.span is not None:
                await act()
                self.refresh()

        shortcut = SHORTCUTS[name]
        self._acts[name] = shown = told(acted)
        return icon_button(icon, shortcut.label, name, shown).tooltip(f"{shortcut.label} (key: {shortcut.words})")

    def refresh(self) -> None:
        """Show the present state, which another browser may have changed."""
        desk = self._desk
        past, has_present = desk.past, desk.looking.has_present
        self._bar.set_visibility(desk.looking.span is not None)
        self._bar.classes(add="is-past") if past else self._bar.classes(remove="is-past")
        self._state.text = "Now" if past is None else "Past" if has_present else "Recording"
        self._event.text = "" if past is None else self._happening(past.sim.time_s)
        word = "Play" if desk.is_paused else "Pause"
        if self._play.props.get("aria-label") != word:
            with_props(self._play, icon="play_arrow" if desk.is_paused else "pause", aria_label=word)
        for button in self._onwards:
            button.set_enabled(past is not None)
        self._now.set_visibility(past is not None and has_present)
        self._branch.set_visibility(past is not None)
        self._branch.set_enabled(desk.owns_world)
        self._branch_tip.text = "Let the world live on from this moment" if desk.owns_world else NOT_OWN

    def _happening(self, time_s: float) -> str:
        """Return what happens at a time [s], in a line."""
        return "; ".join(
            mark.text.replace("\n", "; ")
            for mark in self._desk.looking.marks
            if abs(mark.time_s - time_s) < HAPPENING_S
        )

    # ---- in the past ----

    async def _toggle(self) -> None:
        await (self._desk.go_on() if self._desk.is_paused else self._desk.pause())

    async def _jump(self, *, is_before: bool) -> None:
        mark = await self._desk.looking.jump(is_before=is_before)
        if mark is None:
            ui.notify(f"Nothing happened {'before' if is_before else 'after'} this.")

    @told
    async def _back_to_now(self) -> None:
        await self._desk.looking.back_to_now()
        self.refresh()

    # ---- on from here ----

    def _build_dialog(self) -> None:
        self._title = ui.label().classes("text-h6").props('role="heading" aria-level="2"')
        self._words = ui.label().classes("text-body2").props("data-testid=branch-words")
        with ui.row().classes("w-full justify-end"):
            ui.button("Cancel", on_click=self._dialog.close).props("flat no-caps data-testid=branch-cancel")
            go = ui.button("Go on", icon="call_split", on_click=self._go_on).mark("branch-by-hand")
            go.props("no-caps unelevated color=primary data-testid=branch-by-hand")

    @told
    async def _ask(self) -> None:
        """Say what going on does, and ask whether to."""
        desk = self._desk
        await desk.pause()
        self._title.text = f"Go on from {clock_text(desk.sim.time_s)}"
        end = clock_text(desk.present.sim.time_s)
        self._words.text = f"The run that has come to {end} ends. {GO_ON}" if desk.looking.has_present else GO_ON
        self._dialog.open()

    @told
    async def _go_on(self) -> None:
        self._dialog.close()
        await self._desk.go_on_from_here()
        self.refresh()
        ui.notify("The world is yours. Change something, then press space to let time pass.")


def _long_button(text: str, icon: str, name: str, act: Callable[[], Awaitable[None]]) -> ui.button:
    """Build a button whose text goes where there is no room for it."""
    button = ui.button(text, icon=icon, on_click=act).props('dense no-caps padding="3px 10px"')
    return named(with_props(button, aria_label=text), name).classes("desk-bar-long")
