"""A supervisor: a Python file that acts in a world from outside while programs drive its robots, such as a referee."""

from __future__ import annotations

import runpy
import traceback
from collections.abc import Callable, Generator
from inspect import isgeneratorfunction
from pathlib import Path

from kiks.errors import KiksError, ParameterError
from kiks.model.checks import SECONDS_MAX, check_number
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s


class Supervision:
    """Lets the supervisor of a file act in a world, as a `kiks.sim.event_loop.Supervisor`.

    The file has a generator `supervise(sim)`. Its first part runs at once. Then it yields the time until it acts again
    [s of simulated time]; when it returns then, the run ends. `close` runs its `finally`, which may print a result.

    Attributes:
        next_ns: When it acts next [ns].
        end: Called with an exit code and a message when it has returned, or failed; raises to end the run.
    """

    def __init__(self, sim: Simulation, file: Path) -> None:
        self._sim, self._name = sim, file.name
        self.end: Callable[[int, str], object] = lambda code, message: None
        self.next_ns = sim.now_ns
        if not file.is_file():
            raise ParameterError(f"a supervisor must be a Python file, but there is none at {str(file)!r}.")
        supervise = runpy.run_path(str(file)).get("supervise")
        if not isgeneratorfunction(supervise):
            raise ParameterError(
                f"a supervisor must define a function supervise(sim) that yields the time until it acts again [s], but "
                f"{file.name} defines none."
            )
        self._acts: Generator[float, None, None] = supervise(sim)
        try:
            self._prepare()
        except StopIteration:
            self.next_ns = NEVER_NS
        sim.loop.supervisor = self

    def _prepare(self) -> None:
        wait_s = check_number("the time that a supervisor yields", next(self._acts), 0.001, SECONDS_MAX)
        self.next_ns += ns_from_s(wait_s)

    def act(self) -> None:
        """Let it act, and end the run when it has returned."""
        try:
            self._prepare()
        except StopIteration:
            self._finish(0, f"the supervisor has ended the run at {self._sim.time_s:.3f} s of simulated time.")
        except Exception as error:
            if not isinstance(error, KiksError):
                traceback.print_exc()
            self._finish(1, f"the supervisor {self._name} has failed: {error}")

    def _finish(self, code: int, message: str) -> None:
        self.next_ns = NEVER_NS
        self.end(code, message)

    def close(self) -> None:
        """End it, wherever it waits."""
        self._sim.loop.supervisor = None
        self._acts.close()
