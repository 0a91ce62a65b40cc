"""The time bar below the arena: back to any time of the run, to what happened, and on from there."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path

from nicegui import ui

from kiks.desk.panels.shortcuts import SHORTCUTS, listen
from kiks.desk.panels.widgets import (
    WEB,
    FeedElement,
    Panel,
    agrees,
    answer,
    dialog,
    finish,
    icon_button,
    named,
    relabel,
    text_button,
    with_props,
)
from kiks.desk.server.desk import Desk
from kiks.desk.server.marks import TEXT_MAX
from kiks.export.event_looks import event_styles
from kiks.units import clock_text, s_from_ns

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


class TimeSlider(FeedElement, component=WEB / "time_bar.js", esm={"kiks-desk": str(WEB)}):
    """The slider of the time bar."""


class TimeBar(Panel):
    """The slider with its buttons.

    Args:
        desk: The desk.
        feed: Address of the WebSocket that frames come from, seen from the page.
    """

    def __init__(self, desk: Desk, feed: str) -> None:
        super().__init__(desk, REFRESH_S)
        looking = desk.looking
        self._acts: dict[str, Callable[[], Awaitable[None]]] = {}
        with ui.element("div").classes("desk-bar").props('role="group" aria-label="Time bar"') as self._bar:
            ui.add_css(event_styles(".body--dark {}"))
            TimeSlider(feed, "time_bar.css")
            with ui.row().classes("desk-bar-buttons items-center no-wrap gap-1"):
                self._add("first_page", "event-before", lambda: self._jump(is_before=True))
                self._add("keyboard_double_arrow_left", "back-long", lambda: looking.move_by(-LONG_S))
                self._add("keyboard_arrow_left", "back-short", lambda: looking.move_by(-SHORT_S))
                self._play = self._add("play_arrow", "play", desk.run_or_pause)
                self._onwards = [
                    self._add("keyboard_arrow_right", "on-short", lambda: looking.move_by(SHORT_S)),
                    self._add("keyboard_double_arrow_right", "on-long", lambda: looking.move_by(LONG_S)),
                    self._add("last_page", "event-after", lambda: self._jump(is_before=False)),
                ]
                self._add("bookmark_add", "bookmark", self._set_bookmark)
                self._state = named(ui.label().classes("desk-bar-state q-ml-sm"), "bar-state")
                self._event = ui.label().classes("desk-bar-event col ellipsis text-caption")
                named(self._event, "bar-event").props("aria-live=polite")
                tip = "Go back in the run with the debugger to this line, at which the program was then"
                self._line = _long_button("Line", "bug_report", "back-to-line", tip, self.acting(self._go_to_line))
                self._line.classes("desk-bar-long")
                back = self.acting(looking.back_to_now)
                tip = "Show the present world again; it goes on as if nothing had been"
                self._now = _long_button("Back to now", "update", "back-to-now", tip, back).classes("desk-bar-long")
                go_on = self.acting(self._go_on)
                tip = "Let the world go on from this moment" if desk.rights.owns_world else NOT_OWN
                self._branch = _long_button("Go on from here", "call_split", "go-on-from-here", tip, go_on)
                self._branch.classes("desk-bar-long").props("unelevated color=accent").set_enabled(
                    desk.rights.owns_world
                )
        listen(self._acts)
        ui.timer(REFRESH_S, desk.debugging.locate)
        self.refresh()

    def _add(self, icon: str, name: str, act: Callable[[], Awaitable[object]]) -> ui.button:
        async def acted() -> None:
            if self._desk.looking.span is not None:
                await act()

        shortcut = SHORTCUTS[name]
        self._acts[name] = self.acting(acted)
        tip = f"{shortcut.label} (key: {shortcut.words})"
        return icon_button(icon, shortcut.label, name, self._acts[name], tip=tip, place="above")

    def refresh(self) -> None:
        """Show which time is shown, and what happens then."""
        desk = self._desk
        past, has_present = desk.past, desk.looking.has_present
        self._bar.set_visibility(desk.looking.span is not None)
        self._bar.classes(add="is-past") if past else self._bar.classes(remove="is-past")
        self._state.text = "Now" if past is None else "Past" if has_present else "Recording"
        happening = "" if past is None else self._happening(past.sim.time_s)
        self._event.text = "; ".join(filter(None, (happening, desk.debugging.hint)))
        if line := desk.debugging.located:
            self._line.text = f"{Path(line[0]).name}, line {line[1]}"
        self._line.set_visibility(line is not None)
        relabel(self._play, *(("play_arrow", "Play") if desk.is_paused else ("pause", "Pause")))
        for button in self._onwards:
            button.set_enabled(past is not None)
        self._now.set_visibility(past is not None and has_present)
        self._branch.set_visibility(past is not None)

    async def _go_to_line(self) -> None:
        await self._desk.debugging.back(time_ns=self._desk.sim.now_ns)

    def _happening(self, time_s: float) -> str:
        """Return what happens at a time [s], in a line."""
        return "; ".join(
            mark.text.replace("\n", "; ")
            for mark in self._desk.looking.marks
            if abs(mark.time_s - time_s) < HAPPENING_S
        )

    async def _jump(self, *, is_before: bool) -> None:
        mark = await self._desk.looking.jump(is_before=is_before)
        if mark is None:
            ui.notify(f"Nothing happened {'before' if is_before else 'after'} this.")

    async def _set_bookmark(self) -> None:
        """Ask for a note, and set a bookmark at the time at which the person has asked for it."""
        time_ns = self._desk.sim.now_ns
        with dialog(f"Bookmark at {clock_text(s_from_ns(time_ns))}") as asked:
            note = named(ui.input("Note").props("autofocus").style("width: min(24rem, 72vw)"), "bookmark-note")
            with_props(note, maxlength=str(TEXT_MAX))
            note.on("keydown.enter", lambda: asked.submit(note.value))
            finish(asked, "Set it", lambda: note.value)
        if (text := await answer(asked)) is not None:
            await self._desk.looking.bookmark(time_ns, text.strip()[:TEXT_MAX] or "bookmark")

    async def _go_on(self) -> None:
        """Say what going on from here does, and do it if the person agrees."""
        desk = self._desk
        await desk.pause()
        end = clock_text(desk.present.sim.time_s)
        words = f"The run that has come to {end} ends. {GO_ON}" if desk.looking.has_present else GO_ON
        if await agrees(f"Go on from {clock_text(desk.sim.time_s)}", words, yes="Go on", no="Cancel"):
            await desk.go_on_from_here()
            ui.notify("The world is yours. Change something, then press space to let time pass.")


_long_button = partial(text_button, look='dense padding="3px 10px"', place="above")
