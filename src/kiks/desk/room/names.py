"""The names of a class: read from a file that people write, and what folders they get."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from pathlib import Path

from kiks.desk.server.folder import check_name
from kiks.errors import ParameterError, shown
from kiks.model.data_file import read_file

STUDENTS_MAX = 200
"""Most students of a room: each has a world."""

NAME_MAX = 60
"""Most characters of a name."""

BYTES_MAX = 1 << 20
"""Most bytes of a file with names."""

_OTHERS = re.compile(r"[^\w .,'-]")


def read_names(path: str | Path) -> list[str]:
    """Read a file with a name on each line; empty lines do not count."""
    what = f"The file with the students' names {str(path)!r}"
    data = read_file(Path(path), what, bytes_max=BYTES_MAX)
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise ParameterError(f"{what} must be text in UTF-8, but it is not. Save it as such.") from None
    seen: dict[str, int] = {}
    names = []
    for number, line in enumerate(lines, 1):
        name = " ".join(unicodedata.normalize("NFC", line).split())
        if not name:
            continue
        if len(name) > NAME_MAX or not name.isprintable():
            raise ParameterError(
                f"{what} must have names of at most {NAME_MAX} printable characters, but line {number} is "
                f"{shown(name)}. Change it."
            )
        if (first := seen.setdefault(name.casefold(), number)) != number:
            raise ParameterError(
                f"{what} must have each name once, but {shown(name)} stands on lines {first} and {number}. Add what "
                "tells the two apart."
            )
        names.append(name)
    if not 1 <= len(names) <= STUDENTS_MAX:
        raise ParameterError(
            f"{what} must have 1 to {STUDENTS_MAX} names, one on each line, but it has {len(names)}. Write another "
            "file."
        )
    return names


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
