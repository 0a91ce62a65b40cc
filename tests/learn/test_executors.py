"""The same values on any executor, with or without lost workers."""

import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import at_length
from tests.learn.small import refused, small

from kiks.errors import ParameterError, WorkError
from kiks.learn.evaluation import evaluate
from kiks.learn.ray_executor import RayExecutor

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


class Sums:
    """Values that depend on all bits of parameters and seed. At a marked candidate it does what `mark` says."""

    def __init__(self, mark: str = "", memory: Path | None = None) -> None:
        self.mark, self.memory = mark, memory

    def digest(self) -> dict[str, str]:
        return {}

    def evaluate(self, candidates: Any, seeds: Any, threads: int | None = None) -> Any:
        if 0.125 in candidates[:, 0] and not (self.memory and self.memory.is_file()):
            if self.mark == "raise":
                raise ZeroDivisionError("a wheel came off")
            if self.mark == "refuse":
                raise ParameterError("measures must be finite.")
            if self.mark == "wait":
                assert self.memory
                with self.memory.open("w") as pipe:
                    pipe.write("here\n")
                    pipe.flush()
                    while True:
                        signal.pause()
            if self.mark == "die":
                if self.memory:
                    self.memory.touch()
                os.kill(os.getpid(), signal.SIGKILL)
        return np.stack([candidates[:, 0] / 3 + candidates[:, 1] * candidates[:, 2], candidates[:, 1] / seeds], axis=1)


def drawn(count: int, marked: bool = False) -> tuple[Any, Any]:
    candidates = np.random.default_rng(count).standard_normal((count, 3))
    candidates[count // 2 :, 0] = 0.125 if marked else candidates[count // 2 :, 0]
    return candidates, np.arange(count, dtype=np.int64) * 7 + 1


def check_values(executor: Any) -> None:
    for count in (300, 1, 0, 17, 3000):
        candidates, seeds = drawn(count)
        assert evaluate(Sums(), candidates, seeds, executor).tobytes() == Sums().evaluate(candidates, seeds).tobytes()


def test_values_are_the_same_on_threads() -> None:
    check_values(None)
    with ThreadPoolExecutor(3) as threads:
        check_values(threads)


def test_values_are_the_same_on_processes_and_a_lost_one_whose_work_is_not_repeated_is_an_error() -> None:
    with ProcessPoolExecutor(2, get_context("spawn")) as processes:
        check_values(processes)
        task, candidates, seeds = small(), np.ones((9, 18)), np.arange(9)
        expected = task.evaluate(candidates, seeds, 1)
        for _ in range(2):
            assert evaluate(task, candidates, seeds, processes).tobytes() == expected.tobytes()
        with pytest.raises(WorkError, match=r"Cannot evaluate candidates \d to \d: BrokenProcessPool: .* to see why"):
            evaluate(Sums("die"), *drawn(9, marked=True), processes)


def test_what_a_task_raises_is_an_error_that_names_its_candidates() -> None:
    with ThreadPoolExecutor(2) as threads:
        with pytest.raises(WorkError, match=r"Cannot evaluate candidates 4 to 7: ZeroDivisionError: a wheel came off"):
            evaluate(Sums("raise"), *drawn(9, marked=True), threads)
        with pytest.raises(WorkError, match="Cannot evaluate candidates 0 to 8: ZeroDivisionError"):
            evaluate(Sums("raise"), *drawn(9, marked=True))
        refused(r"^measures must be finite\.$", evaluate, Sums("refuse"), *drawn(9, marked=True), threads)


def test_wrong_arguments_and_a_missing_ray_are_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    candidates, seeds = drawn(5)
    for given, message in (
        ((candidates[0], seeds), r"candidates must be finite numbers \[any, any\], but it had the shape \[3\]"),
        ((candidates, seeds[:4]), r"seeds must be whole numbers from 0 \[5\], but it had the shape \[4\]"),
        ((candidates, np.full(5, 0.5)), r"seeds must be whole numbers from 0 \[5\], but it was 0\.5"),
        ((candidates, seeds, "threads"), r"executor must have submit\(\) .* but it was 'threads'"),
    ):
        refused(message, evaluate, Sums(), *given)
    monkeypatch.setitem(sys.modules, "ray", None)
    refused(r"pip install 'kiks\[ray\]'", RayExecutor)


@pytest.fixture(scope="module")
def ray():
    with pytest.MonkeyPatch.context() as patch:
        # This token is for the tests alone; without it, Ray would write one into the home folder.
        patch.setenv("RAY_AUTH_MODE", "token")
        patch.setenv("RAY_AUTH_TOKEN", os.urandom(32).hex())
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        # Ray listens on the loopback address alone only with this variable.
        patch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
        patch.setenv("PYTHONPATH", str(ROOT))
        yield pytest.importorskip("ray", reason="Ray is not installed: pip install 'kiks[ray]'")


def test_an_address_without_a_server_is_an_error(ray: Any) -> None:
    refused(r"must be reached, but at 127\.0\.0\.1:1 none was.*ray start --head", RayExecutor, "127.0.0.1:1")


@at_length
def test_ray_repeats_the_work_of_lost_workers_on_loopback_alone(ray: Any, tmp_path: Path) -> None:
    handler = signal.getsignal(signal.SIGTERM)
    with RayExecutor() as executor:
        assert signal.getsignal(signal.SIGTERM) is handler
        assert ray.get_runtime_context().gcs_address.startswith("127.0.0.1:")
        check_values(executor)
        given = drawn(9, marked=True)
        values = evaluate(Sums("die", tmp_path / "died"), *given, executor)
        assert (tmp_path / "died").exists()
        assert values.tobytes() == Sums().evaluate(*given).tobytes()
        with pytest.raises(WorkError, match=r"Cannot evaluate candidates \d to \d: WorkerCrashedError"):
            evaluate(Sums("die"), *given, executor)
        with pytest.raises(WorkError, match=r"candidates 4 to 7: ZeroDivisionError: a wheel came off\. Eval"):
            evaluate(Sums("raise"), *given, executor)
        refused(r"^measures must be finite\.$", evaluate, Sums("refuse"), *given, executor)
        broken: Any = Sums()
        broken.lock = threading.Lock()
        with pytest.raises(WorkError, match=r"TypeError: .*lock"):
            evaluate(broken, *given, executor)
        with RayExecutor("auto") as second:  # the connection of the program stays open
            check_values(second)
        refused(r"must use one cluster at a time.*asked for 127\.0\.0\.1:1\.", RayExecutor, "127.0.0.1:1")
        assert ray.is_initialized()
    assert not ray.is_initialized()


@at_length
def test_ctrl_c_ends_all_workers(ray: Any, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "program.py").write_text(
        "import pathlib, signal, sys\n"
        "from kiks.learn.evaluation import evaluate\nfrom kiks.learn.ray_executor import RayExecutor\n"
        "from tests.learn.test_executors import Sums, drawn\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "with RayExecutor() as executor:\n"
        "    evaluate(Sums('wait', pathlib.Path(sys.argv[1])), *drawn(2, marked=True), executor)\n"
    )
    with subprocess.Popen(
        [sys.executable, str(tmp_path / "program.py"), str(tmp_path / "pipe")],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as running:
        with (tmp_path / "pipe").open() as pipe:
            assert pipe.readline() == "here\n"
            os.killpg(running.pid, signal.SIGINT)
            # The pipe closes when the worker has ended.
            assert pipe.read() == ""
        _, errors = running.communicate(timeout=60)
    assert running.returncode == -signal.SIGINT
    assert "KeyboardInterrupt" in errors
