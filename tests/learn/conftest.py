"""The large arenas of tasks: few rooms for `light`, and none left in memory after the tests of a file."""

from collections.abc import Iterator

import pytest
from tests.at_length import share
from tests.learn.small import forget_arenas


@pytest.fixture(autouse=True, scope="module")
def _few_rooms() -> Iterator[None]:
    from kiks.learn import environments, ready_tasks

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ready_tasks, "LIGHT_ROOMS", share(3, ready_tasks.LIGHT_ROOMS))
        patch.setattr(environments, "LIT_ROOMS", share(6, environments.LIT_ROOMS))
        yield
    forget_arenas()
