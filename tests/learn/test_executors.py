"""Executors: the same values wherever they run, with or without lost workers. Ray: test_ray.py."""

from __future__ import annotations

import os
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.learn import works

from kiks.errors import ParameterError, WorkError
from kiks.learn.evaluation import Lost, Ready, Values, Worker
from kiks.learn.executors import executor_for
from kiks.learn.ray_executor import LOSSES_MAX, Chunks, RayExecutor


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


def test_chunks_are_long_enough_and_equal_workers_finish_together():
    chunks = Chunks(1000, worker_count=8)
    # Each worker has 125 ms of work: two chunks of 63 ms, rounded up to a multiple of eight candidates.
    assert [len(chunks.take(0.001)) for _ in range(16)] == [64] * 15 + [40]
    assert not chunks
    # Every worker gets a chunk, even if it holds fewer than eight candidates.
    assert len(Chunks(16, worker_count=8).take(10.0)) == 2


class FakePool:
    """Workers in this process with scripted speeds, which are lost at scripted moments."""

    def __init__(self, worker_count, durations_s=(0.01,), deaths=(), *, dies_at_start=False):
        self.worker_count = worker_count
        self.durations_s = durations_s
        self.deaths = deaths
        self.dies_at_start = dies_at_start
        self.workers = {}
        self.pending = []
        self.started_count = 0
        self.chunk_count = 0

    def open(self):
        pass

    def close(self):
        self.workers.clear()

    def refill(self):
        busy = {worker for worker, _ in self.pending}
        self.pending += [(worker, None) for worker in self.workers if worker not in busy]
        while len(self.workers) < self.worker_count:
            worker = Worker(works.Sums, threads=1)
            worker.prepare()
            self.workers[self.started_count] = worker
            self.pending.append((self.started_count, None))
            self.started_count += 1
        return self.worker_count

    def send(self, worker, candidates, seeds):
        assert all(worker != other for other, _ in self.pending)
        self.pending.append((worker, (candidates, seeds)))

    def wait(self):
        # Answers arrive latest first, not in the order of the chunks.
        number, chunk = self.pending.pop()
        if chunk is None and not self.dies_at_start:
            return [(number, Ready())]
        self.chunk_count += 1
        if self.dies_at_start or self.chunk_count in self.deaths:
            del self.workers[number]
            return [(number, Lost("was ended by signal 9"))]
        answer = self.workers[number].evaluate(*chunk)
        return [(number, Values(answer.values, self.durations_s[self.chunk_count % len(self.durations_s)]))]

    def end(self, worker):
        del self.workers[worker]
        self.pending = [(other, chunk) for other, chunk in self.pending if other != worker]


@given(
    count=st.integers(1, 300),
    worker_count=st.integers(1, 9),
    durations_s=st.lists(st.floats(1e-5, 1), min_size=1, max_size=7),
    deaths=st.sets(st.integers(1, 40).map(lambda number: 2 * number)),
)
def test_values_are_the_same_for_any_chunks_and_losses(count, worker_count, durations_s, deaths):
    candidates, seeds = works.candidates(count), works.seeds(count)
    # No two losses are consecutive, so no chunk loses three workers.
    with RayExecutor(FakePool(worker_count, durations_s, deaths)) as executor:
        for _ in range(2):
            assert np.array_equal(executor.evaluate(candidates, seeds), expected(candidates, seeds))


def test_the_error_names_a_chunk_that_loses_three_workers():
    pool = FakePool(1, deaths=range(1, 1 + LOSSES_MAX))
    with RayExecutor(pool) as executor:
        with pytest.raises(WorkError, match="3 in a row were lost with candidates 0 to 7; the last one was ended"):
            executor.evaluate(works.candidates(20), works.seeds(20))
        # The next evaluation works.
        assert len(executor.evaluate(works.candidates(20), works.seeds(20))) == 20


def test_workers_that_end_before_their_first_evaluation_are_an_error():
    with (
        RayExecutor(FakePool(5, dies_at_start=True)) as executor,
        pytest.raises(WorkError, match="must live until its first evaluation, but 5 in a row did not"),
    ):
        executor.evaluate(works.candidates(20), works.seeds(20))


@pytest.mark.parametrize("where", ["threads", "threads:2"])
def test_values_are_the_same_on_any_number_of_threads(where):
    candidates, seeds = works.candidates(300), works.seeds(300)
    before = candidates.copy()
    with executor_for(where, works.Sums()) as executor:
        for count in (300, 1, 0, 17):
            values = executor.evaluate(candidates[:count], seeds[:count])
            assert len(values) == count
            if count:
                assert values.tobytes() == expected(candidates[:count], seeds[:count]).tobytes()
    assert np.array_equal(candidates, before)


def test_the_work_gets_the_number_of_threads():
    with executor_for("threads:3", works.WorkerFacts()) as executor:
        (value,) = executor.evaluate(works.candidates(1), works.seeds(1))
    assert list(value) == [os.getpid(), 1, 3]


def test_an_exception_in_evaluate_is_an_error_with_its_traceback():
    with executor_for("threads", works.Failing()) as executor:
        with pytest.raises(
            WorkError, match=r"evaluate\(\) for candidates 0 to 4 raised ZeroDivisionError: a"
        ) as caught:
            executor.evaluate(works.candidates(5, marked=3), works.seeds(5))
        assert 'raise ZeroDivisionError("a wheel came off")' in caught.value.__notes__[0]
        # The executor still works.
        assert len(executor.evaluate(works.candidates(5), works.seeds(5))) == 5


def test_an_exception_in_prepare_is_an_error():
    with (
        pytest.raises(WorkError, match=r"prepare\(\) raised FileNotFoundError: no arena"),
        executor_for("threads", works.Unprepared()) as executor,
    ):
        executor.evaluate(works.candidates(5), works.seeds(5))


def test_values_must_have_their_shape():
    with (
        executor_for("threads", works.WrongShape()) as executor,
        pytest.raises(WorkError, match=r"for 5 candidates, but it was shape \(5,\)"),
    ):
        executor.evaluate(works.candidates(5), works.seeds(5))


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("thread", "Did you mean 'threads'"),
        ("processes", r"must run on 'threads\[:COUNT\]', 'ray' or 'ray:ADDRESS', but it was 'processes'"),
        ("threads:", "must run on 'threads"),
        ("threads:0", "whole number from 1"),
        ("threads:many", "it was 'many'"),
        ("", "it was ''"),
    ],
)
def test_unknown_executors_are_errors(where, message):
    with pytest.raises(ParameterError, match=message):
        executor_for(where, works.Sums())


def test_wrong_arguments_are_errors():
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


def test_the_error_without_ray_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ParameterError, match=r"pip install '\.\[ray\]'"):
        executor_for("ray", works.Sums()).__enter__()
