"""The hint for a program that sleeps while its own world stands still, without sleeping."""

import gc
from pathlib import Path
from types import SimpleNamespace

import pytest

from kiks.clock import sleeping


@pytest.mark.parametrize(
    ("naps", "idle_s", "simulated_s", "is_told"),
    [
        (True, 30.0, 0.5, True),
        (True, 30.0, 20.0, False),  # time passes in its world, too
        (True, 0.5, 0.0, False),  # too short to matter
        (False, 30.0, 0.5, False),  # a person at a debugger, or a slow file
    ],
)
def test_a_program_that_sleeps_beside_its_world_gets_one_hint(
    naps: bool,
    idle_s: float,
    simulated_s: float,
    is_told: bool,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    clock, world = SimpleNamespace(now_ns=0), type("World", (), {})()
    program = {"__name__": "__main__", "watch": sleeping.watch_sleeps, "world": world, "clock": clock}
    nap = "\ndef nap():\n    time.sleep(1)" if naps else ""
    monkeypatch.setattr(sleeping, "FRAMES_MAX", 1)
    monkeypatch.setattr(sleeping, "_idle_s", lambda: 0.0)
    exec(f"watch(world, clock)\nwatch(world, clock){nap}", program)
    monkeypatch.setattr(sleeping, "_idle_s", lambda: idle_s)
    clock.now_ns = round(simulated_s * 1e9)
    del world
    program.clear()
    gc.collect()
    assert caplog.text.count("time.sleep lets no simulated time pass") == is_told
    assert not is_told or "waited for 30 s, and 0.5 s have passed" in caplog.text


def test_the_wait_of_a_program_is_neither_its_work_nor_a_wait_for_a_processor(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sleeping, "perf_counter", lambda: 15.0)
    monkeypatch.setattr(sleeping, "process_time", lambda: 4.0)
    monkeypatch.setattr(sleeping, "SCHEDULED", tmp_path / "schedstat")
    assert sleeping._idle_s() == 11.0  # a system that does not count it
    sleeping.SCHEDULED.write_text("4000000000 2000000000 17\n")
    assert sleeping._idle_s() == 9.0
