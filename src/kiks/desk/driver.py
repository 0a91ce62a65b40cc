"""The driver: moves the world of a desk, by its programs where there are some, by itself where there are none."""

from __future__ import annotations

import threading
from collections.abc import Callable

from kiks.desk.desk import Desk
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

SLICE_NS = NS_PER_S // 50
"""Simulated time that passes in one go while no program moves it [ns]; the gate says when."""

ROUND_S = 0.05
"""Longest time that a word of a program is waited for [s of real time]: a desk that is closed is noticed within it."""


class Driver:
    """Moves the world of a desk: whatever was set going goes on.

    Args:
        desk: The desk.
        programs_ended: Called with the world, locked, when the programs that moved it have all ended.
    """

    def __init__(self, desk: Desk, programs_ended: Callable[[Simulation], None] = lambda sim: None) -> None:
        self._desk = desk
        self._programs_ended = programs_ended
        self._is_over = threading.Event()

    def run(self) -> None:
        """Let time pass as programs and the gate allow, until `stop`."""
        while not self._is_over.is_set():
            programs = self._desk.programs
            had_programs = programs.drive
            programs.round(ROUND_S if had_programs else 0)
            if not programs.drive:
                with programs.sim.lock:
                    if had_programs:
                        self._programs_ended(programs.sim)
                    programs.sim.advance_to(programs.sim.now_ns + SLICE_NS)
                    programs.sim.sync()
            self._desk.clear_away()

    def stop(self) -> None:
        """End it; from any thread."""
        self._is_over.set()
        self._desk.gate.close()
