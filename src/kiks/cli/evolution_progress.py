"""How far an evolution is: a line that changes on a terminal, lines now and then elsewhere; none with --quiet."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING, Self

import typer

from kiks.cli.outputs import is_quiet
from kiks.errors import counted

if TYPE_CHECKING:
    from kiks.learn.evolution import Evolution

EVERY_S = 5.0
"""Time between lines where there is no terminal [s]."""


class Progress:
    """Shows how far an evolution is, in a `with` statement.

    Args:
        evolution: The evolution.
        generations: Total number of generations at which it ends; None for any number.
        seconds: Time after which no generation begins [s]; None for any time.
    """

    def __init__(self, evolution: Evolution, generations: int | None, seconds: float | None) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bars
        from rich.table import Column

        self._console, self._generations, self._seconds = Console(), generations, seconds
        text = TextColumn("{task.description}", table_column=Column(no_wrap=True, overflow="ellipsis"))
        columns = (TextColumn(evolution.task.name), BarColumn(min(20, self._console.width // 6)), text)
        self._has_lines = not (is_quiet() or self._console.is_terminal)
        is_bar = self._console.is_terminal and not is_quiet()
        self._bars = Bars(*columns, console=self._console, transient=True, disable=not is_bar)
        self._bar = self._bars.add_task("preparing", total=1.0)
        self._before = len(evolution.generations)
        self._begin_s, self._last_s = perf_counter(), _working_s()
        self._told_s = -EVERY_S

    def __enter__(self) -> Self:
        """Begin to show it."""
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def each(self, evolution: Evolution) -> None:
        """Show how far it is; called after each generation."""
        now_s, count = perf_counter(), len(evolution.generations)
        working_s = _working_s()
        passed_s, rate = now_s - self._begin_s, evolution.driven_s / max(working_s - self._last_s, 1e-9)
        self._last_s = working_s
        shares = [passed_s / self._seconds] if self._seconds else []
        if self._generations:
            shares.append((count - self._before) / max(self._generations - self._before, 1))
        done = min(max(shares, default=0.0), 1.0)
        first, *others = (f"{name} {value:.4f}" for name, value in evolution.figures.items())
        left = f"{passed_s / done - passed_s if done else 0.0:.0f} s left"
        line = "   ".join((f"generation {count}", first, left, *others, f"{_metric(rate)} x real time"))
        self._bars.update(self._bar, completed=done, description=line)
        if self._has_lines and (now_s - self._told_s > EVERY_S or done >= 1):
            self._told_s = now_s
            typer.echo(line)

    def each_round(self, number: int, sizes: list[int]) -> None:
        """Show the finals; called before each round."""
        said = f"finals: {counted(sizes[number], 'candidate')}"
        self._bars.update(self._bar, completed=number / len(sizes), description=said)
        if self._has_lines and not number:
            typer.echo(f"Finals: {counted(sizes[0], 'candidate')} in {counted(len(sizes), 'round')}")


def _working_s() -> float:
    """Return a time [s] that stands still while something is compiled."""
    from kiks.engine.compiling import compiling_s

    return perf_counter() - compiling_s()


def _metric(number: float) -> str:
    """Return a number in thousands or millions.

    Example:
        >>> _metric(1234567.0)
        '1.2 M'
    """
    for size, letter in ((1e6, " M"), (1e3, " k")):
        if number >= size:
            return f"{number / size:.1f}{letter}"
    return f"{number:.0f}"
