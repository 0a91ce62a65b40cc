"""What a recording tells of moments is where everything was, between ticks too."""

import random

import numpy as np
import pytest

from kiks import Arena, Khepera, Recording, Simulation
from kiks.recording import recorder
from kiks.recording.moments import moments

SECONDS = 5.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A robot pushes a ball; then a wall and a second robot come, and a lamp goes out. Each second is a chunk."""
    file = tmp_path_factory.mktemp("recording") / "run.mcap"
    sim = Simulation(Arena.box(500, 400), seed=3)
    sim.place(1, 100, 200, 0.1)
    sim.add_ball(180, 200)
    sim.add_lamp(400, 100)
    robot = Khepera(sim.port(1))
    robot.set_speed(12, 11)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "CHUNK_S", 0.0)
        with sim.record(file):
            while sim.time_s < SECONDS:
                robot.proximity()
                if sim.time_s > 2 and sim.robot_count == 1:
                    sim.add_robot()
                    walls = np.flipud(sim.arena.brightness).copy()
                    walls[20:40, 20:40] = 200
                    sim.set_arena(Arena.from_array(walls))
                    sim.lamps[0, 3] = 0
    return Recording(file)


def test_they_are_those_of_the_run_made_again(recording: Recording) -> None:
    chance = random.Random(1)
    times_ns = sorted(chance.randrange(recording.log.begin_ns, recording.log.end_ns) for _ in range(300))
    replay = recording.replay()
    for moment in moments(recording.log, times_ns):
        replay.sim.advance_to(moment.time_ns)
        replay.sim.sync()
        np.testing.assert_array_equal(moment.poses, replay.sim.poses()[: len(moment.poses)])
        places = replay.sim.look().places
        np.testing.assert_allclose(np.column_stack([moment.bodies["x_mm"], moment.bodies["y_mm"]]), places, atol=1e-9)
        np.testing.assert_array_equal(moment.saved.lamps, replay.sim.lamps)
        np.testing.assert_array_equal(moment.saved.arena.brightness, replay.sim.arena.brightness)
        assert len(moment.saved.specs) == replay.sim.robot_count


def test_they_are_the_same_from_any_time_on(recording: Recording) -> None:
    begin_ns, end_ns = recording.log.begin_ns, recording.log.end_ns
    for start_s in (0.0, 0.995, 1.0, 1.0049, 2.0, 3.33):
        times_ns = list(range(max(round(start_s * 1e9), begin_ns), end_ns, 33_000_000))
        earlier_ns = range(begin_ns, times_ns[0], 7_000_000)
        whole = {each.time_ns: each for each in moments(recording.log, [*earlier_ns, *times_ns])}
        for moment in moments(recording.log, times_ns):
            np.testing.assert_array_equal(moment.poses, whole[moment.time_ns].poses)
            np.testing.assert_array_equal(moment.bodies, whole[moment.time_ns].bodies)


def test_each_tick_has_passed_once(recording: Recording) -> None:
    begin_ns = recording.log.begin_ns
    every = moments(recording.log, list(range(begin_ns, recording.log.end_ns, 70_000_000)))
    numbers = [tick.number for moment in every for tick in moment.passed]
    assert numbers == list(range(begin_ns // 10**7 + 1, numbers[-1] + 1))
    assert len(numbers) > 100 * SECONDS - 20


def test_readings_are_the_last_that_the_program_had(recording: Recording) -> None:
    table = recording.table("readings")
    for moment in moments(recording.log, list(range(500_000_000, recording.log.end_ns, 300_000_000))):
        row = np.searchsorted(table["time_s"], moment.time_ns / 1e9, side="right") - 1
        assert list(moment.readings[0]) == table["counts"][row].tolist()
