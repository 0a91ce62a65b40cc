"""Looking back on a desk, without a browser: the past equals what was, and the present does not notice."""

import asyncio
import os
import re
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.guard import GUARD_S, wait_until

from kiks import Arena, Khepera, Recording, Simulation
from kiks.desk.server.desk import Desk
from kiks.desk.server.marks import Mark, next_mark
from kiks.desk.server.rights import Rights
from kiks.desk.server.show import Driver
from kiks.errors import LinkError, ParameterError
from kiks.export.film import save_film
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.recording.mcap_file import DiskSpace, McapReader
from kiks.recording.replay import check_recording
from kiks.recording.ring import Ring
from kiks.run import Run
from kiks.units import NS_PER_S, s_from_ns

ROUND = """
import serial
port = serial.Serial("kiks", timeout=1)
for step in range(400):
    port.write(b"D,%d,3\\n" % (step % 9))
    port.readline()
"""

run = asyncio.run


def drive(sim: Simulation, seconds: float, hashes: dict[int, str] | None = None) -> None:
    """Let a program drive robot 1 about, and note the state after each of its steps."""
    end_s = sim.time_s + seconds
    khepera, step = Khepera(sim.port(1)), 0
    while sim.time_s < end_s:
        step += 1
        near = khepera.proximity()
        khepera.set_speed(9 - near[3] // 60 - step % 3, 9 - near[2] // 70)
        if hashes is not None:
            hashes[sim.now_ns] = sim.state_hash()


@contextmanager
def desk_of(sim: Simulation, rights: Rights = Rights.VISITOR) -> Iterator[Desk]:
    with closing(Desk(Run.in_world(sim, speed=None), rights)) as desk:
        desk.looking.start_history()
        yield desk


def make_sim() -> Simulation:
    sim = Simulation(Arena.box(400, 400), robots=2, seed=5)
    sim.place(1, 100, 100, 0.0)
    sim.place(2, 300, 300, 0.0)
    sim.add_ball(200, 200)
    return sim


def state_of(desk: Desk) -> tuple[int, str]:
    return run(desk.do(lambda sim: (sim.now_ns, sim.state_hash())))


def told(desk: Desk) -> list[str]:
    return desk.news.since(0)[1]


def bookmarks_of(desk: Desk) -> list[tuple[float, str]]:
    return [(mark.time_s, mark.text) for mark in desk.looking.marks if mark.kind == "bookmark"]


def check_past(desk: Desk, hashes: dict[int, str], times: Sequence[int]) -> None:
    """Look at times; check that the world is as it was."""
    for time_ns in times:
        run(desk.looking.look_at(time_ns))
        assert state_of(desk) == (time_ns, hashes[time_ns])
        assert desk.sim is not desk.present.sim


# ---- the present and the past ----


def test_the_past_equals_what_was_and_the_present_goes_on_unchanged() -> None:
    alone, sim, hashes = make_sim(), make_sim(), {}
    drive(alone, 4.0)
    drive(alone, 1.0)
    with desk_of(sim) as desk:
        run(desk.present_project())
        # A caller who has asked for the lamps may write to them at each instant.
        assert not sim.world.lamps_exposed
        drive(sim, 4.0, hashes)
        now_ns, now_hash, times = sim.now_ns, sim.state_hash(), list(hashes)
        half = len(times) // 2
        check_past(desk, hashes, [times[-1], times[3], times[half], times[half - 1], *times[::7]])
        run(desk.looking.look_at(10**15))
        assert state_of(desk) == (now_ns, now_hash)
        run(desk.looking.back_to_now())
        assert (desk.sim is sim, desk.is_paused) == (True, False)
        drive(sim, 1.0)
        assert sim.state_hash() == alone.state_hash()
        run(desk.looking.look_at(sim.now_ns - 500_000_000))
        assert desk.sim.now_ns == sim.now_ns - 500_000_000
    assert sim.loop.recorder is sim.loop.gate is None


def test_a_program_that_waits_at_the_gate_goes_on_as_if_nothing_had_been() -> None:
    alone, sim = make_sim(), make_sim()
    drive(alone, 3.0)
    with desk_of(sim) as desk:
        running = threading.Thread(target=lambda: drive(sim, 3.0))
        running.start()
        for _ in range(3):
            before_ns = sim.now_ns
            wait_until(lambda before_ns=before_ns: sim.now_ns > before_ns or not running.is_alive())
            run(desk.looking.look_at(sim.now_ns // 2))
            assert desk.sim.now_ns <= sim.now_ns
            run(desk.looking.back_to_now())
        running.join(GUARD_S)
        assert sim.state_hash() == alone.state_hash()


def test_the_past_is_played_up_to_the_present_and_of_seeks_at_once_the_last_one_counts() -> None:
    sim = make_sim()
    with desk_of(sim) as desk:
        drive(sim, 3.0)
        run(desk.pause())
        run(desk.looking.look_at(0))
        run(desk.looking.back_to_now())
        assert desk.is_paused, "what stood still stands still again"
        run(desk.looking.look_at(0))
        run(desk.step(0.25))
        wait_until(lambda: desk.sim.now_ns == 250_000_000)
        run(desk.go_on())
        wait_until(lambda: desk.is_paused)
        assert state_of(desk) == (sim.now_ns, sim.state_hash())
        run(desk.looking.move_by(-0.1))
        assert desk.sim.now_ns == sim.now_ns - 100_000_000
        run(desk.looking.move_by(1.0))
        assert desk.sim.now_ns == sim.now_ns
        # Where the past ends, the present goes on.
        run(desk.go_on())
        assert (desk.sim is sim, desk.is_paused) == (True, False)
        run(seek_at_once(desk))
        assert desk.sim.now_ns == 1_490_000_000


async def seek_at_once(desk: Desk) -> None:
    await asyncio.gather(*(desk.looking.look_at(step * 10_000_000) for step in range(150)))


# ---- what may not be done ----


def test_the_past_cannot_be_changed_and_without_the_world_of_its_own_a_desk_has_no_branches() -> None:
    with closing(Desk(Run.in_world(make_sim(), speed=None))) as desk:
        with pytest.raises(LinkError, match="this world is not recorded"):
            run(desk.looking.look_at(0))
        desk.looking.start_history()
        drive(desk.sim, 0.5)
        run(desk.grab("hand", "robot", 0))
        run(desk.looking.look_at(0))
        assert desk.present.hands.are_empty
        with pytest.raises(LinkError, match="this desk's own"):
            run(desk.go_on_from_here())
        for act in (desk.grab("hand", "robot", 0), desk.change(desk.mark), desk.halt()):
            with pytest.raises(ParameterError, match=r"at the past, which cannot be changed\. Press 'Back to now'"):
                run(act)


def test_a_recording_of_the_user_goes_on_beside_the_past(tmp_path: Path) -> None:
    sim, hashes = make_sim(), {}
    with desk_of(sim) as desk:
        drive(sim, 1.0, hashes)
        with sim.record(tmp_path / "run.mcap"), sim.record(tmp_path / "other.mcap"):
            drive(sim, 1.0, hashes)
            run(desk.looking.look_at(next(iter(hashes))))
            run(desk.looking.back_to_now())
        drive(sim, 1.0, hashes)
        check_past(desk, hashes, list(hashes)[::9])
        assert "change" not in {mark.kind for mark in desk.looking.marks}
    recording = Recording(tmp_path / "run.mcap")
    assert (recording.is_whole, check_recording(recording.log).differs_ns) == (True, None)
    assert 0.9 < recording.duration_s < 1.1
    assert Recording(tmp_path / "other.mcap").table("poses").tolist() == recording.table("poses").tolist()


def test_of_a_long_past_the_oldest_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    # Each checkpoint is written at once, with its state.
    for name, value in (("recorder.STATE_US", 0), ("recorder.CHUNK_S", 0.0), ("ring.BYTES_MAX", 16_000)):
        monkeypatch.setattr(f"kiks.recording.{name}", value)
    sim, hashes = make_sim(), {}
    with desk_of(sim) as desk:
        ring = desk.looking._history.source
        assert isinstance(ring, Ring)
        for _ in range(20):
            drive(sim, 1.0, hashes)
            assert os.fstat(ring._file).st_size <= 16_000
            run(desk.looking.poll())
        (message,) = told(desk)
        assert re.search(r"(?s)The time bar now begins at.*--record FILE", message)
        span = desk.looking.span
        assert NS_PER_S < span.begin_ns < span.end_ns - NS_PER_S
        assert span.end_ns == sim.now_ns
        assert all(mark.time_s >= span.begin_ns / 1e9 for mark in desk.looking.marks)
        run(desk.pause())
        run(desk.looking.look_at(0))  # what was not written yet may have pushed out the oldest chunk
        span = desk.looking.span
        assert desk.sim.now_ns == span.begin_ns
        run(desk.go_on())
        wait_until(lambda: desk.is_paused)
        assert state_of(desk) == (sim.now_ns, sim.state_hash())
        check_past(desk, hashes, [each for each in hashes if each >= span.begin_ns][::11])
        recording = run(desk.looking.recording())
        assert check_recording(recording.log).differs_ns is None
        assert recording.table("poses")["time_s"].max() == pytest.approx(sim.time_s, abs=0.02)


def test_when_others_fill_the_disk_the_past_is_recorded_no_more_nor_by_a_new_desk(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)
    free_bytes = 10**9
    monkeypatch.setattr("kiks.recording.ring.disk_space", lambda _folder: DiskSpace(free_bytes, 128 << 20))
    sim, alone = make_sim(), make_sim()
    with desk_of(sim) as desk:
        drive(sim, 2.0)
        free_bytes, now_ns = 127 << 20, sim.now_ns
        drive(sim, 3.0)
        (message,) = told(desk)
        assert message.startswith("Cannot record the past any longer")
        assert "must have 128 MiB free, but it has 127 MiB. Free some space and start the world over" in message
        assert sim.loop.recorder is None
        for seconds in (2.0, 3.0):
            drive(alone, seconds)
        run(desk.looking.look_at(10**15))
        assert abs(desk.sim.now_ns - now_ns) <= NS_PER_S
        run(desk.looking.back_to_now())
        assert sim.state_hash() == alone.state_hash()
    with desk_of(make_sim()) as desk:
        (message,) = told(desk)
        assert "must have 128 MiB free, but it has 127 MiB" in message
        assert desk.looking.span is desk.sim.loop.recorder is None


def test_when_the_file_of_the_user_is_full_the_desk_records_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)
    sim, hashes = make_sim(), {}
    with desk_of(sim) as desk:
        recorder = sim.record(tmp_path / "run.mcap")
        drive(sim, 1.5, hashes)
        run(desk.looking.poll())
        with monkeypatch.context() as full:
            full.setattr("kiks.recording.mcap_file.disk_space", lambda _folder: DiskSpace(0, 1))
            drive(sim, 1.5, hashes)
        run(desk.looking.poll())
        drive(sim, 1.0, hashes)
        check_past(desk, hashes, list(hashes)[::9])
        with pytest.raises(ParameterError, match="has ended at 2"):
            recorder.close()
    assert Recording(tmp_path / "run.mcap").is_whole


# ---- a recording ----


@pytest.fixture(scope="module")
def tape(tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    """A recording, and the states of its world."""
    sim, hashes, file = make_sim(), {}, tmp_path_factory.mktemp("tape") / "run.mcap"
    with sim.record(file) as recorder:
        drive(sim, 1.5, hashes)
        recorder.mark("half")
        recorder.flush()
        recorder.say(0, "hello")
        sim.place(1, 200, 100, 0)
        drive(sim, 1.5, hashes)
        Khepera(sim.port(1)).set_speed(20, 20)
        sim.run(3.0)
        hashes[sim.now_ns] = sim.state_hash()
    return SimpleNamespace(file=file, hashes=hashes, times=[*hashes])


@contextmanager
def driven(desk: Desk) -> Iterator[Desk]:
    desk.looking.start_history()
    driver = Driver(desk)
    driver.start()
    yield desk
    driver.stop()
    driver.join(GUARD_S)
    desk.close()


@contextmanager
def replaying(file: Path, time_ns: int = 0) -> Iterator[Desk]:
    recording = Recording(file)
    desk = Desk(Run.in_world(recording.world_at(0), speed=None), Rights.OWNER)
    desk.looking.show_recording(file, time_ns)
    with driven(desk):
        yield desk


def test_a_recording_is_shown_played_and_begun_again_at_its_end(tape: SimpleNamespace) -> None:
    with replaying(tape.file, tape.times[5]) as desk:
        assert state_of(desk) == (tape.times[5], tape.hashes[tape.times[5]])
        desk.begin()
        wait_until(lambda: desk.is_paused)
        assert state_of(desk) == (tape.times[-1], tape.hashes[tape.times[-1]])
        run(desk.set_speed(0.001))
        run(desk.go_on())
        assert desk.sim.now_ns < NS_PER_S
        with pytest.raises(LinkError, match="shows a recording only"):
            run(desk.looking.back_to_now())


def test_events_are_found_on_the_way(tape: SimpleNamespace) -> None:
    with replaying(tape.file) as desk:
        marks = desk.looking.marks
        kinds = Counter(mark.kind for mark in marks)
        assert kinds["bookmark"] == kinds["output"] == kinds["change"] == 1 <= kinds["contact"]
        texts = {"half", "robot 1: hello", "changed by hand or by a program", "robot 1 touches something"}
        assert texts <= {mark.text for mark in marks}
        found: list[Mark] = []
        while (mark := run(desk.looking.jump(is_before=False))) is not None:
            assert desk.sim.time_s == mark.time_s
            found.append(mark)
        times = list(dict.fromkeys(mark.time_s for mark in marks))
        assert [mark.time_s for mark in found] == times
        while (mark := run(desk.looking.jump(is_before=True))) is not None:
            found.append(mark)
        assert [mark.time_s for mark in found[len(times) :]] == times[-2::-1]
        assert next_mark(marks, 0, is_before=True) is None


def test_what_a_killed_run_has_left_is_shown(tape: SimpleNamespace, tmp_path: Path) -> None:
    hashes, last = tape.hashes, McapReader(tape.file).chunks[-1]
    (tmp_path / "cut.mcap").write_bytes(tape.file.read_bytes()[: last.offset + last.length // 2])
    with replaying(tmp_path / "cut.mcap") as desk:
        span = desk.looking.span
        times = [time_ns for time_ns in hashes if time_ns <= span.end_ns]
        assert 0 < len(times) < len(hashes)
        check_past(desk, hashes, times[-1:])
        run(desk.looking.look_at(10**12))
        assert desk.sim.now_ns == span.end_ns


# ---- branches ----


def test_from_a_time_of_a_recording_a_person_goes_on(tape: SimpleNamespace) -> None:
    hashes, time_ns, state_hash = tape.hashes, tape.times[30], tape.hashes[tape.times[30]]
    with replaying(tape.file, time_ns) as desk:
        run(desk.go_on_from_here())
        assert (desk.past, desk.is_paused, state_of(desk)) == (None, True, (time_ns, state_hash))
        sim = desk.sim
        assert sim is desk.present.sim
        run(desk.grab("hand", "robot", 0))
        run(desk.drop("hand"))
        run(desk.go_on())
        wait_until(lambda: sim.now_ns > time_ns + NS_PER_S)
        # The bar reaches from the beginning of the recording through the branch to now.
        run(desk.pause())
        now_ns, now_hash = state_of(desk)
        assert desk.looking.span == (0, now_ns)
        check_past(desk, {**hashes, now_ns: now_hash}, [*list(hashes)[:30:7], now_ns])
        # And again from an earlier time.
        run(desk.looking.look_at(tape.times[10]))
        run(desk.go_on_from_here())
        assert state_of(desk) == (tape.times[10], hashes[tape.times[10]])
        assert desk.looking.span == (0, tape.times[10])


@pytest.mark.parametrize(("at_s", "begin_s"), [(0.0, 0.0), (0.5, 0.0), (2.0, 0.0), (3.7, 0.0), (3.7, 3.7)])
def test_a_branch_is_filmed_from_where_it_can_be(at_s, begin_s, tmp_path, monkeypatch):
    monkeypatch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)  # a chunk begins before its first entry
    if begin_s:
        monkeypatch.setattr("kiks.recording.ring.COPY_BYTES_MAX", 1)
    with desk_of(make_sim(), Rights.OWNER) as desk:
        desk.sim.run(4.2)
        run(desk.looking.look_at(round(at_s * NS_PER_S)))
        run(desk.go_on_from_here())
        desk.sim.loop.gate = None
        drive(desk.sim, 2.0)
        recording = run(desk.looking.recording())
        assert recording.log.begin_ns == begin_s * NS_PER_S
        picture_count = save_film(recording, tmp_path / "branch.webp", size=(160, 120), fps=5)
        assert picture_count == int((s_from_ns(desk.sim.now_ns) - begin_s) * 5) + 1


def test_bookmarks_are_set_in_the_present_and_in_the_past_and_kept(tmp_path: Path) -> None:
    sim = make_sim()
    with sim.record(tmp_path / "run.mcap"), desk_of(sim, Rights.OWNER) as desk:
        sim.run(2.5)
        run(desk.looking.bookmark(sim.now_ns, "late"))
        sim.run(0.1)
        run(desk.looking.look_at(NS_PER_S))
        for text in ("early", "early, too"):
            run(desk.looking.bookmark(NS_PER_S, text))
        bookmarks = [(1.0, "early"), (1.0, "early, too"), (2.5, "late")]
        assert bookmarks_of(desk) == bookmarks
        run(desk.looking.look_at(2 * NS_PER_S))
        run(desk.go_on_from_here())
        run(desk.looking.poll())
        assert bookmarks_of(desk) == bookmarks[:2]
    events = Recording(tmp_path / "run.mcap").table("events")
    assert sorted(events[events["kind"] == "bookmark"]["text"].tolist()) == ["early", "early, too", "late"]


def test_bookmarks_of_a_finished_recording_go_on_with_a_branch(tape: SimpleNamespace) -> None:
    time_ns = tape.times[30]
    with replaying(tape.file, time_ns) as desk:
        run(desk.looking.bookmark(time_ns, "here"))
        here = s_from_ns(time_ns), "here"
        assert here in bookmarks_of(desk)
        for act in (desk.go_on_from_here, desk.looking.recording):
            run(act())
            run(desk.looking.poll())
            assert bookmarks_of(desk).count(here) == 1
        run(desk.start_over())
        run(desk.looking.poll())
        assert bookmarks_of(desk) == []


def test_another_world_has_another_past(tmp_path: Path) -> None:
    (tmp_path / "round.py").write_text(ROUND)
    project, commands = Project(Arena.box(400, 400), seed=3, speed=None), [ProgramCommand(tmp_path / "round.py")]
    with driven(Desk(Run(project, tmp_path, commands), Rights.OWNER, folder=tmp_path)) as desk:
        first = desk.sim
        wait_until(lambda: first.now_ns > NS_PER_S)
        run(desk.start_over())
        assert (desk.sim is first, first.loop.recorder) == (False, None)
        wait_until(lambda: desk.sim.now_ns > NS_PER_S)
        assert not desk.is_paused
        run(desk.looking.look_at(NS_PER_S // 2))
        run(desk.start_over())
        assert (desk.past, desk.is_paused, desk.looking.span[0]) == (None, False, 0)


def test_robots_that_came_are_gone_before_they_came() -> None:
    sim = make_sim()
    with desk_of(sim, Rights.OWNER) as desk:
        drive(sim, 1.0)
        sim.add_robot()
        drive(sim, 1.0)
        for time_ns, count in ((1_500_000_000, 3), (NS_PER_S // 2, 2)):
            run(desk.looking.look_at(time_ns))
            assert desk.sim.robot_count == count
        run(desk.go_on())
        wait_until(lambda: desk.is_paused)
        assert (desk.sim.robot_count, state_of(desk)) == (3, (sim.now_ns, sim.state_hash()))
