"""What can go wrong, for a user's eyes: every message says what must hold, what was given and what to do.

Every public call raises a `KiksError` for an argument, a file or an extra that it cannot use. So `Raises:` names only
what is particular.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable
from contextlib import suppress
from os.path import commonprefix
from pathlib import Path
from typing import Any


class KiksError(Exception):
    """Base of all errors that KiKS raises on purpose.

    Example:
        >>> import kiks
        >>> try:
        ...     kiks.Arena.load("nowhere")
        ... except kiks.KiksError as error:
        ...     print(type(error).__name__)
        ArenaError
    """


class ParameterError(KiksError, ValueError):
    """A value does not keep the rule that its name states.

    Example:
        >>> import kiks
        >>> try:
        ...     kiks.Simulation(robots=-1)
        ... except kiks.ParameterError as error:
        ...     print(error)
        robots must be a whole number from 0 to 1000, but it was -1. Say how many you need.
    """


class ArenaError(KiksError):
    """A picture or a file is no arena.

    Example:
        >>> import kiks
        >>> try:
        ...     kiks.Arena.load("offic")
        ... except kiks.ArenaError as error:
        ...     print(str(error).rpartition(". ")[2])
        Did you mean 'office'?
    """


class LinkError(KiksError, OSError):
    """A port is unknown, busy or closed, or the robot's answer is not the one expected.

    Example:
        >>> import kiks
        >>> robot = kiks.Khepera(kiks.Simulation(seed=1).port(1))
        >>> robot.close()
        >>> try:
        ...     robot.proximity()
        ... except kiks.LinkError as error:
        ...     print(error)
        a port must be open to be used, but this one is closed. Open it again, or close it later.
    """


class HaltError(LinkError):
    """A person has halted the program on the desk."""


class WorkError(KiksError, RuntimeError):
    """An evaluation cannot be had: the work raises, or its workers are lost again and again."""


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


def installing(extra: str) -> str:
    """Return how the libraries of an extra are installed, beside the KiKS that is there already.

    Args:
        extra: The extra: 'film', 'learn', 'ray', 'render' or 'tournament'.

    Example:
        >>> installing("learn")
        "Run `pip install 'kiks[learn]'`"
    """
    return f"Run `pip install 'kiks[{extra}]'`"


SHOWN_MAX = 80
"""Most characters of a value that a message repeats."""


def shown(value: object) -> str:
    """Return how a message shows a value that was given: cut to `SHOWN_MAX` characters, on one line.

    Example:
        >>> shown("a" * 100)[-10:]
        "aaaaaa...'"
    """
    import reprlib

    short = reprlib.Repr()
    short.maxstring = short.maxother = short.maxlong = SHOWN_MAX
    short.maxlist = short.maxtuple = short.maxdict = short.maxarray = 9
    short.maxlevel = 3
    try:
        text = short.repr(value)
    except Exception:
        # Python prints no whole number of more than 4300 digits, and an object's own repr may fail.
        text = f"a {type(value).__name__} that cannot be shown"
    text = " ".join(text.split())
    return text if len(text) <= SHOWN_MAX else f"{text[: SHOWN_MAX - 4]}...{text[-1]}"


def printable(text: str, instead: str = " ") -> str:
    r"""Return a text of somebody else without what would steer a terminal, or break a line.

    Args:
        text: The text.
        instead: What stands for each such character.

    Example:
        >>> printable("red\x1b[31m", "?")
        'red?[31m'
    """
    return "".join(each if each.isprintable() else instead for each in text)


def figure(limit: float) -> str:
    """Return how a message writes a limit.

    Example:
        >>> figure(1e9), figure(8388606), figure(0.001)
        ('1e9', '8388606', '0.001')
    """
    return str(limit) if isinstance(limit, int) else f"{limit:g}".replace("e+0", "e")


def counted(count: float, noun: str) -> str:
    """Return how many there are of something.

    Example:
        >>> counted(1, "robot"), counted(3, "robot"), counted(2.5, "point")
        ('1 robot', '3 robots', '2.5 points')
    """
    number = str(count) if isinstance(count, int) else f"{count:g}"
    return f"{number} {noun}" if count == 1 else f"{number} {noun}s"


def library(name: str, extra: str = "learn") -> Any:
    """Return a module of a library that not every user has installed.

    Args:
        name: Its name.
        extra: The extra of KiKS that installs it.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise ParameterError(
            f"This needs {package}, but it cannot be imported ({error}). {installing(extra)}."
        ) from None
