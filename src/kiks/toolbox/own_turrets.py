"""Turrets that are functions of a program of Octave or MATLAB, in its folder `turrets`.

An order for such a turret is answered with a question: the program calls its function, and sends order and reply
together. Then the order goes over the robot's line, and the robot answers with that reply.
"""

from __future__ import annotations

import re

from kiks.errors import ParameterError, shown
from kiks.firmware.turret import Turret

_ORDER = re.compile(r"T, *([0-9]{1,9}) *,[^\r\n]+[\r\n]", re.ASCII)


class TurretOrder(Exception):  # noqa: N818 (it is a question to the program, not an error)
    """The program must work out the reply to an order: the number of the port, and the order without its line end."""


class OwnTurret(Turret):
    """Takes the place of such a turret on a robot.

    Args:
        number: Its number.
        name: The name of its function.
    """

    def __init__(self, number: int, name: str) -> None:
        self.number, self.name = number, name


def parse_turrets(words: str) -> dict[int, str]:
    """Return the names of turrets by their numbers.

    Example:
        >>> parse_turrets("24 compass 25 gps")
        {24: 'compass', 25: 'gps'}
    """
    given = words.split()
    pairs = list(zip(given[::2], given[1::2], strict=False))
    if len(given) % 2 or not all(
        number.isascii() and number.isdigit() and 1 <= int(number) <= 99 for number, _ in pairs
    ):
        raise ParameterError(f"turrets must be numbers from 1 to 99, each with a name, but they were {shown(words)}.")
    return {int(number): name for number, name in pairs}


def addressed_turret(text: str) -> int | None:
    r"""Return the number of the turret that a line is an order for; None for anything else.

    Example:
        >>> [addressed_turret(text) for text in ("T,24,C\n", "T,24,C", "N\n", "T,24,C\nN\n")]
        [24, None, None, None]
    """
    found = _ORDER.fullmatch(text)
    return None if found is None else int(found[1])
