"""Supervision: what acts in a world from outside while programs drive its robots, such as a referee or the judge."""

from __future__ import annotations

import runpy
import traceback
from collections.abc import Callable, Generator
from contextlib import suppress
from inspect import isgeneratorfunction
from pathlib import Path

from kiks.errors import KiksError, ParameterError, counted
from kiks.model.checks import SECONDS_MAX, check_number
from kiks.model.goal import Goal
from kiks.sim.judge import POINTS, RESULT, Judge
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s

Acts = Generator[float, None, None]

REFEREE, JUDGE = "the supervisor", "the judge"
"""What messages call those who act."""


class Supervision:
    """Lets the supervisor of a file, and the judge of a goal, act in a world (`kiks.sim.event_loop.Supervisor`).

    The file has a generator `supervise(sim)`. Its first part runs at once. Then it yields the time until it acts again
    [s of simulated time]; when it returns then, the run ends. `close` runs its `finally`, which may print a result.
    The judge begins after it, so a goal may ask for what it puts in and counts, and acts after it at each instant.

    Args:
        sim: The world.
        file: The supervisor's file; None without one.
        goal: The goal; None without one.

    Attributes:
        judge: The judge of the goal; None without one.
        next_ns: When one of them acts next [ns].
        end: Called with an exit code and a message when one has returned, or failed; raises to end the run. The message
            is empty if the judge has ended it: `decide` says how.
    """

    def __init__(self, sim: Simulation, file: Path | None = None, goal: Goal | None = None) -> None:
        self._sim, self._file = sim, file
        self.end: Callable[[int, str], object] = lambda code, message: None
        self.judge: Judge | None = None
        self._acts: dict[str, Acts] = {}
        self._due_ns: dict[str, int] = {}
        try:
            if file is not None:
                self._begin(REFEREE, _supervise_of(file)(sim))
            if goal is not None:
                self._check_counts(goal)
                self.judge = Judge(sim, goal)
                self._begin(JUDGE, self.judge.supervise(sim))
        except KiksError:
            raise
        except Exception as error:
            traceback.print_exc()
            name = JUDGE if self._file is None else self._file.name
            raise ParameterError(
                f"a supervisor must be able to begin, but {name} has failed: {error}. Mend it where the lines above "
                "say."
            ) from None
        self.next_ns = min(self._due_ns.values(), default=NEVER_NS)
        if self._acts:
            sim.loop.supervisor = self

    def _check_counts(self, goal: Goal) -> None:
        """Check that there is something that counts what a goal asks for."""
        missing = sorted(map(repr, goal.counts() - {POINTS, RESULT, *self._sim.score}))
        if missing and self._file is None:
            raise ParameterError(
                f"the goal must ask for what a supervisor counts, but score({missing[0]}) is counted by none. Name the "
                'supervisor: supervisor = "referee.py".'
            )

    def _begin(self, who: str, acts: Acts) -> None:
        self._acts[who] = acts
        try:
            self._prepare(who, self._sim.now_ns)
        except StopIteration:
            self._due_ns[who] = NEVER_NS

    def _prepare(self, who: str, now_ns: int) -> None:
        wait_s = check_number("the time that a supervisor yields", next(self._acts[who]), 0.001, SECONDS_MAX)
        self._due_ns[who] = now_ns + ns_from_s(wait_s)

    def act(self) -> None:
        """Let those act that are due, and end the run when one has returned."""
        now_ns = self.next_ns
        for who, due_ns in tuple(self._due_ns.items()):
            if due_ns > now_ns:
                continue
            try:
                self._prepare(who, now_ns)
            except StopIteration:
                message = f"{who} has ended the run at {self._sim.time_s:.3f} s of simulated time."
                self._finish(0, "" if who == JUDGE else message)  # a judgement says it all
            except Exception as error:
                if not isinstance(error, KiksError):
                    traceback.print_exc()
                name = f" {self._file.name}" if self._file is not None and who == REFEREE else ""
                self._finish(1, f"{who}{name} has failed: {error}")
        self.next_ns = min(self._due_ns.values())

    @property
    def doubts(self) -> tuple[str, ...]:
        """Sentences about a goal that holds before anything has moved."""
        return () if self.judge is None else self.judge.doubts

    def decide(self) -> str:
        """Let the judge decide, and return its judgement in a sentence; an empty text without a goal."""
        if self.judge is None:
            return ""
        judgement = self.judge.end()
        return f"Goal {judgement}, {counted(judgement.points, 'point')}."

    def _finish(self, code: int, message: str) -> None:
        self._due_ns = dict.fromkeys(self._due_ns, NEVER_NS)
        self.next_ns = NEVER_NS
        self.end(code, message)

    def close(self) -> None:
        """End all, wherever they wait; the judge decides."""
        self._sim.loop.supervisor = None
        for acts in self._acts.values():
            acts.close()
        with suppress(KiksError):  # what is wrong with the goal ends the run, and is said then
            self.decide()


def _supervise_of(file: Path) -> Callable[[Simulation], Acts]:
    if not file.is_file():
        raise ParameterError(f"a supervisor must be a Python file, but there is none at {str(file)!r}.")
    supervise = runpy.run_path(str(file)).get("supervise")
    if not isgeneratorfunction(supervise):
        raise ParameterError(
            f"a supervisor must define a function supervise(sim) that yields the time until it acts again [s], but "
            f"{file.name} defines none."
        )
    return supervise
