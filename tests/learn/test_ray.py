"""A Ray cluster of two nodes on this computer: the same values, even if workers or nodes are lost."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from tests.at_length import at_length
from tests.guard import GUARD_S
from tests.learn import works
from tests.learn.test_executors import expected

from kiks.errors import ParameterError, WorkError
from kiks.learn import ray_executor
from kiks.learn.executors import executor_for

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def ray():
    with pytest.MonkeyPatch.context() as patch:
        # This token is for the tests alone; without it, Ray would write one into the home folder.
        patch.setenv("RAY_AUTH_MODE", "token")
        patch.setenv("RAY_AUTH_TOKEN", os.urandom(32).hex())
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        # Ray listens on the loopback address alone only with this variable.
        patch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
        yield pytest.importorskip("ray", reason="Ray is not installed: pip install '.[ray]'")


@pytest.fixture(scope="module")
def cluster(ray):
    from ray.cluster_utils import Cluster

    node = {"num_cpus": 1, "node_ip_address": "127.0.0.1", "object_store_memory": 80 * 2**20}
    cluster = Cluster(initialize_head=True, head_node_args={**node, "include_dashboard": False})
    cluster.second = cluster.add_node(**node)
    yield cluster
    cluster.shutdown()


@at_length
def test_values_are_the_same_and_only_the_chunk_of_a_lost_worker_is_repeated(cluster, ray, tmp_path):
    candidates, seeds = works.candidates(100, marked=50), works.seeds(100)
    with executor_for(f"ray:{cluster.address}", works.Deadly(tmp_path / "died")) as executor:
        for count in (100, 0, 1, 100):
            values = executor.evaluate(candidates[:count], seeds[:count])
            assert len(values) == count
            if count:
                assert values.tobytes() == expected(candidates[:count], seeds[:count]).tobytes()
    assert (tmp_path / "died").exists()
    assert not ray.is_initialized()


@at_length
def test_a_connection_of_the_program_is_used_and_stays_open(cluster, ray):
    candidates, seeds = works.candidates(40), works.seeds(40)
    ray.init(cluster.address)
    try:
        with executor_for("ray", works.WorkerFacts()) as executor:
            values = np.concatenate([executor.evaluate(candidates, seeds) for _ in range(3)])
        assert set(values[:, 0]).isdisjoint({os.getpid()})
        assert len(set(values[:, 0])) <= 2
        assert (values[:, 1:] == 1).all()
        with executor_for("ray:auto", works.Failing()) as executor:
            with pytest.raises(WorkError, match="raised ZeroDivisionError: a wheel came off"):
                executor.evaluate(works.candidates(5, marked=3), works.seeds(5))
            assert len(executor.evaluate(candidates, seeds)) == 40
        with (
            pytest.raises(WorkError, match=r"prepare\(\) raised FileNotFoundError: no arena"),
            executor_for("ray", works.Unprepared()) as executor,
        ):
            executor.evaluate(works.candidates(5), works.seeds(5))
        with pytest.raises(ParameterError, match=r"must use one cluster at a time.*asked for 127\.0\.0\.1:1\."):
            executor_for("ray:127.0.0.1:1", works.Sums()).__enter__()
        assert ray.is_initialized()
    finally:
        ray.shutdown()


@at_length
def test_only_the_chunks_of_a_lost_node_are_repeated(cluster, tmp_path):
    candidates, seeds = works.candidates(100), works.seeds(100)
    # Each node gets one of the first two chunks: the chunk that starts first waits until the other is stuck.
    candidates[:16, 0] = works.MARK
    os.mkfifo(tmp_path / "pipe")
    os.mkfifo(tmp_path / "gate")
    gate = os.open(tmp_path / "gate", os.O_RDWR)

    def remove_node():
        with (tmp_path / "pipe").open() as pipe:
            assert pipe.readline() == "here\n"
        cluster.remove_node(cluster.second, allow_graceful=False)
        os.write(gate, bytes(100))

    remover = threading.Thread(target=remove_node, daemon=True)
    remover.start()
    work = works.StuckOnANode(tmp_path / "pipe", tmp_path / "gate", cluster.second.node_id)
    with executor_for(f"ray:{cluster.address}", work) as executor:
        for _ in range(2):
            assert np.array_equal(executor.evaluate(candidates, seeds), expected(candidates, seeds))
    remover.join()
    os.close(gate)


@at_length
def test_a_local_cluster_listens_on_loopback_alone(ray, caplog):
    candidates, seeds = works.candidates(40), works.seeds(40)
    with executor_for("ray", works.Sums()) as executor:
        assert ray.get_runtime_context().gcs_address.startswith("127.0.0.1:")
        assert np.array_equal(executor.evaluate(candidates, seeds), expected(candidates, seeds))
    assert not ray.is_initialized()
    assert not [record for record in caplog.records if record.name.startswith("kiks")]


def test_connecting_has_a_timeout(ray, monkeypatch):
    may_connect, is_shut_down = threading.Event(), threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        monkeypatch.setattr(ray, "init", lambda *args, **options: may_connect.wait(GUARD_S))
        monkeypatch.setattr(ray, "shutdown", is_shut_down.set)
        monkeypatch.setattr(ray_executor, "CONNECT_S", 0.01)
        with pytest.raises(ParameterError, match=r"was \(no answer within 0\.01 s\)\. Start one with"):
            executor_for(f"ray:{address}", works.Sums()).__enter__()
    assert not is_shut_down.is_set()
    # A connection that comes too late is closed.
    may_connect.set()
    assert is_shut_down.wait(GUARD_S)


def test_an_address_without_a_server_is_an_error(ray):
    with pytest.raises(ParameterError, match=r"must be reached, but at 127\.0\.0\.1:1 none was.*ray start --head"):
        executor_for("ray:127.0.0.1:1", works.Sums()).__enter__()


@at_length
def test_the_error_names_candidates_that_kill_their_workers(cluster):
    with (
        # The chunk begins at 3 if both nodes of the cluster are still there.
        executor_for(f"ray:{cluster.address}", works.Deadly()) as executor,
        pytest.raises(WorkError, match=r"3 in a row were lost with candidates [03] to 4; the last one went"),
    ):
        executor.evaluate(works.candidates(5, marked=3), works.seeds(5))


@at_length
def test_workers_that_die_in_prepare_are_an_error(cluster):
    with (
        executor_for(f"ray:{cluster.address}", works.DeadAtStart()) as executor,
        pytest.raises(WorkError, match="3 in a row did not; the last one went"),
    ):
        executor.evaluate(works.candidates(5), works.seeds(5))


def test_work_that_cannot_be_pickled_is_an_error(ray):
    work = works.Sums()
    work.lock = threading.Lock()
    with pytest.raises(ParameterError, match="must be picklable to run on a cluster, but Sums is not"):
        executor_for("ray", work).__enter__()


def start_program(tmp_path: Path, work: str, rest: str) -> subprocess.Popen[str]:
    """Start a program that evaluates on its own cluster, in its own process group."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "program.py").write_text(
        "import os, pathlib, signal, sys\n"
        f"sys.path.insert(0, {str(ROOT)!r})\n"
        "from kiks.learn.executors import executor_for\n"
        "from tests.learn import works\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"with executor_for('ray', works.{work}(pathlib.Path({str(tmp_path / 'pipe')!r}))) as executor:\n"
        f"    {rest}\n"
    )
    return subprocess.Popen(
        [sys.executable, str(tmp_path / "program.py")],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


@at_length
def test_ctrl_c_ends_all_workers(ray, tmp_path):
    running = start_program(tmp_path, "Stuck", "executor.evaluate(works.candidates(100, marked=0), works.seeds(100))")
    with (tmp_path / "pipe").open() as pipe:
        assert pipe.readline() == "here\n"
        os.killpg(running.pid, signal.SIGINT)
        # The pipe closes when the worker has ended.
        assert pipe.read() == ""
    _, errors = running.communicate(timeout=60)
    assert running.returncode == -signal.SIGINT
    assert "KeyboardInterrupt" in errors


@at_length
def test_workers_end_with_a_program_that_is_killed(ray, tmp_path):
    rest = "executor.evaluate(works.candidates(1), works.seeds(1)); os.kill(os.getpid(), signal.SIGKILL)"
    running = start_program(tmp_path, "OpenPipe", rest)
    assert (tmp_path / "pipe").read_text() == ""
    running.communicate(timeout=60)
    assert running.returncode == -signal.SIGKILL
