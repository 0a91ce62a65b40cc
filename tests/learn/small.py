"""A task and a controller that take milliseconds."""

from __future__ import annotations

from typing import Any

import kiks


def small(**changes: Any) -> kiks.Task:
    """Return a task that takes 10 ms to evaluate."""
    return kiks.tasks.avoid(**{"seconds": 1.0, "worlds": 4} | changes)


@kiks.controller(parameters=2)
def ahead(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[:] = parameters
