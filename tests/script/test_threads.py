"""Threads of a program in simulated time: what they do is what a plain discrete-event simulation says."""

from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import pytest
from hypothesis import HealthCheck, given, settings
from tests.at_length import share
from tests.script import seen
from tests.script.conftest import BOX
from tests.script.oracle import Oracle, Trace

from kiks.script.runner import run_here
from kiks.sim.simulation import Simulation

STEPS = Path(__file__).with_name("steps.py")
TIMES_MS = st.sampled_from([1, 2, 5, 8, 30])
PLAIN = st.one_of(
    st.tuples(st.just("sleep"), TIMES_MS),
    st.tuples(st.just("put"), st.integers(0, 1), st.integers(0, 9)),
    st.tuples(st.just("get"), st.integers(0, 1), TIMES_MS),
    st.tuples(st.just("set"), st.integers(0, 1)),
    st.tuples(st.just("clear"), st.integers(0, 1)),
    st.tuples(st.just("wait"), st.integers(0, 1), TIMES_MS),
    st.tuples(st.just("ask"), st.integers(1, 2), st.sampled_from(["N\n", "D,3,4\n", "H\n", "D,0,0\n"])),
)
LOCK = st.just("lock"), st.integers(0, 2), TIMES_MS
ANY = st.recursive(PLAIN, lambda steps: st.tuples(*LOCK, st.lists(steps, max_size=4)))
PROGRAMS = st.lists(st.lists(ANY, max_size=8), min_size=1, max_size=5)


def world() -> Simulation:
    """Return a small world of two robots that is always the same."""
    return Simulation(BOX, robots=2, seed=7)


def run_threads(program: list[Any]) -> tuple[Trace, str]:
    """Run a program's steps in threads; return what they saw, and the state of the world."""
    seen.sim, seen.program, seen.robots, seen.trace = world(), program, 2, []
    assert run_here(seen.sim, STEPS, [], {}) == 0
    return seen.trace, seen.sim.state_hash()


@pytest.mark.slow
@given(PROGRAMS)
@settings(max_examples=share(40, 200), derandomize=True, suppress_health_check=[HealthCheck.too_slow])
def test_threads_do_what_a_plain_simulation_says(program: list[Any]) -> None:
    oracle = Oracle(world(), program)
    assert run_threads(program) == (oracle.trace, oracle.sim.state_hash())
