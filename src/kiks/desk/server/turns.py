"""Turns for what takes the processors for a while, such as tries and films: each in a thread that nothing else needs.

asyncio's own pool has few threads, which all requests of a server share: six long waits in it would stop everybody.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, TypeVar

from kiks.ports.resources import processor_count
from kiks.trials.crew import ASK_S

Done = TypeVar("Done")


@dataclass(eq=False)
class Share:
    """What one person has had of the processors.

    Attributes:
        used_s: Real time of this person's turns so far [s].
        is_waiting: Whether this person waits for a turn.
    """

    used_s: float = 0.0
    is_waiting: bool = False


class Turns:
    """Some turns at a time; the next one is for who has had the least so far.

    Args:
        count: How many at a time.
    """

    def __init__(self, count: int) -> None:
        self._free = count
        self._waiting: list[Share] = []  # who came first stands first
        self._changed = threading.Condition()

    def start(
        self, work: Callable[[], Done], share: Share, goes_on: Callable[[], bool] = lambda: True
    ) -> Future[Done | None]:
        """Start a thread that waits for a turn and then works; return what will be its result, or its error.

        Args:
            work: The work.
            share: Whose turn it is.
            goes_on: Asked several times a second before the turn; when it says no, there is none, and no result.
        """
        done: Future[Done | None] = Future()
        done.set_running_or_notify_cancel()  # so that who waits for it cannot cancel it

        def run() -> None:
            try:
                done.set_result(self._run(work, share, goes_on))
            except BaseException as error:
                done.set_exception(error)

        threading.Thread(target=run, name="kiks turn", daemon=True).start()
        return done

    def _run(self, work: Callable[[], Any], share: Share, goes_on: Callable[[], bool]) -> Any:
        if not self._take(share, goes_on):
            return None
        begin_s = time.monotonic()
        try:
            return work()
        finally:
            with self._changed:
                share.used_s += time.monotonic() - begin_s
                self._free += 1
                self._changed.notify_all()

    def _take(self, share: Share, goes_on: Callable[[], bool]) -> bool:
        """Wait for a turn; return whether there is one."""
        with self._changed:
            self._waiting.append(share)
            try:
                while not (is_next := self._free > 0 and min(self._waiting, key=lambda each: each.used_s) is share):
                    share.is_waiting = True
                    if not goes_on():
                        break
                    self._changed.wait(ASK_S)
                self._free -= is_next
                return is_next
            finally:
                self._waiting.remove(share)
                share.is_waiting = False
                self._changed.notify_all()


TRIES, FILMS = Turns(max(processor_count() - 1, 1)), Turns(max(processor_count() - 1, 1))
"""One turn for each core but one, which is the server's: thirty students of a room may press 'Try all' at once."""
