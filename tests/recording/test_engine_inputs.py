"""A run is made again by the engine alone, to the bit, from what came to it: by an oracle that knows nothing else."""

import base64
import zlib
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from tests.at_length import cases
from tests.recording.played import Played, played, unpacked
from tests.recording.random_runs import record_random

from kiks import Arena, Khepera, Recording, Simulation
from kiks.export.packed_text import packed_text
from kiks.recording.engine_inputs import EngineInputs
from kiks.recording.replay import Replay


def shown_of(sim: Simulation) -> Any:
    """Return a word of what is shown of each robot."""
    return sim.world.state.robots[0]["led"].astype(np.uint32).sum(axis=1, dtype=np.uint32)


def taken(recording: Recording) -> tuple[Replay, str]:
    """Make a run again; return it at its end, and what came to the engine, packed."""
    log = recording.log
    replay = Replay(log, log.begin_ns)
    inputs = EngineInputs(replay, shown_of)
    while replay.advance():
        pass
    replay.sim.advance_to(log.end_ns)
    replay.sim.sync()
    inputs.note()
    packed = inputs.pack()
    return replay, packed_text(packed.head, packed.parts)


def bytes_of(text: str) -> bytes:
    return zlib.decompress(base64.b64decode(text))


def check(recording: Recording) -> tuple[Replay, Played]:
    """Check that the engine alone makes the same run again."""
    replay, text = taken(recording)
    result = played(bytes_of(text))
    equal = [own == recorded for own, recorded in zip(result.own, result.recorded, strict=True)]
    assert (len(equal), sum(equal)) == (replay.check_count, replay.equal_count)
    assert result.state.hash() == replay.sim.state_hash()
    assert result.shown == shown_of(replay.sim).tolist()
    return replay, result


@pytest.mark.parametrize("seed", cases(range(200), normally=6))
def test_random_runs_are_the_same(seed: int, file: Path) -> None:
    replay, _ = check(record_random(seed, file))
    assert replay.differs_ns is None


def test_what_differs_goes_on_from_the_recorded_state(file: Path) -> None:
    """Also of a recording whose run is another one now: where it takes up the recorded state, the engine does, too."""
    sim = Simulation(Arena.box(400, 400), robots=2, seed=1)
    with patch("kiks.recording.recorder.CHUNK_S", 0.0), patch("kiks.recording.recorder.STATE_US", 0), sim.record(file):
        khepera = Khepera(sim.port(1))
        while sim.time_s < 4:
            khepera.set_speed(8, 5)
    recording = Recording(file)
    found = recording.log.next_input

    def other(place: Any) -> Any:
        """Change the commands of the second second."""
        answer = found(place)
        if answer is not None and answer[1].data.startswith(b"D") and 1e9 < answer[1].time_ns < 1.8e9:
            answer = (answer[0], answer[1]._replace(data=b"D,-9,4\n"), answer[2])
        return answer

    with patch.object(recording.log, "next_input", other):
        replay, result = check(recording)
    assert replay.differs_ns == 2_000_000_000
    # At 2 s there are two checkpoints, and the second one has the state.
    assert sum(own != recorded for own, recorded in zip(result.own, result.recorded, strict=True)) == 2


def test_a_state_of_the_same_kind_begins_no_segment(file: Path) -> None:
    sim = Simulation(Arena.box(400, 400), seed=1)
    sim.add_ball(100, 100)
    with sim.record(file):
        sim.run(0.5)
        sim.place(1, 300, 300, 1.0)
        sim.run(0.5)
        sim.add_lamp(30, 30)
        sim.run(0.5)
        sim.set_arena(Arena.box(400, 450))
        sim.run(0.5)
    _, result = check(Recording(file))
    assert result.segments == [0, 100, 150]


def test_an_hour_of_a_robot_packs_well(file: Path) -> None:
    """Half a minute of a robot whose speeds follow noisy readings, as fast as the line lets it."""
    sim = Simulation(Arena.box(400, 400), seed=1)
    with sim.record(file):
        khepera = Khepera(sim.port(1))
        while sim.time_s < 30:
            values = khepera.proximity()
            khepera.set_speed(10 - values[3] // 9, 10 - values[2] // 9)
    _, text = taken(Recording(file))
    head, moments, contents = unpacked(bytes_of(text))
    begin = len(base64.b64encode(zlib.compress(b"".join(contents), 9)))
    assert len(head["patterns"]) < 10
    assert len(moments) > 300
    assert 120 * (len(text) - begin) < 700_000
