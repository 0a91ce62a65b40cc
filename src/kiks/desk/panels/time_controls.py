"""The time controls: run, pause, step, speed, clock, checkpoint and reset."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import ui

from kiks.desk.panels.shortcuts import SHORTCUTS, listen
from kiks.desk.panels.widgets import WEB, FeedElement, Panel, bar_button, named, place_tip, relabel, select, with_props
from kiks.desk.server.desk import Desk


class ClockView(FeedElement, component=WEB / "clock_view.js", esm={"kiks-desk": str(WEB)}):
    """The simulated clock and its speed."""


SPEEDS = {speed: f"{speed:g} x" for speed in (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 50.0)}
SPEEDS |= {1.0: "real time", 0.0: "full speed"}
"""Speeds [simulated seconds per real second]; 0 stands for no limit."""

STEPS: dict[float, str] = {0.01: "10 ms", 0.1: "100 ms", 1.0: "1 s", 10.0: "10 s"}
"""Sizes of a step [s]."""


class TimePanel(Panel):
    """The row of controls above the arena.

    Args:
        desk: The desk.
        feed: Address of the WebSocket that frames come from, seen from the page.
    """

    def __init__(self, desk: Desk, feed: str) -> None:
        super().__init__(desk)
        acts = {
            "run": self.acting(desk.run_or_pause),
            "step": self.acting(lambda: desk.step(self._step_s.value)),
            "step-back": self.acting(lambda: desk.looking.move_by(-self._step_s.value)),
        }
        self._run = named(ui.button(on_click=acts["run"]).props("round unelevated color=accent"), "run")
        place_tip(self._run, f"Run or pause (key: {SHORTCUTS['run'].words})", "below")
        step_tip = f"Run for one step, then pause (key: {SHORTCUTS['step'].key}; back: {SHORTCUTS['step-back'].key})"
        bar_button("skip_next", "Step", "step", acts["step"], tip=step_tip)
        tip, done = "Halt: stop all programs and all robots", "All programs and all robots are stopped."
        self._add("dangerous", "halt", tip, desk.halt, done)
        self._step_s = _select(STEPS, 0.01, "Size of a step", "step-size", "5rem").classes("desk-spare")
        most = desk.rights.speed_max
        self._speeds = {speed: word for speed, word in SPEEDS.items() if (speed or float("inf")) <= most}
        self._speed = _select(self._speeds, self._shown_speed(), "Speed of time", "speed", "8.5rem")
        self._speed.on_value_change(self._set_speed)
        place_tip(self._speed, "Simulated time per real time; it never changes what robots do", "below")
        ClockView(feed, "clock_view.css")
        tip, done = "Checkpoint: remember where everything stands", "Checkpoint taken."
        self._add("flag", "mark", tip, lambda: desk.change(desk.mark), done)
        tip = "Reset: move everything back to where it stood at the checkpoint, or at the start; time continues"
        done = "Everything is back where it stood."
        self._add("settings_backup_restore", "reset", tip, lambda: desk.change(desk.reset), done)
        listen(acts, is_for_buttons=False)
        self.refresh()

    def _add(self, icon: str, name: str, tip: str, act: Callable[[], Awaitable[object]], done: str) -> None:
        bar_button(icon, tip.partition(":")[0], name, self.acting(act, done), tip=tip)

    def _shown_speed(self) -> float:
        speed = self._desk.gate.speed
        return 0.0 if speed is None else min(filter(None, self._speeds), key=lambda each: abs(each - speed))

    def refresh(self) -> None:
        """Show whether time runs, and at which speed."""
        relabel(self._run, *(("play_arrow", "Run") if self._desk.is_paused else ("pause", "Pause")))
        self._speed.value = self._shown_speed()

    async def _set_speed(self) -> None:
        if self._speed.value != self._shown_speed():
            await self._desk.set_speed(self._speed.value or None)


def _select(choices: dict[float, str], value: float, word: str, name: str, width: str) -> ui.select:
    choice = select("", name, choices, value).props("dark borderless").style(f"min-width: {width}")
    return with_props(choice, aria_label=word)
