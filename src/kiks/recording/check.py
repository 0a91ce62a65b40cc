"""Checks a recording: the run is made again from its inputs, and compared with what was recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kiks.recording.entries import Entry
from kiks.recording.log import HASH_LENGTH, RecordedLog
from kiks.recording.moments import moments
from kiks.recording.replay import Replay
from kiks.sim.simulation import Simulation
from kiks.units import TICK_NS


@dataclass(frozen=True)
class Checked:
    """What a check has found.

    Attributes:
        equal_count: Number of checkpoints that were the same, to the bit, before the first that was not.
        differs_ns: Time of the first one that was not [ns]; None if all were the same.
        first_tick: The first tick after which a robot was elsewhere; None if none was.
    """

    equal_count: int
    differs_ns: int | None = None
    first_tick: int | None = None


def check_recording(log: RecordedLog) -> Checked:
    """Make a recorded run again, and compare the state at each checkpoint."""
    equal: list[int] = []
    differing: list[int] = []

    def compare(checkpoint: Entry) -> None:
        if not is_same(checkpoint, replay.sim):
            differing.append(checkpoint.time_ns)
        elif not differing:
            equal.append(checkpoint.time_ns)

    replay = Replay(log, log.begin_ns, compare)
    while not differing and replay.advance():
        pass
    if not differing:
        return Checked(len(equal))
    first_ns = max(equal, default=log.begin_ns)
    return Checked(len(equal), differing[0], _first_tick(log, first_ns, differing[0]))


def is_same(checkpoint: Entry, sim: Simulation) -> bool:
    """Return whether a simulation is in the state of a checkpoint."""
    return sim.state_hash().encode() == checkpoint.data[:HASH_LENGTH]


def _first_tick(log: RecordedLog, begin_ns: int, end_ns: int) -> int | None:
    """Return the first tick of a time after which a robot was elsewhere than recorded."""
    replay = Replay(log, begin_ns)
    times_ns = range((begin_ns // TICK_NS + 1) * TICK_NS, end_ns + 1, TICK_NS)
    for moment in moments(log, times_ns):
        replay.sim.advance_to(moment.time_ns)
        if not np.array_equal(replay.sim.poses(), moment.poses):
            return moment.time_ns // TICK_NS
    return None
