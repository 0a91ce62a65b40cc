"""A crew of warm worker processes, one for each core; each has one order at a time, so the slowest does not decide.

A worker whose order takes it with it, such as one that is killed for its memory, is replaced, and costs no other order.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import subprocess
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any

from kiks.errors import WorkError
from kiks.ports.program_process import python_line
from kiks.ports.resources import processor_count

ASK_S = 0.2
"""Period at which a caller is asked whether the work goes on [s of real time]."""

ATTEMPTS = 2
"""How often an order is begun whose worker dies."""


@dataclass(frozen=True)
class Order:
    """What a worker is to do.

    Attributes:
        name: Its name; no other order has it.
        kind: What is to be done, one of those in `worker.py`.
        arguments: What is needed for it.
    """

    name: str
    kind: str
    arguments: tuple[Any, ...]


@dataclass(frozen=True)
class Answer:
    """What a worker has made of an order: a result, an error of the user's, or nothing, as it was lost.

    Attributes:
        result: The result.
        error: A message for the user; empty if there was no error.
        lost: How the worker has died; empty if it has not.
    """

    result: Any = None
    error: str = ""
    lost: str = ""


def answers_of(
    orders: Sequence[Order], workers: int | None = None, goes_on: Callable[[], bool] = lambda: True
) -> Iterator[tuple[str, Answer]]:
    """Yield the answer to each order with its name, as they come; the workers end when the generator is closed.

    Args:
        orders: The orders, begun in this order.
        workers: How many processes; one for each core if left out.
        goes_on: Asked several times a second; when it says no, what is under way ends, and no more comes.

    Raises:
        WorkError: If no worker can be started.
    """
    crew = _Crew(orders)
    try:
        for _ in range(min(workers or processor_count(), len(orders))):
            crew.hire()
        while crew.is_busy and goes_on():
            yield from crew.hear()
    finally:
        crew.close()


class _Worker:
    """A worker process.

    Attributes:
        order: The order that it has; None while it has none.
    """

    def __init__(self) -> None:
        self.connection, there = multiprocessing.Pipe()
        line = python_line("-m", "kiks.trials.worker", str(there.fileno()))
        try:
            with there:
                # What a supervisor prints goes nowhere.
                self.process = subprocess.Popen(
                    line, pass_fds=[there.fileno()], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
                )
        except OSError as error:
            raise WorkError(f"Cannot start a worker: {error.strerror or error}. End other programs.") from None
        self.order: Order | None = None

    def begin(self, order: Order) -> None:
        """Hand an order over."""
        self.order = order
        with contextlib.suppress(OSError):  # it has died, which is seen when its answer is read
            self.connection.send((order.kind, order.arguments))

    def close(self) -> str:
        """End it; return how it has ended."""
        self.process.kill()
        code = self.process.wait()
        self.connection.close()
        return f"by signal {-code}" if code < 0 else f"with exit code {code}"


class _Crew:
    """Workers and the orders that are left."""

    def __init__(self, orders: Sequence[Order]) -> None:
        self._left = deque(orders)
        self._attempts: dict[str, int] = {}
        self._workers: dict[object, _Worker] = {}  # by their connections

    @property
    def is_busy(self) -> bool:
        """Whether a worker has an order."""
        return any(worker.order is not None for worker in self._workers.values())

    def hire(self) -> None:
        """Start a worker, with the next order."""
        worker = _Worker()
        self._workers[worker.connection] = worker
        self._hand_out(worker)

    def hear(self) -> Iterator[tuple[str, Answer]]:
        """Wait for answers, and yield them."""
        for connection in wait([worker.connection for worker in self._workers.values()], ASK_S):
            worker = self._workers[connection]
            order = worker.order
            try:
                answer: Answer | None = worker.connection.recv()
                self._hand_out(worker)
            except (EOFError, OSError):
                answer = self._replace(worker)
            if answer is not None and order is not None:
                yield order.name, answer

    def close(self) -> None:
        """End all workers."""
        for worker in self._workers.values():
            worker.close()

    def _hand_out(self, worker: _Worker) -> None:
        worker.order = None
        if self._left:
            worker.begin(self._left.popleft())

    def _replace(self, worker: _Worker) -> Answer | None:
        """Put another worker in the place of one that has died; return the answer if its order is lost."""
        order = worker.order
        del self._workers[worker.connection]
        how = worker.close()
        answer = None
        if order is not None:
            attempts = self._attempts[order.name] = self._attempts.get(order.name, 0) + 1
            if attempts < ATTEMPTS:
                self._left.appendleft(order)
            else:
                answer = Answer(lost=f"the process of its world has ended {how}, {attempts} times")
        if self._left:
            self.hire()
        return answer
