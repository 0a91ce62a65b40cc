"""A crew of warm worker processes, one for each core; each has one job at a time, so no worker waits for the slowest.

A worker that dies at its job, such as one that is killed for its memory, is replaced, and costs no other job.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import subprocess
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any

from kiks.errors import WorkError
from kiks.ports.program_process import python_line
from kiks.ports.resources import processor_count

ASK_S = 0.2
"""Period at which a caller is asked whether the work goes on [s of real time]."""

ATTEMPTS = 2
"""How often a job is begun whose worker dies."""

WorkerJob = Callable[[], Any]
"""What a worker is to do: a function of a module, perhaps with arguments (`functools.partial`), as it is pickled."""


@dataclass(frozen=True)
class JobResult:
    """What has come out of a job: a result, an error of the user's, or nothing, as it was lost.

    Attributes:
        result: The result.
        error: A message for the user; empty if there was no error.
        lost: How the worker has died; empty if it has not.
    """

    result: Any = None
    error: str = ""
    lost: str = ""


def results(
    jobs: Mapping[str, WorkerJob], workers: int | None = None, goes_on: Callable[[], bool] = lambda: True
) -> Iterator[tuple[str, JobResult]]:
    """Yield the result of each job with its name, as they come; the workers end when the generator is closed.

    Args:
        jobs: The jobs by their names, begun in this order.
        workers: How many processes; one for each core if left out.
        goes_on: Asked several times a second; when it says no, what is under way ends, and no more comes.

    Raises:
        WorkError: If no worker can be started.
    """
    crew = _Crew(jobs)
    try:
        for _ in range(min(workers or processor_count(), len(jobs))):
            crew.start_worker()
        while crew.is_busy and goes_on():
            yield from crew.results()
    finally:
        crew.close()


class _Worker:
    """A worker process.

    Attributes:
        job: The name of the job that it has; empty while it has none.
    """

    job = ""

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

    def close(self) -> str:
        """End it; return how it has ended."""
        self.process.kill()
        code = self.process.wait()
        self.connection.close()
        return f"by signal {-code}" if code < 0 else f"with exit code {code}"


class _Crew:
    """Workers and the jobs that are left."""

    def __init__(self, jobs: Mapping[str, WorkerJob]) -> None:
        self._jobs = jobs
        self._left = deque(jobs)
        self._deaths: Counter[str] = Counter()  # of workers, by jobs
        self._workers: dict[object, _Worker] = {}  # by their connections

    @property
    def is_busy(self) -> bool:
        """Whether a worker has a job."""
        return any(worker.job for worker in self._workers.values())

    def start_worker(self) -> None:
        """Start a worker, with the next job."""
        worker = _Worker()
        self._workers[worker.connection] = worker
        self._hand_out(worker)

    def results(self) -> Iterator[tuple[str, JobResult]]:
        """Wait for results, and yield them with the names of their jobs."""
        for connection in wait([worker.connection for worker in self._workers.values()], ASK_S):
            worker = self._workers[connection]
            job = worker.job
            try:
                result: JobResult | None = worker.connection.recv()
                self._hand_out(worker)
            except (EOFError, OSError):
                result = self._replace(worker)
            if result is not None:
                yield job, result

    def close(self) -> None:
        """End all workers."""
        for worker in self._workers.values():
            worker.close()

    def _hand_out(self, worker: _Worker) -> None:
        worker.job = self._left.popleft() if self._left else ""
        if worker.job:
            with contextlib.suppress(OSError):  # it has died, which is seen when its result is read
                worker.connection.send(self._jobs[worker.job])

    def _replace(self, worker: _Worker) -> JobResult | None:
        """Put another worker in the place of one that has died; return the result if its job is lost."""
        del self._workers[worker.connection]
        how = worker.close()
        result = None
        if worker.job:
            self._deaths[worker.job] += 1
            if self._deaths[worker.job] < ATTEMPTS:
                self._left.appendleft(worker.job)
            else:
                result = JobResult(lost=f"the process of its world has ended {how}, {ATTEMPTS} times")
        if self._left:
            self.start_worker()
        return result
