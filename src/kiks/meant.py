"""Which known name, file or option was meant by a mistyped one: every hint "Did you mean X?" comes from here."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from os.path import commonprefix
from pathlib import Path

from kiks.errors import SHOWN_MAX, shown

_ROMAN = {"i": "1", "ii": "2", "iii": "3", "iv": "4", "v": "5", "vi": "6"}

LIKE = 0.6
"""How alike two names must be for one to be meant by the other, from 0 to 1 for the same name."""

BEGINNING = 0.85
"""How alike two names count of which one is the beginning of the other, with three letters at least."""


def closest(given: str, known: Iterable[str]) -> str | None:
    """Return the known name that was probably meant, or None.

    Capital letters, blanks, hyphens and underlines do not count, and 'khepera 2' is 'khepera_ii'.

    Example:
        >>> closest("Khepera2", ["khepera", "khepera_ii"]), closest("to-the-light", ["light", "to_the_light"])
        ('khepera_ii', 'to_the_light')
        >>> closest("exam", ["desk", "examples"]), closest("gamma", ["desk", "run"])
        ('examples', None)
    """
    import difflib

    matcher = difflib.SequenceMatcher(autojunk=False)

    def likeness(name: str) -> float:
        best = 0.0
        for one in typed:
            matcher.set_seq2(one)
            for other in _spellings(name):
                matcher.set_seq1(other)
                begins = len(min(one, other, key=len)) > 2 and (one.startswith(other) or other.startswith(one))
                best = max(best, matcher.ratio(), BEGINNING * begins)
        return best

    typed = [each for each in _spellings(given[:SHOWN_MAX]) if each]

    def rank(name: str) -> tuple[float, int, int, str]:
        beginning = commonprefix([name, given])  # noqa: RUF071  (of characters)
        return likeness(name), len(beginning), -abs(len(name) - len(given)), name

    best = max(known, key=rank, default="")
    return best if best and likeness(best) >= LIKE else None


def _spellings(name: str) -> set[str]:
    """Return a name in small letters without what stands between its words, also with digits for Roman numerals."""
    words = re.findall(r"[A-Z]*[a-z]+|[A-Z]+|[0-9]+|[^\W_]+|[^\w\s-]+", name)
    small = [word.lower() for word in words]
    return {"".join(small), "".join(_ROMAN.get(word, word) for word in small)}


def nearest(given: object, known: Iterable[str]) -> str:
    """Return ' Did you mean X?' for the known name nearest to a mistyped one, or nothing.

    Example:
        >>> nearest("proximty", ["proximity", "ambient"])
        " Did you mean 'proximity'?"
    """
    found = closest(given if isinstance(given, str) else shown(given), known)
    return f" Did you mean {found!r}?" if found else ""


def nearest_file(path: Path, known: Iterable[str] = ()) -> str:
    """Return ' Did you mean X?' for the file with nearly this path, or for a known name, or nothing."""
    folder = path.parent
    with suppress(OSError, ValueError):
        if path.exists():
            return ""
        if not folder.is_dir():
            other = closest(folder.name, (each.name for each in folder.parent.iterdir() if each.is_dir()))
            folder = folder.with_name(other or folder.name)
        found = closest(path.name, (each.name for each in folder.iterdir() if not each.name.startswith(".")))
        names = [str(folder / found)] if found else []
        return nearest(str(path), [*names, *known])
    return nearest(str(path), known)
