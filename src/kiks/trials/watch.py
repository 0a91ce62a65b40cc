"""Stops programs that let no simulated time pass: by the processor time that they take, not by the wall clock.

The time limit of a run is simulated, so it is the same everywhere. What is measured here stops only what is broken: a
loop that asks for nothing, or a wait that KiKS does not simulate.
"""

from __future__ import annotations

import threading
import time
from types import TracebackType

from kiks.ports.programs import Handle, Programs

SAMPLE_S = 0.1
"""Period of the samples [s of real time]."""

COMPUTING_S = 20.0
"""Most processor time that a program may take without a request [s]."""

TOTAL_S = 120.0
"""Most processor time of a program beyond one second for each simulated second [s]."""

STILL_S = 30.0
"""Longest real time in which a program neither computes nor asks for anything [s]: it waits for what never comes."""


class Watch:
    """Kills programs that let no simulated time pass, in a `with` statement.

    Args:
        programs: The programs.
        seconds: The time limit of the run [s of simulated time].

    Attributes:
        reasons: Why programs were killed, by the number of their robot.
    """

    def __init__(self, programs: Programs, seconds: float) -> None:
        self._programs, self._total_s = programs, TOTAL_S + seconds
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._seen: dict[int, tuple[int, float, float, float]] = {}
        self.reasons: dict[int, str] = {}

    def __enter__(self) -> Watch:
        """Begin to watch."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Watch no longer."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._over.wait(SAMPLE_S):
            for handle in list(self._programs.handles):
                if handle.is_running and handle.robot not in self.reasons and (reason := self._look_at(handle)):
                    self.reasons[handle.robot] = reason
                    handle.process.kill()

    def _look_at(self, handle: Handle) -> str:
        """Return why a program must be killed; empty if it need not."""
        used_s, now_s, at_ns = handle.process.processor_s, time.monotonic(), handle.acts_from_ns
        if used_s > self._total_s:
            return f"it took {used_s:.0f} s of processor time"
        seen = self._seen.get(handle.robot)
        if seen is None or seen[0] != at_ns or handle.is_held_up:
            self._seen[handle.robot] = at_ns, used_s, now_s, used_s
            return ""
        _, begin_s, still_s, last_s = seen
        if used_s - begin_s > COMPUTING_S:
            return f"it computed for {COMPUTING_S:.0f} s without a request to its robot"
        if used_s > last_s:
            self._seen[handle.robot] = at_ns, begin_s, now_s, used_s
        elif now_s - still_s > STILL_S:
            return f"it waited for {STILL_S:.0f} s for something that is not simulated"
        return ""
