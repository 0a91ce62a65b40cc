"""A crew of warm worker processes, one for each core; each has one order at a time, so the slowest does not decide.

A worker whose order takes it with it, such as one that is killed for its memory, is replaced, and costs no other order.
"""

from __future__ import annotations

import contextlib
import json
import selectors
import subprocess
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from kiks.errors import WorkError
from kiks.ports.program_process import python_line
from kiks.ports.resources import processor_count

ASK_S = 0.2
"""Period at which a caller is asked whether the work goes on [s of real time]."""

ATTEMPTS = 2
"""How often an order is begun whose worker dies."""

_READ_SIZE = 1 << 20


@dataclass(frozen=True)
class Order:
    """What a worker is to do.

    Attributes:
        name: Its name; no other order has it.
        kind: What is to be done, one of those in `worker.py`.
        told: What is needed for it.
    """

    name: str
    kind: str
    told: str


@dataclass(frozen=True)
class Answer:
    """What a worker has made of an order: a result, an error of the user's, or nothing, as it was lost.

    Attributes:
        result: The result.
        error: A message for the user; empty if there was no error.
        lost: How the worker has died; empty if it has not.
    """

    result: str = ""
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
        line = python_line("-m", "kiks.trials.worker")
        try:
            self.process = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        except OSError as error:
            raise WorkError(f"Cannot start a worker: {error.strerror or error}. End other programs.") from None
        self.order: Order | None = None
        self._pieces: list[bytes] = []
        assert self.process.stdout is not None
        self.answers = self.process.stdout

    def begin(self, order: Order) -> None:
        """Hand an order over."""
        self.order = order
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):  # it has died, which the other pipe tells
            self.process.stdin.write(json.dumps([order.kind, order.told]).encode() + b"\n")
            self.process.stdin.flush()

    def take(self) -> Answer | None:
        """Return its answer if that is complete, else None.

        Raises:
            EOFError: If it has died.
        """
        piece = self.answers.read1(_READ_SIZE)  # type: ignore[attr-defined]
        if not piece:
            raise EOFError
        self._pieces.append(piece)
        if not piece.endswith(b"\n"):
            return None
        line = b"".join(self._pieces)
        self._pieces.clear()
        return Answer(**json.loads(line))

    def close(self) -> str:
        """End it; return how it has ended."""
        self.process.kill()
        code = self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            with contextlib.suppress(OSError):
                pipe.close()
        return f"by signal {-code}" if code < 0 else f"with exit code {code}"


class _Crew:
    """Workers and the orders that are left."""

    def __init__(self, orders: Sequence[Order]) -> None:
        self._left = deque(orders)
        self._attempts: dict[str, int] = {}
        self._workers: set[_Worker] = set()
        self._selector = selectors.DefaultSelector()

    @property
    def is_busy(self) -> bool:
        """Whether a worker has an order."""
        return any(worker.order is not None for worker in self._workers)

    def hire(self) -> None:
        """Start a worker, with the next order."""
        worker = _Worker()
        self._workers.add(worker)
        self._selector.register(worker.answers, selectors.EVENT_READ, worker)
        self._hand_out(worker)

    def hear(self) -> Iterator[tuple[str, Answer]]:
        """Wait for answers, and yield them."""
        for key, _ in self._selector.select(ASK_S):
            worker: _Worker = key.data
            order = worker.order
            try:
                answer = worker.take()
            except EOFError:
                answer = self._replace(worker)
            else:
                if answer is not None:
                    self._hand_out(worker)
            if answer is not None and order is not None:
                yield order.name, answer

    def close(self) -> None:
        """End all workers."""
        for worker in self._workers:
            worker.close()
        self._selector.close()

    def _hand_out(self, worker: _Worker) -> None:
        worker.order = None
        if self._left:
            worker.begin(self._left.popleft())

    def _replace(self, worker: _Worker) -> Answer | None:
        """Put another worker in the place of one that has died; return the answer if its order is lost."""
        order = worker.order
        self._selector.unregister(worker.answers)
        self._workers.discard(worker)
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
