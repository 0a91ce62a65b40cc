"""The lecturer's page of a room: all desks as small live pictures, what each has solved, and the switches."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import segno
from fastapi import Response
from nicegui import app as nicegui_app
from nicegui import ui

from kiks.desk.panels.page import ACCENT, POSITIVE, PRIMARY
from kiks.desk.panels.widgets import WEB, agrees, dialog, heading, icon_button, named, show_error, with_props
from kiks.desk.room.room import Room
from kiks.desk.room.seats import Seat
from kiks.errors import counted

REFRESH_S = 1.0
"""Period at which the texts are refreshed [s]; pictures are as old at most."""

DRAW = f"""
    setInterval(() => {{
        if (document.hidden) return;
        for (const picture of document.querySelectorAll(".room-picture[data-source]")) {{
            const {{ top, bottom }} = picture.getBoundingClientRect();
            if (bottom > 0 && top < innerHeight && (picture.complete || !picture.src))
                picture.src = `${{picture.dataset.source}}?${{Date.now()}}`;
        }}
    }}, {REFRESH_S * 1000:g});
"""
"""Fetches each picture that is seen again; the old one stays until the new one is there."""


class RoomPage:
    """The page, for one browser.

    Args:
        room: The room.
    """

    def __init__(self, room: Room) -> None:
        self._room = room
        ui.on_exception(show_error)
        ui.colors(primary=PRIMARY, accent=ACCENT, positive=POSITIVE)
        ui.page_title(f"KiKS: {room.title}")
        ui.add_css(WEB / "page.css")
        ui.add_css(WEB / "room.css")
        with ui.header(elevated=True).classes("items-center q-py-none q-px-md no-wrap gap-3 room-bar"):
            heading(room.title, "text-h6 ellipsis", level=1)
            ui.space()
            self._sum = named(ui.label().classes("room-sum"), "sum")
            code = ui.button(room.code, icon="qr_code_2", on_click=self._show_code).props("flat no-caps color=white")
            with named(code, "code").classes("room-code"):
                ui.tooltip("Show address, code and QR code to the class").classes(replace="desk-tip-below")
            self._hand_in = named(ui.switch("Handing in", value=room.may_hand_in), "may-hand-in")
            self._hand_in.props("color=accent dark keep-color").on_value_change(self._switch)
        with ui.element("main").classes("room-desks"):
            self._cards = [_Card(room, seat) for seat in room.seats.values()]
        ui.run_javascript(DRAW)
        ui.timer(REFRESH_S, self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        room, seats = self._room, self._room.seats.values()
        for card in self._cards:
            card.refresh()
        here, solved, handed_in = (
            sum(1 for _ in filter(None, facts))
            for facts in zip(*((each.number, each.is_solved, each.handed_in) for each in seats), strict=True)
        )
        self._sum.set_text(f"{here} of {len(seats)} have come, {solved} solved it, {handed_in} handed in")
        self._hand_in.set_value(room.may_hand_in)

    def _switch(self) -> None:
        if self._hand_in.value != self._room.may_hand_in:
            self._room.set_submissions_open(bool(self._hand_in.value))

    def _show_code(self) -> None:
        room = self._room
        with dialog(room.title) as shown:
            picture = segno.make(room.address_with_code, error="m").svg_inline(border=4, light="#fff", omitsize=True)
            with_props(ui.html(picture, sanitize=False).classes("room-qr"), role="img", aria_label="QR code")
            named(ui.label(room.address).classes("room-address"), "address")
            ui.label(f"Code: {room.code}").classes("room-address")
            ui.button("Close", on_click=shown.close).props("flat no-caps").classes("self-end")
        shown.on("hide", shown.delete)
        shown.open()


class _Card:
    """What the page shows of one student.

    Args:
        room: The room.
        seat: The student's place.
    """

    def __init__(self, room: Room, seat: Seat) -> None:
        self._room, self._seat = room, seat
        self._card = named(with_props(ui.element("section"), aria_label=seat.name), f"seat-{seat.name}")
        with self._card.classes("room-card"):
            self._link = with_props(ui.element("a"), target="_blank", rel="opener")
            with self._link.classes("room-link"):
                self._picture = with_props(ui.element("img"), alt="").classes("room-picture")
            with ui.row().classes("w-full items-center no-wrap gap-1 q-px-sm"):
                with ui.column().classes("col gap-0").style("min-width: 0"):
                    ui.label(seat.name).classes("text-weight-medium ellipsis full-width")
                    self._state = named(ui.label().classes("text-caption room-state"), "state")
                self._solved = with_props(ui.icon("check_circle", size="sm").classes("room-solved"), title="Solved")
                tip = "Give the name free, so that another browser can take it; the desk stays as it is"
                self._free = icon_button("lock_open", f"Give free: {seat.name}", "give-free", self._give_free, tip=tip)
        self._shown: object = None

    def refresh(self) -> None:
        """Show how the desk does, if that has changed."""
        seat, opened = self._seat, self._room.desks.get(self._seat.name)
        words = []
        if opened is None:
            words.append("has not come yet")
        else:
            if seat.points is not None:
                words.append(counted(seat.points, "point"))
            if seat.handed_in:
                words.append("handed in")
            if any(each.is_running for each in opened.desk.programs.handles):
                words.append("a program runs")
            words.append("no browser" if seat.key is None else _whereabouts(opened.gateway.away_s))
        shown = (words, seat.is_solved, seat.number, opened is None, seat.key is None)
        if shown == self._shown:
            return
        self._shown = shown
        self._state.set_text(", ".join(words))
        self._solved.set_visibility(seat.is_solved)
        self._free.set_visibility(seat.key is not None)
        self._card.classes(toggle="" if (opened is None) == ("room-away" in self._card.classes) else "room-away")
        if opened is not None:
            source = f"room/picture/{seat.number}"
            with_props(self._link, href=f"desk/{seat.number}", aria_label=f"Open the desk of {seat.name}").update()
            with_props(self._picture, data_source=source).update()

    async def _give_free(self) -> None:
        name = self._seat.name
        told = "The browser that has it now is disconnected. What was written stays."
        if await agrees(f"Give the name {name} free?", told, yes="Give free"):
            await self._room.give_free(name)
            self.refresh()


def _whereabouts(away_s: float | None) -> str:
    """Return where a student is whose page has been closed for a while [s]; None: it was not open since the room is.

    Example:
        >>> [_whereabouts(away_s) for away_s in (0.0, 20.0, 730.0, None)]
        ['at the desk', 'away', 'away for 12 min', 'away']
    """
    if away_s == 0:
        return "at the desk"
    return "away" if away_s is None or away_s < 60 else f"away for {away_s // 60:.0f} min"


@contextmanager
def open_room(room: Room, *, host: str = "127.0.0.1", port: int | None = None) -> Iterator[None]:
    """Have a room open, with this page.

    Args:
        room: The room.
        host: Address to listen at.
        port: TCP port, 0 for a free one; if left out, 8123, or a free one if that is taken.
    """

    @nicegui_app.get("/room/picture/{number}")
    async def picture(number: int) -> Response:
        for name, seat in room.seats.items():
            if seat.number == number and name in room.desks:
                data = await room.picture(name)
                return Response(data, media_type="image/jpeg", headers={"cache-control": "no-store"})
        return Response(status_code=404)

    @ui.page("/room")
    def page() -> None:
        RoomPage(room)

    try:
        room.open(host=host, port=port)
        yield
    finally:
        room.close()
        for path in ("/room", "/room/picture/{number}"):
            nicegui_app.remove_route(path)
