"""What many tests of learning, controllers and batches share, so that a process compiles it once."""

from collections.abc import Callable
from typing import Any

import pytest

import kiks

SHY = """
import kiks

@kiks.controller(memory=2, parameters=1)
def shy(sensors, memory, parameters, wheels):
    wheels[0] = wheels[1] = 5.0 - parameters[0] * sensors[2]

def plain(sensors):
    pass
"""
"""A file of a user's own."""


def small(**changes: Any) -> kiks.Task:
    """Return a task that takes 10 ms to evaluate."""
    return kiks.tasks.avoid(**{"seconds": 1.0, "worlds": 4} | changes)


@kiks.controller(parameters=2)
def ahead(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[:] = parameters


def noted(sim: kiks.Simulation, port: Any) -> list[str]:
    """Return a list to which the port adds the hash of its world before each line that is sent."""
    hashes, send = list[str](), port.write

    def note_and_send(data: bytes) -> int:
        hashes.append(sim.state_hash())
        return int(send(data))

    port.write = note_and_send
    return hashes


def candidates_of(evolution: kiks.Evolution) -> bytes:
    """Return all candidates of an evolution, with their values."""
    return b"".join(each.candidates.tobytes() + each.values.tobytes() for each in evolution.generations)


def refused(message: str, call: Callable[..., Any], *given: Any, **options: Any) -> str:
    """Return the text of the error that a call with these arguments raises: one line that fits the message."""
    with pytest.raises(kiks.ParameterError, match=message) as caught:
        call(*given, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def forget_arenas() -> None:
    """Let go of the arenas that tasks keep, some hundred megabytes."""
    from kiks.learn import environments, ready_tasks
    from kiks.model import shipped, wall_tables

    kept = ready_tasks.rooms, ready_tasks.dark_rooms, ready_tasks.heap, shipped.shipped_arena, wall_tables._shared
    for each in (*kept, *environments.ENVIRONMENTS.values()):
        each.cache_clear()
