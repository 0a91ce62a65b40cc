"""What a program under test is to do, and what it has seen: it looks at the clock without asking for the time."""

from typing import Any

sim: Any = None
program: list[Any] = []
robots = 0
trace: list[tuple[int, int, Any]] = []


def note(number: int, what: Any) -> None:
    """Keep what a thread has seen, and when."""
    trace.append((number, sim.now_ns, what))
