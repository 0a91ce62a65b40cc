"""The names of thinking policies: 'none', 'fixed:MS', 'live', 'live:FACTOR' or 'replay:FILE'."""

from __future__ import annotations

from contextlib import suppress

from kiks.errors import ParameterError, shown
from kiks.meant import nearest

_FORMS = "'none', 'fixed:MS', 'live', 'live:FACTOR' or 'replay:FILE'"


def split_thinking(text: str) -> tuple[str, float | str]:
    """Return the name of a policy and its number: milliseconds or a factor; of a replay, the file.

    Example:
        >>> split_thinking("live:0.5"), split_thinking("none"), split_thinking("replay:times.txt")
        (('live', 0.5), ('none', 0.0), ('replay', 'times.txt'))
    """
    name, _, value = text.partition(":") if isinstance(text, str) else ("", "", "")
    if name == "none" and not value:
        return name, 0.0
    if name == "fixed":
        return name, _number(text, value, "milliseconds", 3600e3)
    if name == "live":
        return name, _number(text, value, "a factor", 1e6) if value else 1.0
    if name == "replay" and value:
        return name, value
    raise ParameterError(
        f"thinking must be {_FORMS}, but it was {shown(text)}.{nearest(name, ['none', 'fixed', 'live', 'replay'])}"
    )


def _number(text: str, value: str, meaning: str, most: float) -> float:
    with suppress(ValueError):
        if 0 <= (number := float(value)) <= most:
            return number
    raise ParameterError(
        f"thinking must give {meaning} from 0 to {most:g} after the colon, but it was {shown(text)}. Example: "
        f"{text.partition(':')[0]}:5."
    )
