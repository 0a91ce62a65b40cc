"""The students of a class: read from a file that people or platforms write, and found again in what was handed in."""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, printable
from kiks.model.data_file import read_file
from kiks.trials.submissions import Student, Submission, word_for

BYTES_MAX = 1 << 20
"""Most bytes of a file with students."""

NOTHING = "nothing was handed in"
"""Why a student who is on the list alone has no grade."""

_COLUMNS = {
    "name": "name|full name|student|student name|vollständiger name|nom complet|namn|fullständigt namn|nombre completo",
    "first": "first name|given name|vorname|prénom|nombre|förnamn",
    "last": "last name|surname|family name|nachname|nom|apellido|apellidos|efternamn",
    "email": "email|e-mail|email address|e-mail-adresse|mail|e-post|e-postadress",
    "participant": "identifier|id|identifierare",
    "time": "last modified (submission)",
    "last_graded": "last modified (grade)|zuletzt geändert (bewertung)",
}
"""What the columns are called that are read, by Moodle, Gradescope and people."""

_MOODLE_TIME = "%A, %d %B %Y, %I:%M %p"


def read_students(path: Path) -> list[Student]:
    """Read a file with a name on each line, or a CSV whose first line names its columns; empty lines do not count.

    Columns are separated by commas, semicolons or tabs. Moodle's grading worksheet and its list of participants are
    read, and those of spreadsheets.

    Raises:
        ParameterError: If it is no text, or its columns have no names.
    """
    what = f"The file with the students' names {str(path)!r}"
    data = read_file(path, what, bytes_max=BYTES_MAX)
    try:
        text = data.decode("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError:
        raise ParameterError(f"{what} must be text in UTF-8, but it is not. Save it as such.") from None
    table = re.sub(r"\A(?:\s|sep=.\r?$)+", "", text, flags=re.MULTILINE)  # a spreadsheet may say how it separates
    first = next(iter(table.splitlines()), "")
    for mark in ";\t,":
        known = {_column(cell) for cell in first.split(mark)}
        if "name" in known or {"first", "last"} <= known:
            try:
                return _table_students(csv.reader(io.StringIO(table, newline=""), delimiter=mark, strict=True))
            except csv.Error as error:
                raise ParameterError(f"{what} must be a CSV, but it is not ({error}). Save it as such.") from None
    if re.search(r"[;\t@]", text):
        raise ParameterError(
            f"{what} must begin with the names of its columns if it has several, but there is no name, or no first "
            "name and last name, in its first line. Write name;email, for instance."
        )
    lines = ((number, _plain(line.strip('"'))) for number, line in enumerate(text.splitlines(), 1))
    return [Student(line, line=number) for number, line in lines if line]


def _table_students(rows: csv._reader) -> list[Student]:  # type: ignore[name-defined, unused-ignore]
    columns = [_column(cell) for cell in next(rows)]
    found = []
    for row in rows:
        cells = {column: cell for column, cell in zip(columns, map(_plain, row), strict=False) if column}
        name = cells.get("name") or _plain(f"{cells.get('first', '')} {cells.get('last', '')}")
        if not name:
            continue
        time_s = None
        with suppress(ValueError):
            time_s = datetime.strptime(cells.get("time", ""), _MOODLE_TIME).timestamp()
        # "Participant 1201", in any language; a number alone is one of another list.
        participant = "".join(re.findall(r"(?<=\D)\d+$", cells.get("participant", "")))
        last_graded = cells.get("last_graded", "")
        found.append(Student(name, participant, cells.get("email", ""), time_s, last_graded, rows.line_num))
    return found


def _column(cell: str) -> str:
    """Return which of the columns that are read this one is; empty for all others."""
    plain = _plain(cell.strip().strip('"')).casefold()
    return next((column for column, names in _COLUMNS.items() if plain in names.split("|")), "")


def _plain(text: str) -> str:
    return " ".join(unicodedata.normalize("NFC", text).split())


def identities(who: Student) -> list[str]:
    """Return what tells whose something is, the surest first: number in Moodle, address, words of the name.

    Example:
        >>> identities(Student("Lovelace, Ada")) == identities(Student("ada_lovelace"))
        True
    """
    words = sorted(re.findall(r"[^\W_]+", unicodedata.normalize("NFC", who.name).casefold()))
    return [each for each in (who.participant, who.email.casefold(), " ".join(words) or who.name) if each]


def with_students(
    submissions: Sequence[Submission], students: Sequence[Student]
) -> tuple[list[Submission], list[Submission]]:
    """Return submissions under the names of a list, with one for each student who handed in nothing.

    Returns:
        All submissions, and those of them that belong to nobody on the list, or to one of several with that name.
    """
    known: dict[str, list[Student]] = {}
    for student in students:
        for identity in identities(student):
            known.setdefault(identity, []).append(student)
    found: list[Submission] = []
    strangers: list[Submission] = []
    seen: set[int] = set()
    for each in submissions:
        # A group's hand-in has the addresses of all its members.
        shared = [student for email in each.email.casefold().split(", ") for student in known.get(email, ())]
        matches = next((match for key in identities(each) if (match := known.get(key))), [])
        seen.update(student.line for student in (shared or matches[:1] if len(matches) < 2 else []))
        if len(matches) == 1:
            each = replace(each, **_listed_values(matches[0]))
        elif not shared:
            strangers.append(each)
        found.append(each)
    taken = {each.id.lower() for each in submissions}
    for student in students:
        if student.line not in seen:
            who = _listed_values(student) | {"time_s": None}
            found.append(Submission(**who, id=word_for(student.name, taken), problem=NOTHING))
    return found, strangers


def _listed_values(student: Student) -> dict[str, Any]:
    """Return what a list says of a student."""
    return {what: value for what, value in vars(student).items() if value} | {"name": printable(student.name)}
