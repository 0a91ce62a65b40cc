"""The first start: processes that compile side by side."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from kiks.cli import engine_start

HELP = "from kiks.cli.engine_start import help_to_compile; help_to_compile()"
PIECE_COUNT = 6


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of the pieces that this process has compiled, in order; the pieces do nothing else."""
    numbers: list[int] = []

    def piece(number: int) -> object:
        return lambda: numbers.append(number)

    monkeypatch.setattr(engine_start, "_PIECES", tuple(map(piece, range(PIECE_COUNT))))
    return numbers


def test_one_processor_gets_no_second_process(done: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    monkeypatch.setattr(subprocess, "Popen", None)
    engine_start._compile_together(range(PIECE_COUNT))
    assert done == []


@pytest.mark.parametrize("processors", [2, 3, 64])
def test_a_process_that_fails_takes_one_piece_from_the_end(
    done: list[int], processors: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(processors)))
    monkeypatch.setattr(sys, "executable", "/bin/false")
    engine_start._compile_together(range(PIECE_COUNT))
    helpers = min(processors, engine_start._MOST_PROCESSES) - 1
    assert done == list(range(len(done)))
    assert len(done) >= PIECE_COUNT - helpers


def test_a_helper_answers_each_order_and_ends_with_its_input() -> None:
    number = engine_start._PIECES.index(engine_start._read_light)
    with subprocess.Popen(
        [sys.executable, "-c", HELP], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as helper:
        assert helper.stdin is not None
        assert helper.stdout is not None
        for _ in range(2):
            print(number, file=helper.stdin, flush=True)
            assert helper.stdout.readline() == "\n"
        helper.stdin.close()
        assert helper.wait() == 0


def test_time_passes_in_the_first_piece_of_the_engine_alone() -> None:
    """Else two processes would compile ticks, which take longest."""
    from kiks.sim.simulation import Simulation

    sims = []
    with pytest.MonkeyPatch.context() as patch:
        real = engine_start._simulation

        def remembered() -> Simulation:
            sims.append(real())
            return sims[-1]

        patch.setattr(engine_start, "_simulation", remembered)
        for number in engine_start._OF_ENGINE[1:]:
            engine_start._PIECES[number]()
    assert len(sims) == len(engine_start._OF_ENGINE) - 1
    assert all(sim.time_s == 0 for sim in sims)
