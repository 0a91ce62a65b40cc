"""The link between program and robot in place of a cable, as people name it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from kiks.errors import ParameterError, shown
from kiks.meant import nearest
from kiks.model.checks import check_kind
from kiks.model.data_file import Number, record, table_of

_Time = Annotated[Number, Field(ge=0, le=60e3, description="A link is late by a minute at most.")]


@record
class RadioLink:
    """By how much what is sent in one go comes later than over a cable, each way; a cable if all is left out.

    Args:
        latency_ms: The least delay [ms].
        jitter_ms: What 95 of 100 pieces are late by at most beyond that [ms].
        loss: Share of the packets that are lost, and sent again.
        retry_ms: After which time [ms].

    Example:
        >>> str(parse_link("latency_ms=60, loss=0.01")), parse_link("wifi,jitter_ms=0").retry_ms
        ('latency_ms=60.0,loss=0.01', 1500.0)
    """

    latency_ms: _Time = 0.0
    jitter_ms: _Time = 0.0
    loss: Annotated[Number, Field(ge=0, le=0.9, description="0.01 is one packet of a hundred.")] = 0.0
    retry_ms: _Time = 200.0

    def __str__(self) -> str:
        known = next((name for name, each in LINKS.items() if each == self), None)
        return known or ",".join(f"{name}={value!r}" for name, value in table_of(self).items())


LINKS = {
    "cable": RadioLink(),
    # 25 to 40 ms each way (Free2move, FAQ of Bluetooth modules). No figure of a robot's was found; the loss is chosen.
    "bluetooth": RadioLink(25.0, 15.0, 0.002),
    # Jitter, loss and retry fit measured exchanges (the page "Time"), which say nothing of the latency: it is chosen.
    "wifi": RadioLink(5.0, 13.0, 0.002, 1500.0),
}
"""Links by their names."""


def parse_link(text: str) -> RadioLink:
    """Return a link by its name, or with numbers of its own, or both: 'wifi,latency_ms=60'."""
    values: dict[str, float] = {}
    known = [*LINKS, *vars(RadioLink())]
    for place, part in enumerate(check_kind("link", text, str).split(",")):
        name, equals, number = (word.strip() for word in part.partition("="))
        if not (place or equals) and name in LINKS:
            values = dict(vars(LINKS[name]))
            continue
        try:
            if name in LINKS or name not in known:
                raise ValueError
            values[name] = float(number)
        except ValueError:
            hint = "" if name in known else nearest(name, known)
            raise ParameterError(
                f"link must be {', '.join(map(repr, LINKS))}, or numbers such as "
                f"'latency_ms=60,jitter_ms=10,loss=0.01,retry_ms=200', but it was {shown(text)}.{hint}"
            ) from None
    return RadioLink(**values)
