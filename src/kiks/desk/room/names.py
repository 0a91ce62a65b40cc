"""The names of a class: which a room can have, and what folders they get."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from kiks.desk.server.folder import check_name
from kiks.errors import ParameterError, shown
from kiks.trials.students import read_students

STUDENTS_MAX = 200
"""Most students of a room: each has a world."""

NAME_MAX = 60
"""Most characters of a name."""

_OTHERS = re.compile(r"[^\w .,'-]")


def read_names(path: str | Path) -> list[str]:
    """Read the names of a list of students, such as `kiks grade` takes, too; each must be there once."""
    what = f"The file with the students' names {str(path)!r}"
    students = read_students(Path(path))
    seen: dict[str, int] = {}
    for each in students:
        if len(each.name) > NAME_MAX or not each.name.isprintable():
            raise ParameterError(
                f"{what} must have names of at most {NAME_MAX} printable characters, but line {each.line} is "
                f"{shown(each.name)}. Change it."
            )
        if (first := seen.setdefault(each.name.casefold(), each.line)) != each.line:
            raise ParameterError(
                f"{what} must have each name once, but {shown(each.name)} stands on lines {first} and {each.line}. Add "
                "what tells the two apart."
            )
    if not 1 <= len(students) <= STUDENTS_MAX:
        raise ParameterError(
            f"{what} must have 1 to {STUDENTS_MAX} names, one on each line, but it has {len(students)}. Write another "
            "file."
        )
    return [each.name for each in students]


def folder_name(name: str) -> str:
    """Return what the folder of a student is called, and what is handed in: never a path, and no two get the same.

    Example:
        >>> folder_name("Ada Lovelace"), folder_name("../etc")
        ('Ada Lovelace', 'etc-f7f9121f')
    """
    plain = _OTHERS.sub("_", name).strip(" ._-'")
    try:
        check_name(f"{plain}.kiks", (".kiks",))
        if plain == name:
            return name
    except ParameterError:
        plain = ""
    return f"{plain or 'student'}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
