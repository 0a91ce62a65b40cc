"""Workers that are actors of a Ray cluster, one a core, on this computer or on many.

A Ray cluster runs any code for any client that reaches it. So a cluster that is started here listens on the loopback
address alone, without Ray's dashboard; a cluster of several computers belongs on a private network
(docs/distributed.md).

Ray could restart lost actors and repeat lost calls by itself, but then no error would show that a chunk kills one
worker after the other. So actors are not restarted, and `PoolExecutor` sends lost chunks again.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import threading
from concurrent.futures import Future
from contextlib import suppress
from typing import Any

from kiks.errors import ParameterError, installing
from kiks.learn.evaluation import Answer, Evaluation, Floats, Integers, Lost, Raised, Ready, Values, Worker
from kiks.version import __version__

_log = logging.getLogger("kiks.learn")

LOOPBACK = "127.0.0.1"

ANSWER_TIMEOUT_S = 10.0
"""Time without an answer after which the pool looks for new workers [s]."""

CONNECT_S = 60.0
"""Timeout for connecting to a cluster [s]; it takes a second or so, and more on a busy computer."""


class RayPool:
    """A pool of actors (`WorkerPool`).

    Args:
        work: What evaluates candidates.
        address: Of a running cluster, "auto" for the one that this computer belongs to; None for the one that this
            program is connected to, else for one of its own on this computer, for as long as the pool is open.
    """

    def __init__(self, work: Evaluation, *, address: str | None) -> None:
        self._work = work
        self._address = address
        self._ray: Any = None
        self._has_connected = False
        self._sigterm_before: Any = None
        self._actors: dict[int, Any] = {}
        self._owed: dict[Any, int] = {}
        self._next_number = 0
        self._shipped: Any = None

    def open(self) -> None:
        """Connect to the cluster, put the work into its store, once for all workers, and start the workers.

        Raises:
            ParameterError: If Ray is not installed, no cluster is reached, or the work cannot be pickled.
        """
        self._ray = ray = _import_ray(loopback_only=self._address is None)
        try:
            pickled = ray.cloudpickle.dumps(self._work)
        except Exception as error:
            raise ParameterError(
                f"Evaluations must be picklable to run on a cluster, but {type(self._work).__name__} is not: {error}."
                " Build what cannot be pickled in prepare()."
            ) from error
        self._connect()
        try:
            self._shipped = ray.put(pickled)
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
                ray.init("local", num_cpus=core_count, include_dashboard=False, _node_ip_address=LOOPBACK)
            else:
                _check_listens(self._address)
                _connect_to(ray, self._address)
        except (OSError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
            raise ParameterError(
                f"A Ray cluster must be reached, but at {self._address or 'this computer'} none was ({error}). Start"
                " one with `ray start --head`, and this program on one of its computers."
            ) from error
        self._has_connected = True
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
        self._shipped = None
        if self._has_connected:
            self._has_connected = False
            self._ray.shutdown()
            if self._sigterm_before is not None:
                signal.signal(signal.SIGTERM, self._sigterm_before)

    def refill(self) -> int:
        """Ping idle workers, start one per core of the cluster, return the number of cores.

        A worker that finds no free core waits for one: that of another program, or of a computer that joins.
        """
        busy = set(self._owed.values())
        for number, actor in self._actors.items():
            if number not in busy:
                self._owed[actor.answer.remote()] = number
        worker_count = max(1, int(self._ray.cluster_resources().get("CPU", 0)))
        actor_class = self._ray.remote(num_cpus=1, max_restarts=0, max_task_retries=0)(RayWorker)
        for _ in range(worker_count - len(self._actors)):
            actor = self._actors[self._next_number] = actor_class.remote()
            self._owed[actor.prepare.remote(self._shipped, __version__)] = self._next_number
            self._next_number += 1
        return worker_count

    def send(self, worker: int, candidates: Floats, seeds: Integers) -> None:
        """Send a chunk to a worker that is ready."""
        self._owed[self._actors[worker].evaluate.remote(candidates, seeds)] = worker

    def wait(self) -> list[tuple[int, Answer]]:
        """Wait for answers and return them with their workers; an empty list after a while without any."""
        answered, _ = self._ray.wait(list(self._owed), num_returns=1, timeout=ANSWER_TIMEOUT_S)
        return [(self._owed[reference], self._answer(reference)) for reference in answered]

    def _answer(self, reference: Any) -> Answer:
        number = self._owed.pop(reference)
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
        """End a worker, even a busy one."""
        actor = self._actors.pop(worker, None)
        self._owed = {reference: number for reference, number in self._owed.items() if number != worker}
        if actor is not None:
            with suppress(self._ray.exceptions.RayError):
                self._ray.kill(actor)


class RayWorker:
    """An actor: the work in a process of the cluster, with one thread."""

    def prepare(self, pickled: bytes, version: str) -> Ready | Raised:
        """Receive the work and prepare it; refuse the work of a program with another version of KiKS."""
        import pickle

        if version != __version__:
            return Raised(
                f"ParameterError: All computers must have the same KiKS, but one has {__version__}, and the one"
                f" where the evolution was started {version}. Install the same on all.",
                "",
            )
        self._worker = Worker(lambda: pickle.loads(pickled), threads=1)
        return self._worker.prepare()

    def answer(self) -> Ready:
        """Answer a ping."""
        return Ready()

    def evaluate(self, candidates: Floats, seeds: Integers) -> Values | Raised:
        """Evaluate a chunk: candidates [candidate, parameter] with their seeds [candidate]."""
        return self._worker.evaluate(candidates, seeds)


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
            ray.init(address, logging_level=logging.ERROR)
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

    Raises:
        ParameterError: If it is not installed.
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
