"""The large arenas of tasks: few rooms for `light`, and none left in memory after the tests of a file."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.at_length import share


@pytest.fixture(autouse=True, scope="module")
def _few_rooms() -> Iterator[None]:
    from kiks.learn import environments, ready_tasks
    from kiks.model import shipped, wall_tables

    kept = ready_tasks.rooms, ready_tasks.dark_rooms, ready_tasks.heap, shipped.shipped_arena, wall_tables._shared
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ready_tasks, "LIGHT_ROOMS", share(6, ready_tasks.LIGHT_ROOMS))
        patch.setattr(environments, "LIT_ROOMS", share(6, environments.LIT_ROOMS))
        yield
    for each in (*kept, *environments.ENVIRONMENTS.values()):
        each.cache_clear()
