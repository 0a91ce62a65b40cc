"""The wire panel: the traffic on a robot's serial line, the shares of time, and a console."""

from __future__ import annotations

from nicegui import ui

from kiks.desk.panels.console import ConsolePanel
from kiks.desk.panels.widgets import (
    LogBox,
    Panel,
    heading,
    icon_button,
    named,
    offer_robots,
    relabel,
    select,
    with_props,
)
from kiks.desk.server.desk import Desk
from kiks.sim.wire import Wire
from kiks.sim.wire_log import TimeShares, WireLog, WirePiece
from kiks.units import NS_PER_S, s_from_ns

REFRESH_S = 0.2
"""Refresh period [s]."""

ROWS = 200
"""Maximum number of rows in the page."""

WINDOWS: dict[int, str] = {1: "the last second", 10: "the last 10 s", 60: "the last minute"}
"""Windows of the time shares [s of simulated time]."""

PARTS = {
    "link": ("Link", "Characters were on the line, in either direction: a higher baud rate makes this smaller"),
    "robot": ("Robot", "The robot had a command and had not answered yet"),
    "thinking": ("Thinking", "The program computed between a reply and its next command"),
    "waiting": ("Waiting", "The program waited on purpose (sleep, pause, a timeout), or no program used the line"),
}
"""The parts of the bar in order: their names and meanings."""

CSS = """
    .wire-row { white-space: pre-wrap; font-family: monospace }
    .wire-sent { color: #0b57a4 }
    .wire-received { color: #8a4200 }
    .body--dark .wire-sent { color: #8fc4ff }
    .body--dark .wire-received { color: #ffb870 }
    .wire-bar { height: 1.75rem; border: 1px solid currentcolor; overflow: hidden }
    .wire-bar > div { height: 100%; overflow: hidden; text-align: center; line-height: 1.6rem; white-space: nowrap }
    .wire-link { background: #1565c0; color: #fff }
    .wire-robot { background: #ffb300; color: #000 }
    .wire-thinking { background: #7b1fa2; color: #fff }
    .wire-waiting { background: #cfd8dc; color: #000 }
    .wire-part { display: inline-block; width: 0.8em; height: 0.8em; border: 1px solid currentcolor }
"""


class WirePanel(Panel):
    """The traffic on the line of a robot."""

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk, REFRESH_S)
        self._watched: Wire | None = None
        self._log: WireLog | None = None
        self._is_held = False
        ui.add_css(CSS)
        with ui.column().classes("w-full q-pa-sm gap-2"):
            with ui.row().classes("w-full items-end no-wrap gap-2"):
                tip = "The robot whose line is shown, and that gets your commands"
                self._robot = select("Line of", "wire-robot", {1: "robot 1"}, 1, tip, self.refresh).classes("col")
                self._filter = named(ui.input("Only with", on_change=self._show_again), "wire-filter")
                self._filter.classes("col").props("dense clearable debounce=300")
                self._filter.tooltip("Show only rows that contain this text, such as N or z,")
                tip = "Hold the list to read it, or resume it; nothing is lost"
                self._hold = icon_button("pause", "Hold the list", "wire-hold", self._toggle_hold, tip=tip)
                tip = "Clear the list; this does not affect the robot or the program"
                icon_button("delete_sweep", "Clear the list", "wire-clear", lambda: self._clear(), tip=tip)
            self._rows = LogBox("16rem", "wire", "Traffic on the line", rows_max=ROWS, new_max=ROWS)
            self._build_bar()
            self._console = ConsolePanel(desk, lambda: self._robot.value or 1)
        ui.context.client.on_delete(self._let_go)

    def _build_bar(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            heading("Where the milliseconds went in", "text-subtitle2")
            self._window = select("", "wire-window", WINDOWS, 1, "How far back the bar looks, in simulated time")
            self._window.props('borderless aria-label="Window of time"')
        self._parts: dict[str, tuple[ui.element, ui.label, ui.label]] = {}
        self._bar = named(ui.row().classes("w-full no-wrap gap-0 wire-bar text-caption").props("role=img"), "wire-bar")
        legend = ui.row().classes("w-full gap-x-4 gap-y-0 text-caption")
        for name, (word, meaning) in PARTS.items():
            with self._bar, ui.element("div").classes(f"wire-{name}").style("width: 0") as bar:
                name_in_bar = ui.label()
            with legend, ui.row().classes("items-center gap-1 no-wrap"):
                ui.element("span").classes(f"wire-part wire-{name}").props("aria-hidden=true")
                self._parts[name] = bar, name_in_bar, named(ui.label(word), f"share-{name}")
                ui.tooltip(meaning)

    def set_visible(self, is_visible: bool) -> None:
        """Watch the line only while the panel is visible."""
        super().set_visible(is_visible)
        if not is_visible:
            self._let_go()

    def _let_go(self) -> None:
        """Stop watching the line, which slows the world down."""
        if self._watched is not None:
            self._watched.unwatch()
        self._watched = None

    # ---- display ----

    def refresh(self) -> None:
        """Show new traffic."""
        sim = self._desk.sim
        offer_robots(self._robot, self._desk)
        if not sim.wires:
            self._let_go()
            return
        wire = sim.wires[(self._robot.value or 1) - 1]
        if wire is not self._watched:
            self._let_go()
            self._watched = wire
            wire.watch(sim.now_ns)
        if wire.log is not self._log:
            # Another line, or the world has gone to another time.
            self._log = wire.log
            self._show_again()
        if wire.log is None:
            return
        if not self._is_held:
            self._rows.add(wire.log.pieces, self._row)
        shares = wire.shares(max(sim.now_ns - self._window.value * NS_PER_S, 0), sim.now_ns)
        if shares is not None:
            self._show_shares(shares)
        self._console.refresh()

    def _row(self, piece: WirePiece) -> tuple[str, str] | None:
        row = row_text(piece)
        is_wanted = (self._filter.value or "") in row
        return (row, f"wire-row wire-{'sent' if piece.is_sent else 'received'}") if is_wanted else None

    def _show_shares(self, shares: TimeShares) -> None:
        whole_ns = shares.window_ns
        for (name, (bar, name_in_bar, label)), part_ns in zip(self._parts.items(), shares, strict=True):
            percent = 100 * part_ns / whole_ns if whole_ns else 0.0
            word = PARTS[name][0]
            text = f"{word} {percent:.1f} % ({part_ns / 1e6:.0f} ms)"
            if label.text != text:
                label.text = text
                bar.style(f"width: {percent:.2f}%")
                name_in_bar.text = word if percent > 20 else ""
        with_props(self._bar, aria_label=", ".join(label.text for _, _, label in self._parts.values()))

    # ---- actions of a person ----

    def _show_again(self) -> None:
        """Rebuild the list from the newest rows of the log."""
        self._clear(ROWS)
        if self._watched is not None and self._watched.log is not None:
            self._rows.add(self._watched.log.pieces, self._row)

    def _toggle_hold(self) -> None:
        self._is_held = not self._is_held
        relabel(self._hold, *(("play_arrow", "Resume the list") if self._is_held else ("pause", "Hold the list")))
        if not self._is_held:
            self._show_again()

    def _clear(self, kept: int = 0) -> None:
        """Empty the list, and let it begin with so many of the newest rows."""
        log = None if self._watched is None else self._watched.log
        self._rows.clear(0 if log is None else max(log.pieces.count - kept, 0))


def row_text(piece: WirePiece) -> str:
    r"""Return a row of the list: send time of the first character [s], direction, and text.

    Example:
        >>> row_text(WirePiece(True, b"N\n", 1_234_567_890, 1_235_000_000, None))
        '   1.235 → N\\n'
    """
    text = piece.data.decode("latin-1").encode("unicode_escape").decode()
    return f"{s_from_ns(piece.first_ns):8.3f} {'→' if piece.is_sent else '←'} {text}"
