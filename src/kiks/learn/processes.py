"""Workers that are processes of this computer, each with one thread.

Need: a worker that dies (out of memory, a crash in compiled code) must cost its chunk only. With concurrent.futures it
breaks the whole pool, and multiprocessing.Pool waits for it for ever: what workers share there may be left locked.
Method: a process and a pipe a worker, and nothing shared. A pipe ends with its worker, and a worker with its pipe: none
outlives the program that started it, however that ends.
"""

from __future__ import annotations

import os
import pickle
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import connection, get_context, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from kiks.errors import ParameterError
from kiks.learn.evaluation import Answer, Evaluation, Floats, Integers, Lost, Ready, Worker

PATIENCE_S = 5.0
"""How long a worker may take to end by itself [s]."""


class ProcessCrew:
    """A crew of processes (`WorkerPool`).

    Args:
        work: What evaluates candidates.
        worker_count: How many processes.
    """

    def __init__(self, work: Evaluation, *, worker_count: int) -> None:
        self._work = work
        self._worker_count = worker_count
        self._workers: dict[int, _Process] = {}
        self._next_number = 0
        self._pickled = b""

    def open(self) -> None:
        """Pickle the work, once for all workers, and start these.

        Raises:
            ParameterError: If the work cannot be pickled.
        """
        try:
            self._pickled = pickle.dumps(self._work, protocol=pickle.HIGHEST_PROTOCOL)
        except Exception as error:
            raise ParameterError(
                f"Evaluations must be picklable to run in processes, but {type(self._work).__name__} is not: {error}."
                " Build what cannot be pickled in prepare(), and define classes and functions at the top of a module."
            ) from error
        self.muster()

    def close(self) -> None:
        """End all processes: at once those that work, the others by hanging up."""
        for worker in self._workers.values():
            worker.hang_up()
        while self._workers:
            self._workers.popitem()[1].end()

    def muster(self) -> int:
        """Ask all that have nothing to do whether they are there, start who is missing; return how many are to be."""
        for worker in self._workers.values():
            if not worker.is_busy:
                worker.send(None)
        while len(self._workers) < self._worker_count:
            self._workers[self._next_number] = _Process(self._pickled)
            self._next_number += 1
        return self._worker_count

    def hand(self, worker: int, candidates: Floats, seeds: Integers) -> None:
        """Give a chunk to a worker that is ready."""
        self._workers[worker].send((candidates, seeds))

    def wait(self) -> list[tuple[int, Answer]]:
        """Return who answered what, as soon as somebody has."""
        answers: list[tuple[int, Answer]] = []
        while not answers:
            numbers = {worker.pipe: number for number, worker in self._workers.items()}
            for pipe in connection.wait(list(numbers)):
                number = numbers[pipe]  # type: ignore[index]
                answer = self._workers[number].answer()
                if isinstance(answer, Lost):
                    del self._workers[number]
                if answer is not None:
                    answers.append((number, answer))
        return answers

    def dismiss(self, worker: int) -> None:
        """End a worker, whatever it does."""
        if worker in self._workers:
            self._workers.pop(worker).end()


class _Process:
    """A worker's process, seen from here.

    Args:
        pickled: The work; it is sent when the process is there to take it, so that many start at the same time.

    Attributes:
        pipe: Where its answers come from.
        is_busy: Whether it owes an answer.
    """

    def __init__(self, pickled: bytes) -> None:
        context = get_context("spawn")
        self.pipe, far_end = context.Pipe()
        self.is_busy = True
        self._pickled = pickled
        self._process: SpawnProcess = context.Process(target=_serve, args=(far_end,), name="kiks-worker", daemon=True)
        with far_end, _for_a_worker():
            self._process.start()

    def send(self, message: tuple[Floats, Integers] | None) -> None:
        """Ask for something; that it is gone is seen when the answer is awaited."""
        self.is_busy = True
        with suppress(OSError):
            self.pipe.send(message)

    def answer(self) -> Answer | None:
        """Return the answer that has come, None if it only asked for the work."""
        try:
            answer: Answer | None = self.pipe.recv()
            if answer is None:
                self.pipe.send_bytes(self._pickled)
            else:
                self.is_busy = False
            return answer
        except (EOFError, OSError):
            return self.end()

    def hang_up(self) -> None:
        """Let it end: by itself if it has nothing to do."""
        self.pipe.close()
        if self.is_busy:
            self._process.kill()

    def end(self) -> Lost:
        """See that it ends, and return how it did."""
        self.hang_up()
        self._process.join(PATIENCE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(PATIENCE_S)
        code = self._process.exitcode
        if code is not None:
            self._process.close()
        return Lost(f"was ended by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}")


@contextmanager
def _for_a_worker() -> Iterator[None]:
    """Make what a process inherits what a worker needs: Ctrl-C is not for it, and libraries start one thread each."""
    # It would let Ctrl-C through, once, if the first worker had it started.
    resource_tracker.ensure_running()
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if before is None:
            del os.environ["OMP_NUM_THREADS"]
        else:
            os.environ["OMP_NUM_THREADS"] = before


def _serve(pipe: Connection) -> None:
    """Be a worker: ask for the work, prepare it, evaluate what comes until the other end hangs up."""
    with suppress(EOFError, OSError):
        pipe.send(None)
        pickled = pipe.recv_bytes()
        worker = Worker(lambda: pickle.loads(pickled), threads=1)
        pipe.send(worker.prepare())
        while True:
            chunk: tuple[Floats, Integers] | None = pipe.recv()
            pipe.send(Ready() if chunk is None else worker.evaluate(*chunk))
