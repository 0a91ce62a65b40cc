"""The seats of a room: which names are taken, by which browser, and what is known of each; kept in a file."""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from kiks.desk.room.names import NAME_MAX, STUDENTS_MAX, folder_name
from kiks.desk.server.token import Token
from kiks.errors import ParameterError
from kiks.model.atomic_files import replace_file
from kiks.model.data_file import Number, Switch, Text, Whole, check, parse_json, read_file, record

FILE = "room.json"

BYTES_MAX = 1 << 20
"""Most bytes of that file."""


@record
class SavedSeat:
    """A seat in the file.

    Args:
        number: Number of the desk, which is in its address; 0 before the student has come in.
        token: What the student's browser knows; empty if the name is free.
        place: Begin of the addresses that need it.
        points: The most points on the desk; None before a run was judged.
        is_solved: Whether the goal was reached on the desk.
        handed_in: What was handed in, a file's name; empty before.
        secret: What the pages of the desk know it by; empty before.
    """

    number: Annotated[Whole, Field(ge=0)] = 0
    token: Annotated[Text, Field(max_length=100)] = ""
    place: Annotated[Text, Field(max_length=100, pattern=r"^(/[\w-]{20,})?$")] = ""
    points: Number | None = None
    is_solved: Switch = False
    handed_in: Text = ""
    secret: Annotated[Text, Field(max_length=100)] = ""


@record
class SavedRoom:
    """The file: the code of the room, and the seats by the students' names."""

    code: Text
    seats: Annotated[dict[Annotated[str, Field(max_length=NAME_MAX)], SavedSeat], Field(max_length=10 * STUDENTS_MAX)]


@dataclass
class Seat:
    """A student's place in a room; see `SavedSeat`.

    Attributes:
        key: The token of the browser that has the name; None if the name is free.
    """

    name: str
    number: int = 0
    key: Token | None = None
    points: float | None = None
    is_solved: bool = False
    handed_in: str = ""
    secret: str = field(default_factory=secrets.token_urlsafe)

    @property
    def folder(self) -> str:
        """Name of the student's folder."""
        return folder_name(self.name)

    def note(self, points: float, *, is_solved: bool) -> bool:
        """Note how a run was judged; return whether it is the best so far."""
        best = (is_solved, points) > (self.is_solved, -float("inf") if self.points is None else self.points)
        if best:
            self.points, self.is_solved = points, is_solved
        return best


def read_seats(folder: Path, names: list[str]) -> tuple[dict[str, Seat], str]:
    """Return the seats of students, as they were when the room was last open, and its code; empty without one."""
    file = folder / FILE
    seats = {name: Seat(name) for name in names}
    if not file.exists():
        return seats, ""
    what = f"The file of the room {str(file)!r}"
    saved: Any = check(SavedRoom, parse_json(read_file(file, what, bytes_max=BYTES_MAX), what), what)
    taken: set[int] = set()
    for name, each in saved.seats.items():
        if each.number in taken:
            raise ParameterError(f"{what} must give each desk to one student, but {each.number} is twice. Remove it.")
        taken |= {each.number} - {0}
        if (seat := seats.get(name)) is not None:
            seat.number, seat.points, seat.is_solved = each.number, each.points, each.is_solved
            seat.handed_in, seat.secret = each.handed_in, each.secret or seat.secret
            if each.token and each.place and each.number:
                seat.key = Token(each.token, each.place, desk=each.number)
    return seats, saved.code


def write_seats(folder: Path, seats: dict[str, Seat], code: str) -> None:
    """Write that file, which only this user can read: it has what the browsers know."""
    saved = {
        name: {
            "number": seat.number,
            "token": "" if seat.key is None else seat.key.token,
            "place": "" if seat.key is None else seat.key.place,
            "points": seat.points,
            "is_solved": seat.is_solved,
            "handed_in": seat.handed_in,
            "secret": seat.secret,
        }
        for name, seat in seats.items()
    }
    text = json.dumps({"code": code, "seats": saved}, indent=1, ensure_ascii=False)
    replace_file(folder / FILE, text, "the room's file", rights=0o600)
