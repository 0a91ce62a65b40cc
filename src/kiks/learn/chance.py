"""Random numbers for libraries that draw them from Python's module `random`."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock


class SeededRandom:
    """Random numbers of a seed for such a library; the numbers of the rest of the process are not disturbed.

    Args:
        seed: The seed.

    Example:
        >>> one, other = SeededRandom(1), SeededRandom(1)
        >>> with one.drawn():
        ...     drawn = random.random()
        >>> with other.drawn():
        ...     print(random.random() == drawn)
        True
    """

    _lock = Lock()

    def __init__(self, seed: int) -> None:
        self._state = random.Random(seed).getstate()

    @contextmanager
    def drawn(self) -> Iterator[None]:
        """Let the module `random` draw its numbers meanwhile."""
        with self._lock:
            others = random.getstate()
            random.setstate(self._state)
            try:
                yield
            finally:
                self._state = random.getstate()
                random.setstate(others)
