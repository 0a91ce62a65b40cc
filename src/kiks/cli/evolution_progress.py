"""How far an evolution is: a line that changes on a terminal, lines now and then elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from kiks.learn.evolution import Evolution

EVERY_S = 5.0
"""Time between lines where there is no terminal [s]."""


@dataclass(frozen=True)
class Progress:
    """Functions that show how far an evolution is.

    Attributes:
        each: Called after each generation.
        each_round: Called before each round of its finals.
    """

    each: Callable[[Evolution], Any]
    each_round: Callable[[int, list[int]], Any]


@contextmanager
def progress_of(evolution: Evolution, generations: int | None, seconds: float | None) -> Iterator[Progress]:
    """Return functions that show how far an evolution is."""
    from rich.console import Console

    console = Console()
    begin_s, before = perf_counter(), len(evolution.generations)
    last_s = [begin_s]

    def done_and_left() -> tuple[float, float]:
        """Return the share that is done, and the time that is left [s]."""
        passed_s = perf_counter() - begin_s
        shares = [passed_s / seconds] if seconds else []
        if generations:
            shares.append((len(evolution.generations) - before) / max(generations - before, 1))
        done = min(max(shares, default=0.0), 1.0)
        return done, passed_s / done - passed_s if done else 0.0

    def text(width: int | None = None) -> str:
        """Return how far it is, in no more than so many characters if that can be."""
        now_s = perf_counter()
        rate = evolution.driven_s / max(now_s - last_s[0], 1e-9)
        last_s[0] = now_s
        shown = [f"{name} {value:.4f}" for name, value in evolution.figures.items()]
        figures = {figure: 1 + 2 * number for number, figure in enumerate(shown)}
        time = {f"{_metric(rate)} x real time": 1 + 2 * len(figures), f"{done_and_left()[1]:.0f} s left": 2}
        return _fitting({f"generation {len(evolution.generations)}": 0} | figures | time, width)

    if console.is_terminal:
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bars

        name, bar_width = evolution.task.name, min(20, console.width // 6)
        columns = (TextColumn(name), BarColumn(bar_width), TextColumn("{task.description}"))
        with Bars(*columns, console=console, transient=True) as bars:
            bar = bars.add_task("preparing", total=1.0)

            def show(_: Evolution) -> None:
                said = text(console.width - len(name) - bar_width - 2)
                bars.update(bar, completed=done_and_left()[0], description=said)

            def show_round(number: int, sizes: list[int]) -> None:
                bars.update(bar, completed=number / len(sizes), description=f"finals: {sizes[number]} candidates")

            yield Progress(show, show_round)
        return
    told_s = [-EVERY_S]

    def tell(_: Evolution) -> None:
        said = text()
        if perf_counter() - told_s[0] > EVERY_S or done_and_left()[0] >= 1:
            told_s[0] = perf_counter()
            typer.echo(said)

    def tell_round(number: int, sizes: list[int]) -> None:
        if not number:
            typer.echo(f"Finals: {sizes[0]} candidates in {len(sizes)} rounds")

    yield Progress(tell, tell_round)


def _fitting(parts: Mapping[str, int], width: int | None) -> str:
    """Return parts in a line, without the least important if it would become too wide.

    Args:
        parts: How important each is, the most important 0.
        width: Most characters; None for any number.

    Example:
        >>> _fitting({"generation 7": 0, "mean 0.5": 2, "best 0.9": 1}, 24)
        'generation 7   best 0.9'
    """
    line = "   ".join(parts)
    if width is None or len(line) <= width or len(parts) == 1:
        return line
    least = max(parts, key=lambda part: parts[part])
    return _fitting({part: rank for part, rank in parts.items() if part != least}, width)


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
