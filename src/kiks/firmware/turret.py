"""Intelligent turrets: what the firmware needs to pass a message on (khepera-protocol.md 4.18 and 10.1)."""

from __future__ import annotations

from typing import Protocol


class Turret(Protocol):
    """A module on the extension bus that answers orders of its own.

    An order is a capital letter with whole numbers; the answer's values follow the order's letter in lower case:
    order `T,1,D,0` with the answer `()` becomes `t,1,d`.
    """

    number: int
    name: str
    revision: tuple[int, int]

    def order(self, letter: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        """Carry out an order and return the values of its answer, None for an order it does not know."""
