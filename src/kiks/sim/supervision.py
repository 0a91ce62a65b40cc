"""Supervision: what acts in a world from outside while programs drive its robots, such as a referee or the judge."""

from __future__ import annotations

import runpy
import sys
import threading
import traceback
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from inspect import isgeneratorfunction
from pathlib import Path
from types import ModuleType

from kiks.errors import KiksError, ParameterError, counted
from kiks.model.checks import SECONDS_MAX, check_number
from kiks.model.goal import Goal
from kiks.model.program_files import ProgramFiles
from kiks.sim.judge import POINTS, RESULT, Judge
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s

Acts = Generator[float, None, None]

REFEREE, JUDGE = "the supervisor", "the judge"
"""What messages call those who act."""

_IMPORTING = threading.RLock()
"""Modules of one supervisor at a time are those that Python finds."""


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
        self._modules = None if file is None else _ModulesBeside(file)
        self._acts: dict[str, Acts] = {}
        self._due_ns: dict[str, int] = {}
        try:
            if file is not None:
                with self._importing(REFEREE):
                    acts = _load_supervise(file)(sim)
                self._begin(REFEREE, acts)
            if goal is not None:
                self._check_counts(goal)
                self.judge = Judge(sim, goal)
                self._begin(JUDGE, self.judge.supervise(sim))
        # It is a sentence for people already.
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
        # With a supervisor it may still come: it counts what it likes, when it likes.
        if missing and self._file is None:
            raise ParameterError(
                f"the goal must ask for what a supervisor counts, but score({missing[0]}) is counted by none. Name the "
                'supervisor: supervisor = "referee.py".'
            )

    def join(self, who: str, acts: Acts) -> None:
        """Add what acts in the world after the supervisor and the judge."""
        self._begin(who, acts)
        self.next_ns = min(self._due_ns.values())
        self._sim.loop.supervisor = self

    def _begin(self, who: str, acts: Acts) -> None:
        self._acts[who] = acts
        try:
            self._prepare(who, self._sim.now_ns)
        except StopIteration:
            # One that has only prepared the world, and waits for nothing.
            self._due_ns[who] = NEVER_NS

    def _prepare(self, who: str, now_ns: int) -> None:
        with self._importing(who):
            acts_again_s = next(self._acts[who])
        wait_s = check_number("the time that a supervisor yields", acts_again_s, 0.001, SECONDS_MAX)
        self._due_ns[who] = now_ns + ns_from_s(wait_s)

    def _importing(self, who: str) -> AbstractContextManager[None]:
        return self._modules.found() if self._modules is not None and who == REFEREE else nullcontext()

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


class _ModulesBeside:
    """The modules beside a supervisor: each supervisor has its own, read anew, as each program has in its process."""

    def __init__(self, file: Path) -> None:
        self._folder = str(file.resolve().parent)
        names = {Path(name).parts[0].removesuffix(".py") for name in ProgramFiles(file).files}
        self._names = names - {*sys.stdlib_module_names, "kiks"}
        self._own: dict[str, ModuleType] = {}

    @contextmanager
    def found(self) -> Iterator[None]:
        """Let `import` find them meanwhile."""
        with _IMPORTING:
            # Another supervisor or program may have modules of the same names: they step aside meanwhile.
            others = self._taken()
            sys.modules.update(self._own)
            sys.path.insert(0, self._folder)
            try:
                yield
            finally:
                # The supervisor may have changed the path itself.
                with suppress(ValueError):
                    sys.path.remove(self._folder)
                self._own = self._taken()
                sys.modules.update(others)

    def _taken(self) -> dict[str, ModuleType]:
        """Take the modules of these names out of those that Python has."""
        return {name: sys.modules.pop(name) for name in [*sys.modules] if name.partition(".")[0] in self._names}


def _load_supervise(file: Path) -> Callable[[Simulation], Acts]:
    if not file.is_file():
        raise ParameterError(f"a supervisor must be a Python file, but there is none at {str(file)!r}.")
    supervise = runpy.run_path(str(file)).get("supervise")
    if not isgeneratorfunction(supervise):
        raise ParameterError(
            f"a supervisor must define a function supervise(sim) that yields the time until it acts again [s], but "
            f"{file.name} defines none."
        )
    return supervise
