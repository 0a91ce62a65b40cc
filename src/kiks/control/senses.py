"""The senses of controllers: what a command reads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kiks.engine.state import PIXEL_COUNT
from kiks.errors import ParameterError, nearest, shown
from kiks.model.robot import SENSOR_COUNT


class Sense(NamedTuple):
    """A sense of controllers.

    Attributes:
        command: The command that reads it.
        size: Number of its readings.
        most: The largest reading.
    """

    command: str
    size: int
    most: int

    @property
    def request(self) -> bytes:
        """The command as it is sent."""
        return f"{self.command}\n".encode()


SENSES = {
    "proximity": Sense("N", SENSOR_COUNT, 1023),  # khepera-protocol.md 8.4
    "ambient": Sense("O", SENSOR_COUNT, 1023),
    "camera": Sense("T,2,T", PIXEL_COUNT // 4, 255),  # every fourth grey of a K213 (khepera-protocol.md 10.3)
}
"""The senses of controllers, in the order of their numbers in kernels."""


def reading_count(senses: Sequence[str]) -> int:
    """Return the number of readings of some senses together."""
    return sum(SENSES[sense].size for sense in senses)


def check_senses(senses: str | Sequence[str]) -> tuple[str, ...]:
    """Return some of `SENSES`."""
    try:
        given = (senses,) if isinstance(senses, str) else tuple(senses)
    except TypeError:
        raise ParameterError(f"senses must be some of {', '.join(SENSES)}, but they were {shown(senses)}.") from None
    for sense in given:
        if not isinstance(sense, str) or sense not in SENSES:
            raise ParameterError(
                f"senses must be some of {', '.join(SENSES)}, but {shown(sense)} was among them."
                f"{nearest(shown(sense), SENSES)}"
            )
    if len(set(given)) != len(given):
        raise ParameterError(f"senses must name each sense once, but they were {given}.")
    return given
