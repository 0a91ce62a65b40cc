"""The lines that a program has run, from its start: where, how deep, when, and in which thread.

A place in a run is the number of lines that have run up to there, with this one. The same run has the same lines, so
that number leads to the same instant in each.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right

LINES_MAX = 1 << 24
"""Most lines that are kept; of a longer run, those from its start are dropped."""

_FILE = 1 << 24
"""The line of a file is a number below this; that of the file stands above it."""


class LineHistory:
    """The lines of a run.

    Attributes:
        places: The file and the line of each, as one number.
        depths: How many functions of the program call each other there.
        dropped: Number of lines that are not kept any more.
        acts: The count of acts of the program at the last mark.
    """

    def __init__(self) -> None:
        self.places, self.depths = array("Q"), array("H")
        self.dropped, self.acts = 0, -1
        self._files: list[str] = []
        # Where the time or the thread is another one than before: the count of lines before it, and both [ns].
        self._begins, self._times, self._threads = array("Q"), array("Q"), array("I")

    @property
    def count(self) -> int:
        """The number of lines that have run."""
        return self.dropped + len(self.places)

    def base_of(self, file: str) -> int:
        """Return what is added to the lines of a file."""
        self._files.append(file)
        return len(self._files) * _FILE

    def mark(self, acts: int, time_ns: int, thread: int) -> None:
        """Note the time [ns] and the thread of the last line."""
        self.acts = acts
        self._begins.append(self.count - 1)
        self._times.append(time_ns)
        self._threads.append(thread)

    def trim(self) -> None:
        """Drop lines from the start of the run if there are too many."""
        if len(self.places) > LINES_MAX:
            self.dropped += LINES_MAX // 2
            del self.places[: LINES_MAX // 2], self.depths[: LINES_MAX // 2]

    def place(self, count: int) -> tuple[str, int]:
        """Return the file and the line of a place in the run."""
        place = self.places[count - 1 - self.dropped]
        return self._files[place // _FILE - 1], place % _FILE

    def thread(self, count: int) -> int:
        """Return the thread at a place in the run."""
        return self._threads[bisect_right(self._begins, count - 1) - 1]

    def time_ns(self, count: int) -> int:
        """Return the time at a place in the run [ns]."""
        return self._times[bisect_right(self._begins, count - 1) - 1]

    def last_before(self, count: int, depth_max: int, places: set[int] | None = None) -> int:
        """Return the last line before a place in the run; 0 if there is none.

        Args:
            count: The place.
            depth_max: How deep it may be, in the same thread; 0: in any depth and thread.
            places: The files and lines that count; None: all.
        """
        thread = self.thread(count) if depth_max else 0
        for index in range(count - 2 - self.dropped, -1, -1):
            if (places is None or self.places[index] in places) and (
                not depth_max or (self.depths[index] <= depth_max and self.thread(self.dropped + index + 1) == thread)
            ):
                return self.dropped + index + 1
        return 0

    def last_at(self, time_ns: int) -> int:
        """Return the last line up to a time [ns]; 0 if none has run by then."""
        index = bisect_right(self._times, time_ns)
        return self._begins[index] if index < len(self._begins) else self.count
