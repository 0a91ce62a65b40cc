"""How time passes: in slices, so that little work is ever due, and to an end if one is set."""

from typing import Any, NoReturn

import pytest

from kiks import Arena, Khepera, Simulation
from kiks.engine import step
from kiks.sim.saved_state import SavedState, WorldFiles, state_bytes
from kiks.units import NS_PER_S, TICK_NS

HOUR_S = 3600


def driving(robots: int = 1) -> Simulation:
    sim = Simulation(Arena.box(600, 400), robots=robots, seed=3)
    for number in range(1, robots + 1):
        Khepera(sim.port(number)).set_speed(4, 5)
    return sim


def behind_ns(sim: Simulation) -> int:
    return sim.now_ns - sim.world.state.tick_count * TICK_NS


def test_never_more_than_a_slice_is_due_however_time_passes() -> None:
    sim = driving()
    saved = SavedState.from_bytes(state_bytes(sim, files := WorldFiles()), files, "a state")
    for _ in range(2):
        for seconds in (*[1] * 600, 2 * HOUR_S):
            sim.run(seconds)
            assert behind_ns(sim) <= sim.world.slice_ns
        saved.restore(sim)  # a step back in time


def test_a_long_sleep_can_be_stopped_between_two_slices_and_leaves_the_world_there() -> None:
    sim = driving()
    calls: list[int] = []

    def stop() -> None:
        calls.append(sim.now_ns)
        if len(calls) == 3:
            raise KeyboardInterrupt

    sim.loop.on_slice = stop
    with pytest.raises(KeyboardInterrupt):
        sim.run(1e8)
    assert sim.now_ns == calls[-1] < 4 * sim.world.slice_ns
    assert behind_ns(sim) <= 0


def test_slices_change_nothing() -> None:
    whole, parts = driving(3), driving(3)
    whole.run(HOUR_S)
    end_ns = parts.now_ns + HOUR_S * NS_PER_S
    while parts.now_ns < end_ns:
        parts.advance_to(min(parts.now_ns + 7_123_456_789, end_ns))
        parts.sync()
    assert whole.state_hash() == parts.state_hash()


def test_a_signal_within_the_kernel_leaves_the_ticks_that_were_done_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    sim, whole = driving(), driving()

    def interrupted(*args: Any) -> None:
        step.advance(*args)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(sim.world, "advance", interrupted)
        with pytest.raises(KeyboardInterrupt):
            sim.run(1000)
    sim.run(0)
    whole.advance_to(sim.now_ns)
    assert sim.state_hash() == whole.state_hash()


class OverError(Exception):
    pass


def end() -> NoReturn:
    raise OverError


@pytest.mark.parametrize("end_s", [0.5, 1234.5])
def test_time_ends_where_it_is_told_to(end_s: float) -> None:
    sim, whole, end_ns = driving(), driving(), round(end_s * NS_PER_S)
    sim.loop.end_at(end_ns, end)
    sim.advance_to(end_ns)  # up to there, not beyond
    with pytest.raises(OverError):
        sim.run(1e-9)
    with pytest.raises(OverError):
        sim.run(1e6)
    whole.advance_to(end_ns)
    assert (sim.time_s, sim.state_hash()) == (end_s, whole.state_hash())
    sim.loop.check_end(end_ns)
    with pytest.raises(OverError):
        sim.loop.check_end(end_ns + 1)  # what is still to come
    assert sim.time_s == end_s
