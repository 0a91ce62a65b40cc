"""Programs in a world that its desk has not started: it can halt them, and some evaluate what people type."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from kiks.errors import ParameterError


class OutsidePrograms(Protocol):
    """These programs; the methods are called in the server's thread and wait for nothing."""

    def halt(self) -> None:
        """Halt the programs: each ends its wait, or fails when it uses its robot again."""

    def interpreters(self) -> dict[int, str]:
        """Return the names of those that evaluate commands, by their numbers."""

    def evaluate(self, number: int, command: str) -> None:
        """Let an interpreter evaluate a command."""


class PlainPrograms:
    """Programs that do not evaluate commands.

    Args:
        halt: Halts them; none are there if it is left out.
    """

    def __init__(self, halt: Callable[[], None] = lambda: None) -> None:
        self._halt = halt

    def halt(self) -> None:
        """Halt them."""
        self._halt()

    def interpreters(self) -> dict[int, str]:
        """Return nothing."""
        return {}

    def evaluate(self, number: int, command: str) -> None:
        """Refuse a command."""
        raise ParameterError(f"a command must be for a program of Octave or MATLAB, but {number} is none of them.")
