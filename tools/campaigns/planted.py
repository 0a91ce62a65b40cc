"""Campaigns that fail on purpose: what a runner does not notice here, it would not notice anywhere."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable, Iterator

from tools.campaigns.runner import SECRET, Broken, Campaign, Play

from kiks.errors import ParameterError


def _raises(rng: random.Random) -> None:
    raise ZeroDivisionError("planted")


def _dies(rng: random.Random) -> None:
    os.abort()


def _hangs(rng: random.Random) -> None:
    while True:
        time.sleep(1)


def _eats(rng: random.Random) -> None:
    bytearray(1 << 32)


def _tells(rng: random.Random) -> None:
    raise ParameterError(f"it must not be told, but it was {SECRET}.")


def _loses(rng: random.Random) -> None:
    raise Broken("lost", "planted")


def _refuses(rng: random.Random) -> None:
    raise ParameterError("it must be good, but it was bad. Mend it.")


def _third(act: Play) -> Callable[[], Play]:
    """Return a player of cases, a third of which have the planted fault: the report must count the others, too."""

    def play(rng: random.Random) -> None:
        if rng.random() < 1 / 3:
            act(rng)

    return lambda: play


def campaigns() -> Iterator[Campaign]:
    """Yield them."""
    for act in (_raises, _dies, _eats, _tells, _loses, _refuses):
        yield Campaign(f"planted{act.__name__.replace('_', '.')}", 12, _third(act), memory_mb=2000, is_named_only=True)
    yield Campaign("planted.hangs", 3, lambda: _hangs, limit_s=0.5, is_named_only=True)
