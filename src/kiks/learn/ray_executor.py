"""An executor for a Ray cluster, on this computer or on many. Ray itself repeats the work of lost workers.

A Ray cluster runs any code for any client that reaches it. So a cluster that is started here listens on the loopback
address alone, without Ray's dashboard; a cluster of several computers belongs on a private network
(the page "Evaluations on many cores and many computers").
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from typing import Any

from kiks.errors import ParameterError, library
from kiks.ports.resources import processor_count

LOOPBACK = "127.0.0.1"

ANSWER_TIMEOUT_S = 10.0
"""Timeout for the first answer of an address [s]."""


class RayExecutor(Executor):
    """Runs functions on a Ray cluster, one per core.

    Args:
        address: That of a running cluster, "auto" for the one that this computer belongs to. None for the one that this
            program is connected to, else for one of its own on this computer, for as long as the executor is open.
    """

    def __init__(self, address: str | None = None) -> None:
        self._ray = ray = _import_ray(loopback_only=address is None)
        self._owns_connection = not ray.is_initialized()
        self._stored: dict[Any, Any] = {}
        if self._owns_connection:
            _connect(ray, address)
        elif address not in (None, "auto", there := ray.get_runtime_context().gcs_address):
            raise ParameterError(
                f"A program must use one cluster at a time, but it is connected to {there} and was asked for {address}."
                " Call ray.shutdown() before, or give no address for the one that it is connected to."
            )

    def submit(self, function: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        """Run a function on the cluster. Arguments that can be keys, such as a task, are sent once."""
        reference = self._ray.remote(function).remote(*map(self._sent, given), **named)
        future: Future[Any] = Future()

        def finish(done: Future[Any]) -> None:
            if future.set_running_or_notify_cancel():
                error = done.exception()
                future.set_exception(error) if error else future.set_result(done.result())

        def end(_: Future[Any]) -> None:
            if future.cancelled():
                with suppress(Exception):  # the cluster may be gone
                    self._ray.cancel(reference, force=True)

        future.add_done_callback(end)
        reference.future().add_done_callback(finish)
        return future

    def _sent(self, given: Any) -> Any:
        """Return a reference to an argument in the cluster's store, or the argument itself if it cannot be a key."""
        if getattr(type(given), "__hash__", None) is None:
            return given
        if given not in self._stored:
            self._stored[given] = self._ray.put(given)
        return self._stored[given]

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the connection if there was none before."""
        self._stored.clear()
        if self._owns_connection:
            self._owns_connection = False
            self._ray.shutdown()


def _connect(ray: Any, address: str | None) -> None:
    """Connect to a cluster, or start one for this computer."""
    # Ray would have workers import from the current folder before all others. It does not for jobs of its clients.
    job = ray.job_config.JobConfig(_client_job=os.getcwd() not in map(os.path.abspath, sys.path))
    is_main = threading.current_thread() is threading.main_thread()
    handler = signal.getsignal(signal.SIGTERM)
    try:
        if address is None:
            local = {"num_cpus": processor_count(), "include_dashboard": False, "_node_ip_address": LOOPBACK}
            ray.init("local", job_config=job, log_to_driver=False, **local)
        else:
            host, _, port = address.rpartition(":")
            if port.isdecimal() and "://" not in address:  # Ray would ask a port without a server for minutes
                socket.create_connection((host, int(port)), timeout=ANSWER_TIMEOUT_S).close()
            ray.init(address, job_config=job, log_to_driver=False)
    except (OSError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
        raise ParameterError(
            f"A Ray cluster must be reached, but at {address or 'this computer'} none was ({error}). Start one with"
            " `ray start --head`, and this program on one of its computers."
        ) from error
    if is_main:
        signal.signal(signal.SIGTERM, handler)  # ray.init() sets one of its own


def _import_ray(*, loopback_only: bool) -> Any:
    """Return the module Ray. It reads environment variables when it is imported; these are set here.

    Args:
        loopback_only: Whether it will start a cluster for this computer alone. Otherwise Ray listens at the address
            that this computer has in the network, whatever address it is given, and some of its parts listen on all.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if loopback_only:
        os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
    return library("ray", "ray")
