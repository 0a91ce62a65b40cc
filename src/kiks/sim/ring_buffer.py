"""The newest of what comes without end, for anybody who looks now and then."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable
from itertools import islice
from typing import Generic, TypeVar

Item = TypeVar("Item")


class RingBuffer(Generic[Item]):
    """Keeps the newest things and forgets the older ones. Each has a number, so that several may read, each on its own.

    Args:
        limit: How many are kept.

    Example:
        >>> ring = RingBuffer(3)
        >>> ring.add("abcde")
        >>> ring.since(0)
        (2, ['c', 'd', 'e'])
        >>> ring.since(4), ring.since(5)
        ((4, ['e']), (5, []))
    """

    def __init__(self, limit: int) -> None:
        self._lock = threading.Lock()
        self._items: deque[Item] = deque(maxlen=limit)
        self._count = 0

    @property
    def count(self) -> int:
        """How many have come, those included that are forgotten; the number of the next one."""
        return self._count

    def add(self, items: Iterable[Item], *, skipped: int = 0) -> None:
        """Take things, in their order; before them others came that were not worth keeping, as many as `skipped`."""
        new = list(items)
        with self._lock:
            if skipped:
                self._items.clear()
            self._items.extend(new)
            self._count += skipped + len(new)

    def append(self, item: Item) -> None:
        """Take one thing."""
        with self._lock:
            self._items.append(item)
            self._count += 1

    def since(self, number: int) -> tuple[int, list[Item]]:
        """Return what is kept from a number on, and the number of its first: a larger one if some are forgotten."""
        with self._lock:
            first = max(number, self._count - len(self._items))
            kept_from = self._count - len(self._items)
            return first, list(islice(self._items, first - kept_from, None))
