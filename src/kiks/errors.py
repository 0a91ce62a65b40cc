"""What can go wrong, for a user's eyes: every message says what must hold, what was given and what to do.

Every public call raises a `KiksError` for an argument, a file or an extra that it cannot use. So `Raises:` names only
what is particular.
"""

from __future__ import annotations

import importlib
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
