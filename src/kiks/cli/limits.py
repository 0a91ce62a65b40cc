"""`--seconds` and `--max-wall`: limits of the time that a run takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from kiks.ending import OUT_OF_TIME, ended_after
from kiks.model.checks import SECONDS_MAX, check_number
from kiks.units import ns_from_s

if TYPE_CHECKING:
    from kiks.sim.simulation import Simulation

Seconds = Annotated[
    float | None,
    typer.Option(
        help="Simulated time at which the run ends [s]; that of the project or champion, if it has one, if left out."
    ),
]
MaxWall = Annotated[
    float | None,
    typer.Option(help="Real time after which the run ends [s], whatever runs; exit code 124, and not repeatable."),
]


class Limits:
    """The limits of a run, in simulated and in real time [s]; None for no limit.

    Attributes:
        doubt: Why the run is not repeatable; empty if a limit of real time has not ended it.
    """

    def __init__(self, seconds: float | None, max_wall_s: float | None) -> None:
        self._end_ns = None if seconds is None else ns_from_s(check_number("--seconds", seconds, 0, SECONDS_MAX))
        self._wall_s = None if max_wall_s is None else check_number("--max-wall", max_wall_s, 0.001, 1e7, "Take 60.")
        self._seconds = seconds
        self.doubt = ""

    @contextmanager
    def kept(
        self,
        sim: Simulation,
        end: Callable[[int, str], NoReturn],
        end_soon: Callable[[int, str], object] | None = None,
    ) -> Iterator[None]:
        """End what runs meanwhile at the first limit that it reaches.

        Args:
            sim: The world.
            end: Ends it with an exit code and a message, by an exception.
            end_soon: The same from the handler of a signal; `end` if left out.
        """

        def end_in_real_time() -> None:
            self.doubt = "--max-wall has ended it"
            (end_soon or end)(OUT_OF_TIME, f"--max-wall has ended the run after {self._wall_s:g} s of real time.")

        if self._end_ns is not None:
            at_s = f"{self._seconds:g}"
            sim.loop.end_at(self._end_ns, lambda: end(0, f"the run has ended after {at_s} s of simulated time."))
        if (supervision := sim.loop.supervisor) is not None:
            supervision.end = end  # type: ignore[attr-defined]
        with ended_after(self._wall_s, end_in_real_time):
            yield
