"""The executor for a Ray cluster, on this computer or on many: one worker per core, each a Ray actor.

A generation is cut into chunks: large enough to be worth sending, small enough that all workers finish together. Chunks
never show in results, because a candidate's values follow from its parameters and its seed alone (`Evaluation`).

A Ray cluster runs any code for any client that reaches it. So a cluster that is started here listens on the loopback
address alone, without Ray's dashboard; a cluster of several computers belongs on a private network
(docs/distributed.md).

Ray could restart lost actors and repeat lost calls by itself, but then no error would show that a chunk kills one
worker after the other. So actors are not restarted, and `RayExecutor` sends lost chunks again.
"""

from __future__ import annotations

import logging
import os
import pickle
import signal
import socket
import sys
import threading
from collections import deque
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from kiks.errors import ParameterError, WorkError, installing
from kiks.learn.evaluation import (
    Answer,
    Evaluation,
    Executor,
    Floats,
    Integers,
    Lost,
    Raised,
    Ready,
    Values,
    Worker,
    work_error,
)
from kiks.learn.fingerprint import differing
from kiks.version import __version__

_log = logging.getLogger("kiks.learn")

LOOPBACK = "127.0.0.1"

ANSWER_TIMEOUT_S = 10.0
"""Time without an answer after which the pool looks for new workers [s]."""

CONNECT_S = 60.0
"""Timeout for connecting to a cluster [s]; it takes a second or so, and more on a busy computer."""

CHUNK_S_MIN = 0.05
"""Shortest time that a chunk takes [s], if there is enough work: a hundred times what it costs to send it."""

LANES = 8
"""Worlds that the engine steps at once; a chunk of fewer candidates takes as long as one of these."""

LOSSES_MAX = 3
"""Workers that may be lost in a row with one chunk, or before their first evaluation."""


class RayExecutor(Executor):
    """Evaluates on a Ray cluster: a worker that has finished a chunk gets the next.

    Args:
        pool: The workers.
    """

    def __init__(self, pool: RayPool) -> None:
        super().__init__()
        self._pool = pool
        self._candidate_s: dict[int, float] = {}

    def _open(self) -> None:
        self._pool.open()

    def _close(self) -> None:
        self._pool.close()

    def _evaluate(self, candidates: Floats, seeds: Integers) -> Floats:
        generation = _Generation(self._pool, candidates, seeds, self._candidate_s)
        try:
            return generation.run()
        finally:
            generation.end()


class _Generation:
    """The evaluation of one generation.

    Args:
        pool: The workers.
        candidates: Parameters [candidate, parameter].
        seeds: A seed for each [candidate].
        candidate_s: Time per candidate of each worker [s], the mean of its latest chunks; kept up to date here.
    """

    def __init__(self, pool: RayPool, candidates: Floats, seeds: Integers, candidate_s: dict[int, float]) -> None:
        self._pool = pool
        self._candidates = candidates
        self._seeds = seeds
        self._candidate_s = candidate_s
        self._worker_count = pool.refill()
        self._chunks = Chunks(len(candidates), worker_count=self._worker_count)
        self._ready: list[int] = []
        self._busy: dict[int, Chunk] = {}
        self._values: Floats = np.empty((0, 0))
        self._failed_start_count = 0

    def run(self) -> Floats:
        """Return the values [candidate, value]."""
        while self._chunks or self._busy:
            self._send_chunks()
            answers = self._pool.wait()
            for worker, answer in answers:
                self._accept(worker, answer)
            if not answers and not self._busy:
                _log.warning("No worker is there yet. The evaluation continues when one comes.")
            if not answers or any(isinstance(answer, Lost) for _, answer in answers):
                # A lost computer takes all of its workers along, even those that are listed as ready.
                self._ready.clear()
                self._pool.refill()
        return self._values

    def end(self) -> None:
        """End the workers that still evaluate; their answers are no longer needed."""
        for worker in self._busy:
            self._pool.end(worker)

    def _send_chunks(self) -> None:
        while self._ready and self._chunks:
            worker = self._ready.pop(0)
            chunk = self._chunks.take(self._candidate_s.get(worker))
            self._busy[worker] = chunk
            part = slice(chunk.first, chunk.end)
            self._pool.send(worker, self._candidates[part], self._seeds[part])

    def _accept(self, worker: int, answer: Answer) -> None:
        chunk = self._busy.pop(worker, None)
        match answer:
            case Raised():
                if chunk is None:
                    self._pool.end(worker)
                raise work_error(f"evaluate() for {chunk}" if chunk else "prepare()", answer)
            case Lost():
                self._candidate_s.pop(worker, None)
                if chunk:
                    self._send_again(chunk, answer)
                else:
                    self._count_failed_start(answer)
                return
            case Values():
                assert chunk is not None
                self._store(chunk, answer)
                candidate_s = answer.duration_s / len(chunk)
                self._candidate_s[worker] = (self._candidate_s.get(worker, candidate_s) + candidate_s) / 2
            case Ready():
                pass
        self._failed_start_count = 0
        self._ready.append(worker)

    def _store(self, chunk: Chunk, answer: Values) -> None:
        value_count = answer.values.shape[1]
        if len(self._values) == 0:
            self._values = np.empty((len(self._candidates), value_count))
        elif value_count != self._values.shape[1]:
            raise WorkError(
                f"evaluate() must return as many values for each candidate, but it was {value_count} for {chunk} and"
                f" {self._values.shape[1]} for others. Let the count depend on the work alone."
            )
        self._values[chunk.first : chunk.end] = answer.values

    def _send_again(self, chunk: Chunk, lost: Lost) -> None:
        chunk.loss_count += 1
        if chunk.loss_count == LOSSES_MAX:
            raise WorkError(
                f"A worker must outlive an evaluation, but {chunk.loss_count} in a row were lost with {chunk}; the"
                f" last one {lost.how}. Evaluate these candidates with 'threads' to see why. Memory may be short."
            )
        _log.warning("A worker %s; with it went %s, which are evaluated again.", lost.how, chunk)
        self._chunks.return_lost(chunk)

    def _count_failed_start(self, lost: Lost) -> None:
        self._failed_start_count += 1
        if self._failed_start_count == max(self._worker_count, LOSSES_MAX):
            raise WorkError(
                f"A worker must live until its first evaluation, but {self._failed_start_count} in a row did not; the"
                f" last one {lost.how}. See what they printed."
            )


@dataclass
class Chunk:
    """Candidates `first` to `end` - 1 of a generation, and how many workers were lost with them."""

    first: int
    end: int
    loss_count: int = 0

    def __len__(self) -> int:
        return self.end - self.first

    def __str__(self) -> str:
        return f"candidate {self.first}" if len(self) == 1 else f"candidates {self.first} to {self.end - 1}"


class Chunks:
    """The candidates of a generation that no worker has yet.

    Args:
        candidate_count: Number of candidates in the generation.
        worker_count: Number of workers that share them.

    Example:
        >>> chunks = Chunks(1000, worker_count=4)
        >>> print(chunks.take(None))
        candidates 0 to 7
        >>> print(chunks.take(0.001))  # a candidate takes a millisecond
        candidates 8 to 63
    """

    def __init__(self, candidate_count: int, *, worker_count: int) -> None:
        self._candidate_count = candidate_count
        self._worker_count = worker_count
        self._next = 0
        self._lost: deque[Chunk] = deque()

    def __bool__(self) -> bool:
        return bool(self._lost) or self._next < self._candidate_count

    def take(self, candidate_s: float | None) -> Chunk:
        """Return a chunk for a worker that takes `candidate_s` [s] per candidate; None if it has done none yet."""
        if self._lost:
            return self._lost.popleft()
        first = self._next
        self._next = min(first + self._size(candidate_s), self._candidate_count)
        return Chunk(first, self._next)

    def return_lost(self, chunk: Chunk) -> None:
        """Queue a lost chunk: it is the next to be taken."""
        self._lost.append(chunk)

    def _size(self, candidate_s: float | None) -> int:
        """Return the size of the next chunk: equally fast workers finish after the same number of chunks."""
        share = -(-self._candidate_count // self._worker_count)
        if candidate_s is None:
            return min(LANES, share)
        round_count = max(1, int(share * candidate_s / CHUNK_S_MIN))
        size = -(-share // round_count)
        return min(-(-size // LANES) * LANES, share)


class RayPool:
    """The workers: actors of a cluster, one per core. Each has its own number, and answers each request once.

    Args:
        work: What evaluates candidates.
        address: Of a running cluster, "auto" for the one that this computer belongs to; None for the one that this
            program is connected to, else for one of its own on this computer, for as long as the pool is open.
    """

    def __init__(self, work: Evaluation, *, address: str | None) -> None:
        self._work = work
        self._address = address
        self._ray: Any = None
        self._owns_connection = False
        self._sigterm_before: Any = None
        self._actors: dict[int, Any] = {}
        self._pending: dict[Any, int] = {}
        self._next_number = 0
        self._stored_work: Any = None

    def open(self) -> None:
        """Connect to the cluster, put the work into its store, once for all workers, and start the workers."""
        self._ray = ray = _import_ray(loopback_only=self._address is None)
        try:
            pickled = ray.cloudpickle.dumps((self._work, _digest_of(self._work)))
        except Exception as error:
            raise ParameterError(
                f"Evaluations must be picklable to run on a cluster, but {type(self._work).__name__} is not: {error}."
                " Build what cannot be pickled in prepare()."
            ) from error
        self._connect()
        try:
            self._stored_work = ray.put(pickled)
            self.refill()
        except BaseException:
            self.close()
            raise

    def _connect(self) -> None:
        ray = self._ray
        if ray.is_initialized():
            there = ray.get_runtime_context().gcs_address
            if self._address not in (None, "auto", there):
                raise ParameterError(
                    f"A program must use one cluster at a time, but it is connected to {there} and was asked for"
                    f" {self._address}. Call ray.shutdown() before, or say 'ray' for the one that it is connected to."
                )
            return
        if threading.current_thread() is threading.main_thread():
            # ray.init() sets a handler of its own.
            self._sigterm_before = signal.getsignal(signal.SIGTERM)
        try:
            if self._address is None:
                core_count = len(os.sched_getaffinity(0))
                # Ray gives up by itself when what it starts does not answer.
                local = {"num_cpus": core_count, "include_dashboard": False, "_node_ip_address": LOOPBACK}
                ray.init("local", job_config=_job_config(ray), **local)
            else:
                _check_listens(self._address)
                _connect_to(ray, self._address)
        except (OSError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
            raise ParameterError(
                f"A Ray cluster must be reached, but at {self._address or 'this computer'} none was ({error}). Start"
                " one with `ray start --head`, and this program on one of its computers."
            ) from error
        self._owns_connection = True
        there = ray.get_runtime_context().gcs_address
        if self._address is None and not there.startswith(f"{LOOPBACK}:"):
            _log.warning(
                "Ray listens on %s: all programs that reach it can run code here. Open the executor before you import"
                " ray.",
                there,
            )

    def close(self) -> None:
        """End all actors, and the connection if there was none before."""
        while self._actors:
            self.end(next(iter(self._actors)))
        self._stored_work = None
        if self._owns_connection:
            self._owns_connection = False
            self._ray.shutdown()
            if self._sigterm_before is not None:
                signal.signal(signal.SIGTERM, self._sigterm_before)

    def refill(self) -> int:
        """Ping idle workers, start one per core of the cluster, return the number of cores.

        A worker that finds no free core waits for one: that of another program, or of a computer that joins.
        """
        busy = set(self._pending.values())
        for number, actor in self._actors.items():
            if number not in busy:
                self._pending[actor.answer.remote()] = number
        worker_count = max(1, int(self._ray.cluster_resources().get("CPU", 0)))
        actor_class = self._ray.remote(num_cpus=1, max_restarts=0, max_task_retries=0)(RayWorker)
        for _ in range(worker_count - len(self._actors)):
            actor = self._actors[self._next_number] = actor_class.remote()
            self._pending[actor.prepare.remote(self._stored_work, __version__)] = self._next_number
            self._next_number += 1
        return worker_count

    def send(self, worker: int, candidates: Floats, seeds: Integers) -> None:
        """Send a chunk to a worker that is ready."""
        self._pending[self._actors[worker].evaluate.remote(candidates, seeds)] = worker

    def wait(self) -> list[tuple[int, Answer]]:
        """Wait for answers and return them with their workers; an empty list after a while without any."""
        answered, _ = self._ray.wait(list(self._pending), num_returns=1, timeout=ANSWER_TIMEOUT_S)
        return [(self._pending[reference], self._answer(reference)) for reference in answered]

    def _answer(self, reference: Any) -> Answer:
        number = self._pending.pop(reference)
        try:
            answer: Answer = self._ray.get(reference)
        except self._ray.exceptions.RayTaskError as error:
            # `Worker` catches what the work raises. Here Ray could not build a worker, or not read what was sent.
            return Raised.of(error)
        except self._ray.exceptions.RayError as error:
            self.end(number)
            return Lost(f"went ({' '.join(str(error).split())[:200]})")
        return answer

    def end(self, worker: int) -> None:
        """End a worker, even a busy one, without an answer from it. Does nothing if it has ended already."""
        actor = self._actors.pop(worker, None)
        self._pending = {reference: number for reference, number in self._pending.items() if number != worker}
        if actor is not None:
            with suppress(self._ray.exceptions.RayError):
                self._ray.kill(actor)


class RayWorker:
    """An actor: the work in a process of the cluster, with one thread."""

    def prepare(self, pickled: bytes, version: str) -> Ready | Raised:
        """Receive the work and prepare it; refuse the work of a program with another version of KiKS."""
        if version != __version__:
            return Raised(
                f"ParameterError: All computers must have the same KiKS, but one has {__version__}, and the one"
                f" where the evolution was started {version}. Install the same on all.",
                "",
            )
        self._worker = Worker(lambda: _unpickled(pickled), threads=1)
        return self._worker.prepare()

    def answer(self) -> Ready:
        """Answer a ping."""
        return Ready()

    def evaluate(self, candidates: Floats, seeds: Integers) -> Values | Raised:
        """Evaluate a chunk: candidates [candidate, parameter] with their seeds [candidate]."""
        return self._worker.evaluate(candidates, seeds)


def _digest_of(work: Evaluation) -> dict[str, str]:
    found: dict[str, str] = getattr(work, "digest", dict)()
    return found


def _unpickled(pickled: bytes) -> Evaluation:
    """Return the work that a program has sent."""
    work, digest = pickle.loads(pickled)
    if names := differing(digest, _digest_of(work)):
        raise ParameterError(
            f"all computers must have the same modules of yours, but on one these differ: {names}. Copy them to all."
        )
    return work  # type: ignore[no-any-return]


def _job_config(ray: Any) -> Any:
    """Return settings for a connection: workers import from the current folder only where this process does.

    Ray would always put that folder before all others. It does not for jobs of its clients.
    """
    return ray.job_config.JobConfig(_client_job=os.getcwd() not in map(os.path.abspath, sys.path))


def _connect_to(ray: Any, address: str) -> None:
    """Connect, in a thread: Ray asks a port that does not answer for minutes, and has no way to stop that.

    In a thread Ray sets no signal handlers, and logs that. Processes that it starts would end with the thread, but it
    starts none to connect.

    Raises:
        TimeoutError: If it takes too long.
        Exception: What Ray raises.
    """
    done: Future[None] = Future()

    def connect() -> None:
        failure: Exception | None = None
        try:
            ray.init(address, logging_level=logging.ERROR, job_config=_job_config(ray))
        except Exception as error:
            failure = error
        if done.set_running_or_notify_cancel():
            done.set_exception(failure) if failure else done.set_result(None)
        elif failure is None:
            ray.shutdown()

    threading.Thread(target=connect, name="kiks ray", daemon=True).start()
    try:
        done.result(CONNECT_S)
    except TimeoutError:
        if not done.cancel():
            return done.result()
        raise TimeoutError(f"no answer within {CONNECT_S:g} s") from None


def _check_listens(address: str) -> None:
    """Check that a server listens at HOST:PORT; Ray would ask for minutes.

    Raises:
        OSError: If none does.
    """
    host, _, port = address.rpartition(":")
    if port.isdecimal() and "://" not in address:
        socket.create_connection((host, int(port)), timeout=ANSWER_TIMEOUT_S).close()


def _import_ray(*, loopback_only: bool) -> Any:
    """Return the module Ray. It reads environment variables when it is imported; these are set here.

    Args:
        loopback_only: Whether it will start a cluster for this computer alone. Otherwise Ray listens at the address
            that this computer has in the network, whatever address it is given, and some of its parts listen on all.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if loopback_only:
        os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
    try:
        import ray
    except ImportError as error:
        raise ParameterError(
            f"Evaluations on 'ray' need Ray, but it is not installed. {installing('ray')}, or use 'threads'."
        ) from error
    return ray
