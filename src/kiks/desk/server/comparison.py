"""Whether a run that was begun again is the one that was recorded."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from kiks.sim.read_completion import NEVER_NS
from kiks.sim.simulation import Simulation
from kiks.units import s_from_ns


class Instant(NamedTuple):
    """An instant of a run.

    Attributes:
        time_ns: When [ns].
        state_hash: Of its state.
    """

    time_ns: int
    state_hash: str


class Comparison:
    """Says whether a run is the same at an instant, as the `kiks.sim.event_loop.Supervisor` of its simulation.

    Args:
        sim: The simulation.
        instant: The instant, as it was recorded.
        say: Called with the outcome.

    Attributes:
        next_ns: When the instant comes [ns].
    """

    def __init__(self, sim: Simulation, instant: Instant, say: Callable[[str], None]) -> None:
        self.next_ns = instant.time_ns
        self._sim, self._instant, self._say = sim, instant, say

    def act(self) -> None:
        """Say it."""
        self.next_ns = NEVER_NS
        self._sim.loop.supervisor = None
        where = f"The programs have run again up to {s_from_ns(self._instant.time_ns):.3f} s"
        if self._sim.state_hash() == self._instant.state_hash:
            self._say(f"{where}: the same run, to the bit. Time is paused.")
        else:
            self._say(
                f"{where}, but it is not the run that was recorded. Was something changed by hand then, or do they "
                "depend on more than the robots' replies? Time is paused."
            )
