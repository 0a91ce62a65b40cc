"""What is noted of a run that is recorded: entries of these kinds, in their order.

A run is its inputs. Replies, motion and contacts follow from them, so a recording leaves them out.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Protocol

from kiks.clock.sleeping import SimulatedClock


class Kind(IntEnum):
    """What an entry is.

    The first ones are the inputs, which make the run again. A state is what was changed in any other way than over a
    line, by a hand or a program: all that the simulation was after it. A check comes at each whole second, so that a
    replay can be compared there; now and then it has the state, so that a replay may begin there.
    """

    STATE = 0  # data: of `state_bytes`
    CHECK = 1  # data: 16 characters of the hash, then nothing or that of `state_bytes`
    SEND = 2  # data: characters for the robot; number, other: when they are sent, and when the first begins [ns]
    TYPE = 3  # the same, typed by a person, who gets the replies in place of the host
    HANG_UP = 4
    SET_BAUD = 5  # number: [bit/s]
    DROP = 6  # number, other: `until_ns` and `now_ns` of `Wire.drop_after`
    SCORE = 7  # data: what and value of `Simulation.set_score`, as a list in JSON
    ACT = 16  # the robot has done what was due; data: the reply; number, other: when it starts, a character [ns].
    # Only those of robots whose turrets a replay may not have are written, and one without data for each between two
    # inputs of one instant.
    THINK = 17  # number, other: from when to when the program thought [ns]
    TEXT = 18  # data: a line that the robot's program printed, in UTF-8
    MARK = 19  # data: a person's note, in UTF-8; number: the time that it is about [ns]


LAST_INPUT = Kind.SCORE
"""Kinds up to this one are inputs."""

STATE, CHECK, SEND, TYPE, HANG_UP, SET_BAUD, DROP, SCORE, ACT, THINK, TEXT, MARK = (int(kind) for kind in Kind)
"""The same as plain numbers: members of an enumeration cost a tenth of a microsecond more."""

NotedEntry = tuple[int, int, int, int, int, bytes]
"""Kind, time [ns], index of the robot (0 where it has none), number and other (see `Kind`), data."""


class WireRecorder(Protocol):
    """Takes the inputs of wires.

    Attributes:
        clock: The world's.
        note: Takes an input, or when a program has thought.
    """

    clock: SimulatedClock
    note: Callable[[NotedEntry], object]
