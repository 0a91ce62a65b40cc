"""Films of the run: a dialog that asks which part of the recording, makes the film, and downloads it."""

from __future__ import annotations

import asyncio
import tempfile
from pathlib import Path

from nicegui import ui

from kiks.desk.panels.widgets import NumberField, dialog, select
from kiks.desk.server.desk import Desk
from kiks.desk.server.turns import FILMS
from kiks.errors import ParameterError, library
from kiks.export.film import FPS, save_film
from kiks.export.kinds import KINDS
from kiks.units import s_from_ns

LAST_S = 10.0
"""How much of the run is filmed if nothing else is chosen [s]."""

LENGTH_MAX_S = 300.0
"""Longest film [s]."""


class FilmDialog:
    """The dialog."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._done = 0.0
        self._is_given_up = False
        with dialog("Make a film of the run") as self._dialog:
            with ui.row().classes("no-wrap items-end"):
                self._start = NumberField("From [s]", "film-start", min=0.0).classes("col")
                self._end = NumberField("To [s]", "film-end", min=0.0).classes("col")
                self._speed = NumberField("Times real time", "film-speed", 1.0, min=0.0).classes("col")
            self._follow = select("What is seen", "film-follow", {0: "the whole arena"}, 0).classes("w-full")
            self._kind = ui.toggle(endings := list(KINDS["film"].endings), value=endings[0])
            self._kind.props("dense no-caps data-testid=film-kind")
            bar = ui.linear_progress(show_value=False).props('aria-label="How much of the film is done"')
            bar.bind_value_from(self, "_done")
            with ui.row().classes("w-full justify-end"):
                ui.button("Close", on_click=self._dialog.close).props("flat data-testid=film-close")
                self._make_button = ui.button("Make it", icon="movie", on_click=self._make)
                self._make_button.props("data-testid=film-make")
        self._dialog.on_value_change(self._give_up)

    async def open(self) -> None:
        """Show it, with the last seconds before the shown time chosen."""
        library("av", "film")
        log = (await self._desk.looking.recording()).log
        begin_s, now_s = s_from_ns(log.begin_ns), self._desk.sim.time_s
        # At the beginning of a recording the next seconds are more than the last ones.
        start_s = max(begin_s, now_s - LAST_S)
        end_s = min(max(now_s, start_s + LAST_S), s_from_ns(log.end_ns))
        self._start.value, self._end.value = round(start_s, 3), round(end_s, 3)
        robots = {number: f"robot {name}, in the middle" for number, name in enumerate(self._desk.names(), 1)}
        self._follow.set_options({0: "the whole arena", **robots}, value=0)
        self._dialog.open()

    async def _make(self) -> None:
        start_s, end_s, speed = self._start.read(), self._end.read(), self._speed.read()
        # Differences of decimal numbers are off by rounding.
        if speed > 0 and (length_s := round((end_s - start_s) / speed, 6)) > LENGTH_MAX_S:
            raise ParameterError(
                f"A film must be at most {LENGTH_MAX_S:g} s long, but it would be {length_s:g} s. "
                "Choose less of the run, or more times real time."
            )
        recording = await self._desk.looking.recording()
        name = f"kiks-film{self._kind.value}"

        def film() -> bytes:
            with tempfile.TemporaryDirectory(prefix="kiks-film-") as folder:
                save_film(
                    recording,
                    Path(folder, name),
                    fps=FPS,
                    speed=speed,
                    start_s=start_s,
                    # What is shown is rounded.
                    end_s=min(end_s, s_from_ns(recording.log.end_ns)),
                    follow=self._follow.value or None,
                    on_progress=self._show,
                )
                return Path(folder, name).read_bytes()

        self._done, self._is_given_up = 0.0, False
        self._make_button.disable()
        try:
            done = FILMS.start(film, self._desk.share, lambda: not self._is_given_up)
            if (data := await asyncio.wrap_future(done)) is not None:
                ui.download.content(data, name)
        finally:
            self._done = 0.0
            self._make_button.enable()

    def _show(self, share: float) -> None:
        self._done = share
        if self._is_given_up:
            raise ParameterError("The dialog was closed; the film was discarded.")

    def _give_up(self) -> None:
        self._is_given_up = not self._dialog.value
