"""A ring buffer with numbered entries, so that several readers can each read on from where they were."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable
from itertools import islice
from typing import Generic, TypeVar

Item = TypeVar("Item")


class RingBuffer(Generic[Item]):
    """Keeps the newest entries and drops older ones. Entries are numbered from 0.

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
        """Number of the next entry: how many were added, dropped ones included."""
        return self._count

    def add(self, items: Iterable[Item], *, skipped: int = 0) -> None:
        """Add entries in order, after `skipped` entries that are dropped at once."""
        new = list(items)
        with self._lock:
            if skipped:
                self._items.clear()
            self._items.extend(new)
            self._count += skipped + len(new)

    def append(self, item: Item) -> None:
        """Add one entry."""
        with self._lock:
            self._items.append(item)
            self._count += 1

    def replace_last(self, item: Item) -> None:
        """Put an entry in the place of the newest one; there must be one. Its number stays the same."""
        with self._lock:
            self._items[-1] = item

    def since(self, number: int) -> tuple[int, list[Item]]:
        """Return the entries from a number on, and the number of the first: larger if some were dropped."""
        with self._lock:
            oldest = self._count - len(self._items)
            first = max(number, oldest)
            return first, list(islice(self._items, first - oldest, None))
