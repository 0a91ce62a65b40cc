"""The first start: processes that compile side by side."""

import os
import subprocess
import sys
from collections.abc import Callable

import pytest

from kiks.cli import engine_start

HELP = "from kiks.cli.engine_start import help_to_compile; help_to_compile()"
PIECE_COUNT = 6


def pieces_noting(done: list[int]) -> list[Callable[[], None]]:
    """Return pieces that do nothing but note their numbers."""
    return [lambda number=number: done.append(number) for number in range(PIECE_COUNT)]


def test_one_processor_gets_no_second_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    monkeypatch.setattr(subprocess, "Popen", None)
    done: list[int] = []
    engine_start._compile_together(pieces_noting(done))
    assert done == []


@pytest.mark.parametrize("processors", [2, 3, 64])
def test_a_process_that_fails_takes_one_piece_from_the_end(processors: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(processors)))
    monkeypatch.setattr(sys, "executable", "/bin/false")
    done: list[int] = []
    engine_start._compile_together(pieces_noting(done))
    helpers = min(processors, engine_start._MOST_PROCESSES) - 1
    assert done == list(range(len(done)))
    assert len(done) >= PIECE_COUNT - helpers


def test_a_helper_answers_each_order_and_ends_with_its_input() -> None:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", HELP], text=True, **pipes) as helper:
        for _ in range(2):
            print(engine_start._read_light.__name__, file=helper.stdin, flush=True)
            assert helper.stdout.readline() == "\n"
        helper.stdin.close()
        assert helper.wait() == 0


def test_time_passes_in_the_first_pieces_alone() -> None:
    """Else two processes would compile ticks, which take longest."""
    from kiks.sim.simulation import Simulation

    sims = []
    with pytest.MonkeyPatch.context() as patch:
        real = engine_start._simulation

        def remembered() -> Simulation:
            sims.append(real())
            return sims[-1]

        patch.setattr(engine_start, "_simulation", remembered)
        pieces = engine_start._PIECES[engine_start._PIECES.index(engine_start.compile_batch) + 1 :]
        for piece in pieces:
            piece()
    assert len(sims) == len(pieces) > 3
    assert all(sim.time_s == 0 for sim in sims)
