"""How far an evolution is: a line that changes on a terminal, lines now and then elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from kiks.learn.evolution import Evolution

EVERY_S = 5.0
"""Time between lines where there is no terminal [s]."""


@contextmanager
def progress_of(
    evolution: Evolution, generations: int | None, seconds: float | None
) -> Iterator[Callable[[Evolution], Any]]:
    """Return a function that shows how far it is; it is called after each generation."""
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

    def text() -> str:
        latest, number = evolution.generations[-1], len(evolution.generations)
        now_s = perf_counter()
        rate = len(latest.values) * evolution.task.driven_s / max(now_s - last_s[0], 1e-9)
        last_s[0] = now_s
        return (
            f"generation {number}   best {latest.fitness.max():.4f}   mean {latest.fitness.mean():.4f}   "
            f"champion {evolution.champion.fitness:.4f}   {_metric(rate)} x real time   "
            f"{done_and_left()[1]:.0f} s left"
        )

    if console.is_terminal:
        from rich.progress import BarColumn, Progress, TextColumn

        columns = (TextColumn(evolution.task.name), BarColumn(bar_width=20), TextColumn("{task.description}"))
        with Progress(*columns, console=console, transient=True) as progress:
            bar = progress.add_task("preparing", total=1.0)
            yield lambda _: progress.update(bar, completed=done_and_left()[0], description=text())
        return
    told_s = [-EVERY_S]

    def tell(_: Evolution) -> None:
        said = text()
        if perf_counter() - told_s[0] > EVERY_S or done_and_left()[0] >= 1:
            told_s[0] = perf_counter()
            typer.echo(said)

    yield tell


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
