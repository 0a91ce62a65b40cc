"""Executors: the same values wherever they run, whoever is lost on the way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.learn import works

from kiks.errors import ParameterError, WorkError
from kiks.learn.chunks import LOSSES_ALLOWED, Chunks
from kiks.learn.evaluation import Lost, Ready, Values, Worker
from kiks.learn.executors import executor_for
from kiks.learn.worker_pool import CrewExecutor

ROOT = Path(__file__).parents[2]


def expected(candidates, seeds):
    work = works.Sums()
    work.prepare()
    return work.evaluate(candidates.copy(), seeds.copy(), 1)


@given(
    count=st.integers(1, 3000),
    worker_count=st.integers(1, 40),
    paces=st.lists(st.none() | st.floats(1e-6, 10), min_size=1, max_size=5),
)
def test_chunks_hold_each_candidate_once(count, worker_count, paces):
    chunks = Chunks(count, worker_count=worker_count)
    ends = [0]
    while chunks:
        chunk = chunks.take(paces[len(ends) % len(paces)])
        assert chunk.first == ends[-1] < chunk.end
        assert len(chunk) <= -(-count // worker_count)
        ends.append(chunk.end)
    assert ends[-1] == count


def test_chunks_take_long_enough_and_all_workers_end_together():
    chunks = Chunks(1000, worker_count=8)
    # 125 ms of work for each: twice 63 ms, in eights.
    assert [len(chunks.take(0.001)) for _ in range(16)] == [64] * 15 + [40]
    assert not chunks
    # No worker stays without for the sake of eights.
    assert len(Chunks(16, worker_count=8).take(10.0)) == 2


class Ghosts:
    """A crew in this process that works at scripted speeds and dies at scripted moments."""

    def __init__(self, worker_count, durations_s=(0.01,), deaths=(), *, stillborn=False):
        self.worker_count = worker_count
        self.durations_s = durations_s
        self.deaths = deaths
        self.stillborn = stillborn
        self.workers = {}
        self.owed = []
        self.started_count = 0
        self.chunk_count = 0

    def open(self):
        pass

    def close(self):
        self.workers.clear()

    def muster(self):
        busy = {worker for worker, _ in self.owed}
        self.owed += [(worker, None) for worker in self.workers if worker not in busy]
        while len(self.workers) < self.worker_count:
            worker = Worker(works.Sums, threads=1)
            worker.prepare()
            self.workers[self.started_count] = worker
            self.owed.append((self.started_count, None))
            self.started_count += 1
        return self.worker_count

    def hand(self, worker, candidates, seeds):
        assert all(worker != other for other, _ in self.owed)
        self.owed.append((worker, (candidates, seeds)))

    def wait(self):
        # The latest first, so that chunks come back in another order.
        number, chunk = self.owed.pop()
        if chunk is None and not self.stillborn:
            return [(number, Ready())]
        self.chunk_count += 1
        if self.stillborn or self.chunk_count in self.deaths:
            del self.workers[number]
            return [(number, Lost("was ended by signal 9"))]
        answer = self.workers[number].evaluate(*chunk)
        return [(number, Values(answer.values, self.durations_s[self.chunk_count % len(self.durations_s)]))]

    def dismiss(self, worker):
        del self.workers[worker]
        self.owed = [(other, chunk) for other, chunk in self.owed if other != worker]


@settings(deadline=None)
@given(
    count=st.integers(1, 300),
    worker_count=st.integers(1, 9),
    durations_s=st.lists(st.floats(1e-5, 1), min_size=1, max_size=7),
    deaths=st.sets(st.integers(1, 40).map(lambda number: 2 * number)),
)
def test_values_are_the_same_for_any_chunks_and_losses(count, worker_count, durations_s, deaths):
    candidates, seeds = works.candidates(count), works.seeds(count)
    # No two deaths follow each other, so no chunk has bad luck three times.
    with CrewExecutor(Ghosts(worker_count, durations_s, deaths)) as executor:
        for _ in range(2):
            assert np.array_equal(executor.evaluate(candidates, seeds), expected(candidates, seeds))


def test_a_chunk_that_costs_three_workers_is_named():
    ghosts = Ghosts(1, deaths=range(1, 1 + LOSSES_ALLOWED))
    with CrewExecutor(ghosts) as executor:
        with pytest.raises(WorkError, match="3 in a row were lost with candidates 0 to 7; the last one was ended"):
            executor.evaluate(works.candidates(20), works.seeds(20))
        # Who comes after has nothing of it.
        assert len(executor.evaluate(works.candidates(20), works.seeds(20))) == 20


def test_workers_that_never_come_are_not_waited_for():
    with (
        CrewExecutor(Ghosts(5, stillborn=True)) as executor,
        pytest.raises(WorkError, match=r"must live until its first evaluation, but 5 in a row did not.*__main__"),
    ):
        executor.evaluate(works.candidates(20), works.seeds(20))


@pytest.mark.parametrize("where", ["threads", "threads:2", "processes:2"])
def test_values_are_the_same_wherever_they_run(where):
    candidates, seeds = works.candidates(300), works.seeds(300)
    kept = candidates.copy()
    with executor_for(where, works.Sums()) as executor:
        for count in (300, 1, 0, 17):
            values = executor.evaluate(candidates[:count], seeds[:count])
            assert len(values) == count
            if count:
                assert values.tobytes() == expected(candidates[:count], seeds[:count]).tobytes()
    assert np.array_equal(candidates, kept)


def test_a_worker_is_prepared_once_has_one_thread_and_is_gone_in_the_end():
    processes, prepare_counts, threads = set(), set(), set()
    with executor_for("processes:2", works.Whereabouts()) as executor:
        for _ in range(3):
            values = executor.evaluate(works.candidates(100), works.seeds(100))
            processes |= set(values[:, 0].astype(int))
            prepare_counts |= set(values[:, 1])
            threads |= set(values[:, 2])
        assert all(Path(f"/proc/{process}").exists() for process in processes)
    assert len(processes) <= 2
    assert os.getpid() not in processes
    assert prepare_counts == {1}
    assert threads == {1}
    assert not any(Path(f"/proc/{process}").exists() for process in processes)


def test_threads_are_left_to_the_work():
    with executor_for("threads:3", works.Whereabouts()) as executor:
        (value,) = executor.evaluate(works.candidates(1), works.seeds(1))
    assert list(value) == [os.getpid(), 1, 3]


def test_who_is_done_gets_the_next_chunk(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    candidates, seeds = works.candidates(100, marked=0), works.seeds(100)
    with executor_for("processes:2", works.Waiting(tmp_path / "pipe", last=candidates[-1, 0])) as executor:
        assert np.array_equal(executor.evaluate(candidates, seeds), expected(candidates, seeds))


def test_a_lost_worker_costs_its_chunk_only(tmp_path, caplog):
    candidates, seeds = works.candidates(100, marked=50), works.seeds(100)
    with executor_for("processes:2", works.Deadly(tmp_path / "died")) as executor:
        assert np.array_equal(executor.evaluate(candidates, seeds), expected(candidates, seeds))
    assert (tmp_path / "died").exists()
    (message,) = caplog.messages
    assert message.startswith("A worker was ended by signal 9; with it went candidate")


def test_a_candidate_that_always_kills_is_named():
    with (
        executor_for("processes:1", works.Deadly()) as executor,
        pytest.raises(WorkError, match="3 in a row were lost with candidates 0 to 4; the last one was ended by signal"),
    ):
        executor.evaluate(works.candidates(5, marked=3), works.seeds(5))


def test_a_worker_that_dies_in_prepare_is_an_error():
    with (
        executor_for("processes:1", works.Stillborn()) as executor,
        pytest.raises(WorkError, match="3 in a row did not; the last one was ended by signal 9"),
    ):
        executor.evaluate(works.candidates(5), works.seeds(5))


@pytest.mark.parametrize("where", ["threads", "processes:1"])
def test_what_a_work_raises_is_told(where):
    with executor_for(where, works.Failing()) as executor:
        with pytest.raises(
            WorkError, match=r"evaluate\(\) for candidates 0 to 4 raised ZeroDivisionError: a"
        ) as caught:
            executor.evaluate(works.candidates(5, marked=3), works.seeds(5))
        assert 'raise ZeroDivisionError("a wheel came off")' in caught.value.__notes__[0]
        # It is as good as before.
        assert len(executor.evaluate(works.candidates(5), works.seeds(5))) == 5


@pytest.mark.parametrize("where", ["threads", "processes:1"])
def test_what_prepare_raises_is_told(where):
    with (
        pytest.raises(WorkError, match=r"prepare\(\) raised FileNotFoundError: no arena"),
        executor_for(where, works.Unprepared()) as executor,
    ):
        executor.evaluate(works.candidates(5), works.seeds(5))


def test_values_must_have_their_shape():
    with (
        executor_for("threads", works.Shapeless()) as executor,
        pytest.raises(WorkError, match=r"for 5 candidates, but it was shape \(5,\)"),
    ):
        executor.evaluate(works.candidates(5), works.seeds(5))


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("thread", "Did you mean 'threads'"),
        ("processes:", "must run on 'threads"),
        ("processes:0", "whole number from 1"),
        ("threads:many", "it was 'many'"),
        ("", "it was ''"),
    ],
)
def test_places_that_are_none(where, words):
    with pytest.raises(ParameterError, match=words):
        executor_for(where, works.Sums())


def test_arguments_that_do_not_fit():
    executor = executor_for("threads", works.Sums())
    with pytest.raises(WorkError, match="must be open"):
        executor.evaluate(works.candidates(5), works.seeds(5))
    with executor:
        with pytest.raises(ParameterError, match=r"it was float64 of shape \(3,"):
            executor.evaluate(works.candidates(5)[0], works.seeds(5))
        with pytest.raises(ParameterError, match=r"one seed for each of 5 candidates, but it was int64 of shape \(4,"):
            executor.evaluate(works.candidates(5), works.seeds(4))
        with pytest.raises(ParameterError, match="but it was float64"):
            executor.evaluate(works.candidates(5), np.ones(5))


def test_work_that_cannot_be_pickled_is_turned_away():
    class Local(works.Sums):
        pass

    with pytest.raises(ParameterError, match="must be picklable to run in processes, but Local is not"):
        executor_for("processes:1", Local()).__enter__()


def test_without_ray_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ParameterError, match=r"pip install '\.\[ray\]'"):
        executor_for("ray", works.Sums()).__enter__()


def program(tmp_path, work, rest):
    """Start a program with two workers, in a process group of its own."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "program.py").write_text(
        "import os, pathlib, signal, sys\n"
        f"sys.path.insert(0, {str(ROOT)!r})\n"
        "from kiks.learn.executors import executor_for\n"
        "from tests.learn import works\n"
        "if __name__ == '__main__':\n"
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"    with executor_for('processes:2', works.{work}(pathlib.Path({str(tmp_path / 'pipe')!r}))) as executor:\n"
        f"        {rest}\n"
    )
    return subprocess.Popen(
        [sys.executable, str(tmp_path / "program.py")], stderr=subprocess.PIPE, text=True, start_new_session=True
    )


def test_ctrl_c_ends_all_workers(tmp_path):
    running = program(tmp_path, "Stuck", "executor.evaluate(works.candidates(100, marked=0), works.seeds(100))")
    with (tmp_path / "pipe").open() as pipe:
        assert pipe.readline() == "here\n"
        os.killpg(running.pid, signal.SIGINT)
        # The worker's end of the pipe is closed when it is gone.
        assert pipe.read() == ""
    _, errors = running.communicate(timeout=60)
    assert running.returncode == -signal.SIGINT
    assert errors.count("Traceback") == 1, errors


def test_workers_end_with_a_program_that_is_killed(tmp_path):
    rest = "executor.evaluate(works.candidates(1), works.seeds(1)); os.kill(os.getpid(), signal.SIGKILL)"
    running = program(tmp_path, "Lasting", rest)
    assert (tmp_path / "pipe").read_text() == ""
    running.communicate(timeout=60)
    assert running.returncode == -signal.SIGKILL
