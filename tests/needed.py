"""Libraries without which the tests of a module are skipped."""

from __future__ import annotations

from importlib.util import find_spec

import pytest


def need(*libraries: str) -> None:
    """Skip the module that calls this if one of some libraries is not installed.

    It imports none of them: each worker collects all modules, and cma and ribs alone take three seconds.
    """
    for library in libraries:
        if find_spec(library) is None:
            pytest.skip(f"{library} is not installed", allow_module_level=True)
