"""The time controls: run, pause, step, speed, clock, checkpoint and reset."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from kiks.desk.panels.shortcuts import SHORTCUTS, listen
from kiks.desk.panels.widgets import BAR, FeedElement, icon_button, told, with_props
from kiks.desk.server.desk import Desk

_WEB = Path(__file__).parents[1] / "web"


class ClockView(FeedElement, component=_WEB / "clock_view.js", esm={"kiks-desk": str(_WEB)}):
    """The simulated clock and its speed."""


SPEEDS: dict[float, str] = {
    0.1: "0.1 x",
    0.25: "0.25 x",
    0.5: "0.5 x",
    1.0: "real time",
    2.0: "2 x",
    5.0: "5 x",
    10.0: "10 x",
    50.0: "50 x",
    0.0: "full speed",
}
"""Speeds [simulated seconds per real second]; 0 stands for no limit."""

STEPS: dict[float, str] = {0.01: "10 ms", 0.1: "100 ms", 1.0: "1 s", 10.0: "10 s"}
"""Sizes of a step [s]."""

LEAVE = """(event) => {
    if (![" ", "."].includes(event.key) || event.target.ariaExpanded === "true") return;
    event.qKeyEvent = true;
    event.preventDefault();
    event.target.blur();
}"""
"""Makes a closed list pass the keys space and . on to the page: after choosing a speed, space pauses and does not open
the list again. Quasar skips events with this mark, and the page handles keys while no list has the focus."""

REFRESH_S = 0.5
"""Period at which changes by other browsers are shown [s]."""


class TimePanel:
    """The row of controls above the arena.

    Args:
        desk: The desk.
        feed: Address of the WebSocket that frames come from, seen from the page.
    """

    def __init__(self, desk: Desk, feed: str) -> None:
        self._desk = desk
        self._run = ui.button(on_click=self._toggle).props("round unelevated color=accent data-testid=run")
        with self._run:
            self._run_tip = ui.tooltip("")
        icon_button("skip_next", "Step", "step", self._step, look=BAR).tooltip(
            f"Run for one step, then pause (key: {SHORTCUTS['step'].key}; back: {SHORTCUTS['step-back'].key})"
        )
        icon_button("dangerous", "Halt", "halt", self._halt, look=BAR).tooltip("Halt: stop all programs and all robots")
        self._step_s = _select(STEPS, 0.01, "Size of a step", "step-size", "5rem")
        self._speed = _select(SPEEDS, self._shown_speed(), "Speed of time", "speed", "8.5rem")
        self._speed.on_value_change(self._set_speed)
        self._speed.tooltip("Simulated time per real time; it never changes what robots do")
        ClockView(feed, _WEB / "clock_view.css")
        icon_button("bookmark_add", "Checkpoint", "mark", self._mark, look=BAR).tooltip(
            "Checkpoint: remember where everything stands"
        )
        icon_button("settings_backup_restore", "Reset", "reset", self._reset, look=BAR).tooltip(
            "Reset: move everything back to where it stood at the checkpoint, or at the start; time continues"
        )
        ui.timer(REFRESH_S, self._refresh)
        listen({"run": self._toggle, "step": self._step, "step-back": self._step_back}, is_for_buttons=False)
        self._refresh()

    def _shown_speed(self) -> float:
        speed = self._desk.gate.speed
        return 0.0 if speed is None else min((each for each in SPEEDS if each), key=lambda each: abs(each - speed))

    def _refresh(self) -> None:
        """Show the present state, which another browser may have changed."""
        desk = self._desk
        word, icon = ("Run", "play_arrow") if desk.is_paused else ("Pause", "pause")
        if self._run.props.get("aria-label") != word:
            with_props(self._run, icon=icon, aria_label=word)
            self._run_tip.text = f"{word} (key: {SHORTCUTS['run'].words})"
        if self._speed.value != self._shown_speed():
            self._speed.value = self._shown_speed()

    @told
    async def _toggle(self) -> None:
        await (self._desk.go_on() if self._desk.is_paused else self._desk.pause())
        self._refresh()

    @told
    async def _halt(self) -> None:
        await self._desk.halt()
        ui.notify("All programs and all robots are stopped.")

    @told
    async def _step(self) -> None:
        await self._desk.step(self._step_s.value)
        self._refresh()

    @told
    async def _step_back(self) -> None:
        await self._desk.looking.move_by(-self._step_s.value)
        self._refresh()

    @told
    async def _set_speed(self) -> None:
        if self._speed.value != self._shown_speed():
            await self._desk.set_speed(self._speed.value or None)

    @told
    async def _mark(self) -> None:
        await self._desk.mark()
        ui.notify("Checkpoint taken.")

    @told
    async def _reset(self) -> None:
        await self._desk.reset()
        ui.notify("Everything is back where it stood.")


def _select(choices: dict[float, str], value: float, word: str, name: str, width: str) -> ui.select:
    choice = ui.select(choices, value=value).props("dense dark borderless options-dense").style(f"min-width: {width}")
    return with_props(choice, aria_label=word, data_testid=name).on("keydown", js_handler=LEAVE)
