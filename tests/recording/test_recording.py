"""A recorded run is the same as one that is not, is made again to the bit, and can be gone on with from any time."""

import random
import resource
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from tests.at_length import cases
from tests.demos.shown import run, shown, world_of

import kiks
from kiks import Arena, EPuck, Khepera, ParameterError, Recording, Simulation
from kiks.clock.gate import Gate
from kiks.firmware.general_io import GeneralIO
from kiks.firmware.turret import Orders, Turret
from kiks.model.arena import Lamp
from kiks.model.checks import CLOCK_END_NS, ROBOTS_MAX
from kiks.recording.entries import Entry, characters_in, pack_entries, parse_score, unpack_entries
from kiks.recording.events import EventReader
from kiks.recording.log import RecordedLog
from kiks.recording.mcap_file import disk_space
from kiks.recording.moments import moments
from kiks.recording.recorder import RunWriter
from kiks.recording.replay import Replay, check_recording
from kiks.recording.ring import Ring
from kiks.sim.console import type_lines
from kiks.sim.drag import Drags
from kiks.sim.run_log import Kind
from kiks.sim.things import Checkpoint

SECONDS = 6.3


def drive(sim: Simulation, seconds: float, robot: int = 1) -> None:
    """Let a robot avoid obstacles by a simple rule."""
    khepera = Khepera(sim.port(robot))
    end_ns = sim.now_ns + round(seconds * 1e9)
    while sim.now_ns < end_ns:
        values = khepera.proximity()
        khepera.set_speed(8 - values[3] // 60, 8 - values[2] // 60)


def recorded(sim: Simulation, file: Path, act: Callable[[Simulation], object]) -> Recording:
    with sim.record(file):
        act(sim)
    assert sim.loop.recorder is None
    assert not sim.world.watchers
    return Recording(file)


def check_again(recording: Recording, state_hash: str) -> None:
    """Check that a recording makes the same run again: from the beginning, from each second on, and to and fro.

    One replay that jumps is everywhere what a new one is, and ends as the run did.
    """
    log = recording.log
    checked = check_recording(log)
    assert checked.differs_ns is None
    assert checked.equal_count > recording.duration_s
    assert recording.world_at(log.end_ns / 1e9).state_hash() == state_hash
    replays = [recording.replay(second + 0.5) for second in range(round(log.begin_ns / 1e9), int(log.end_ns / 1e9))]
    replay = recording.replay()
    for time_ns in np.random.default_rng(1).integers(log.begin_ns, log.end_ns, 10, endpoint=True).tolist():
        there = Replay(log, time_ns)
        if not replay.go_to(time_ns):
            assert there.sim.robot_count < replay.sim.robot_count or has_fewer_turrets(there.sim, replay.sim)
            replay = there
        assert (replay.sim.now_ns, replay.sim.state_hash()) == (time_ns, there.sim.state_hash())
    for each in (*replays, replay):
        while each.advance():
            pass
        assert each.sim.state_hash() == state_hash


def has_fewer_turrets(sim: Simulation, other: Simulation) -> bool:
    return any(len(sim.turrets(robot)) < len(other.turrets(robot)) for robot in range(1, sim.robot_count + 1))


@pytest.mark.parametrize("name", cases(["camera", "clean", "follow"]))
def test_demonstrations_are_the_same_with_a_recording_and_again(name: str, file: Path) -> None:
    alone, with_it = shown(name, SECONDS, seed=3), world_of(name, seed=3)
    recording = recorded(with_it, file, lambda sim: run(sim, name, SECONDS))
    assert with_it.state_hash() == alone.state_hash()
    check_again(recording, alone.state_hash())


def test_a_world_goes_on_from_any_time_as_it_went_on_then(file: Path) -> None:
    """Commands that were on their way, and the line's timing, are part of the state."""
    sim = Simulation(Arena.box(400, 400), seed=2)
    recording = recorded(sim, file, lambda sim: drive(sim, SECONDS))
    poses = recording.table("poses")
    for time_s in (0.0, 1.234, 3.0, 5.678):
        world, row = recording.world_at(time_s), poses[poses["time_s"] <= time_s][-1]
        assert world.time_s == pytest.approx(time_s, abs=1e-9)
        assert world.pose(1)[0] == pytest.approx(row["x_mm"], abs=1.0)
        drive(world, 1.0)  # it takes commands
        assert world.time_s > time_s + 1.0


def test_all_that_comes_from_outside_is_part_of_the_run(file: Path) -> None:
    """Hands, other robots, walls, lamps, turrets, wires and typed commands."""

    def act(sim: Simulation) -> None:
        drive(sim, 1.0)
        sim.place(1, 100, 100, 0.5)
        ball = sim.add_ball(200, 300)
        sim.move_body(ball, 200, 300, speed_mm_s=150.0, heading_rad=1.0)
        checkpoint = sim.checkpoint()
        drive(sim, 1.0)
        type_lines(sim, 1, "D,3,3")
        sim.run(0.2)
        assert sim.add_robot("khepera_ii") == 2
        sim.fit(2, "k213")
        sim.fit(1, "gripper")
        io = sim.fit(1, "io")
        assert isinstance(io, GeneralIO)
        drive(sim, 1.0, robot=2)
        io.inputs = 0x5A
        sim.lamps[0] = 250.0, 250.0, 5.0, 1.0
        drive(sim, 0.5)
        sim.set_arena(Arena.box(500, 450))
        sim.add_lamp(30, 400, 2.0)
        drive(sim, 1.0)
        sim.remove_body(ball)
        sim.wires[0].set_baud(38400)
        sim.port(1).write(b"G,1")
        sim.wires[0].hang_up()
        sim.port(1).write(b"D,2,2\nD,3")
        sim.wires[0].halt(sim.now_ns)
        sim.run(0.5)
        sim.reset(Checkpoint(sim.poses(), checkpoint.bodies, checkpoint.lamps))
        sim.run(1.3)

    def fresh() -> Simulation:
        sim = Simulation(replace(Arena.box(400, 420), lamps=(Lamp(50, 50),)), seed=5)
        sim.fit(1, "radio")
        return sim

    alone, sim = fresh(), fresh()
    act(alone)
    recording = recorded(sim, file, act)
    assert sim.state_hash() == alone.state_hash()
    check_again(recording, sim.state_hash())
    assert recording.robots == range(1, 3)
    assert [turret.name for turret in recording.world_at(4.0).turrets(1)] == [each.name for each in sim.turrets(1)]


class Switch(Turret):
    """Switches a lamp and remembers how often, in an object of its own, which no replay can know."""

    number, name = 24, "Switch"
    lamp: Any = None
    count = 0

    def switch(self) -> tuple[int, ...]:
        """S: switch the lamp."""
        self.count += 1
        self.lamp[0, 3] = self.count % 2
        return (self.count,)

    orders: ClassVar[Orders] = {"S": (0, switch)}


def test_turrets_of_users_need_not_be_there_again(file: Path) -> None:
    sim = Simulation(replace(Arena.box(400, 420), lamps=(Lamp(50, 50, 25.0),)), seed=5)
    switch = sim.fit(1, Switch())
    switch.lamp = sim.lamps

    def act(sim: Simulation) -> None:
        khepera = Khepera(sim.port(1))
        for count in range(1, 6):
            drive(sim, 0.4)
            assert khepera.turret(24, "S") == [count]
            khepera.ambient()

    recording = recorded(sim, file, act)
    check_again(recording, sim.state_hash())


def test_a_hand_that_drags_while_the_world_runs(file: Path) -> None:
    """The gate lets another thread act between two events; where that is depends on real time, the replay does not."""
    sim = Simulation(Arena.box(500, 500), seed=4)
    sim.loop.gate = Gate(sim.lock, speed=30.0)
    drags, is_over = Drags(sim), threading.Event()
    places_mm: list[float] = []

    def drag() -> None:
        while not is_over.is_set():
            places_mm.append(150.0 + len(places_mm) % 200)
            with sim.lock:
                drags.grab("hand", "robot", 0)
                drags.move("hand", places_mm[-1], 250.0)
                drags.drop("hand")
            is_over.wait(0.003)

    thread = threading.Thread(target=drag)

    def act(sim: Simulation) -> None:
        thread.start()
        while len(places_mm) < 10 or sim.time_s < 2:
            drive(sim, 0.5)
        is_over.set()
        thread.join()

    recording = recorded(sim, file, act)
    assert (recording.table("events")["kind"] == "change").sum() > 3
    check_again(recording, sim.state_hash())


def test_a_block_gives_back_its_entries() -> None:
    rng = np.random.default_rng(1)
    rows = []
    for kind in rng.choice(list(Kind), 1000).tolist():
        place = (int(rng.integers(0, most, endpoint=True)) for most in (CLOCK_END_NS, ROBOTS_MAX - 1))
        numbers = rng.integers(-(2**63), 2**63 - 1, 2).tolist()
        rows.append(Entry(kind, *place, *numbers, rng.bytes(rng.integers(0, 300))))
    block = pack_entries([value for row in rows for value in row])
    assert unpack_entries(block, "block") == rows
    assert unpack_entries(block, "block", [Kind.SEND]) == [row for row in rows if row.kind == Kind.SEND]
    assert characters_in(block) == sum(len(row.data) for row in rows)


def test_what_is_too_much_for_a_block_goes_into_several(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kiks.recording.recorder.ENTRIES_MAX", 7)
    sim = Simulation(Arena.box(400, 400), seed=2)
    recording = recorded(sim, file, lambda sim: drive(sim, 3.0))
    assert len(recording.log.blocks) > 10
    check_again(recording, sim.state_hash())


def test_tables_tell_what_happened(file: Path) -> None:
    sim = Simulation(Arena.box(300, 300), robots=2, seed=1)
    read, at, truth = [], [], {}
    with sim.record(file) as recorder:
        khepera = Khepera(sim.port(2))
        khepera.set_speed(10, 10)
        for _ in range(40):
            read.append(khepera.proximity())
            at.append(sim.time_s)
            sim.advance_to(-(-sim.now_ns // 10_000_000) * 10_000_000)
            truth[sim.now_ns // 10_000_000] = sim.poses()
        recorder.mark("half")
        recorder.say(1, "grüße")
        sim.run(2.0)
    recording = Recording(file)
    poses, wheels = recording.table("poses"), recording.table("wheels", 2)
    ticks = np.rint(poses["time_s"][poses["robot"] == 2] * 100).astype(int)
    np.testing.assert_array_equal(ticks, np.arange(ticks[-1] + 1))
    for tick, expected in truth.items():
        rows = poses[np.rint(poses["time_s"] * 100) == tick]
        assert rows[["x_mm", "y_mm", "heading_rad"]].tolist() == list(map(tuple, expected.tolist()))
    readings = recording.table("readings")
    assert (readings["robot"] == 2).all()
    assert readings["counts"].tolist() == read
    assert (readings["time_s"] < at).all()
    assert wheels["left_setpoint"][-1] == 10
    assert wheels["contacts"][-1] == sim.contacts(2) > 0
    assert wheels["left_pulses"][-1] == sim.world.state.robots["pulse_count"][0, 1, 0]
    wire = recording.table("wire", 2)
    assert wire["data"][:2].tolist() == [b"D,10,10\n", b"d\r\n"]
    assert (np.diff(wire["time_s"]) >= 0).all()
    events = recording.table("events")
    assert set(events["kind"]) == {"contact", "bookmark", "output"}
    texts = {kind: events[events["kind"] == kind]["text"].tolist() for kind in ("output", "bookmark")}
    assert texts == {"output": ["grüße"], "bookmark": ["half"]}
    for ask, words in (
        (lambda: recording.table("pose"), "Did you mean 'poses'"),
        (lambda: recording.table("poses", 3), "from 1 to 2"),
        (lambda: recording.world_at(99.0), "time_s must be from 0 to"),
    ):
        with pytest.raises(ParameterError, match=words):
            ask()


def test_tables_have_the_commands_units_and_bytes_of_each_kind_of_robot(file: Path) -> None:
    """Counters are read by Q on one robot and by H on the other, speeds are in their own units, zeros are bytes."""
    sim = Simulation(Arena.box(500, 500), robot=["epuck", "khepera"], robots=2, seed=1)
    with sim.record(file):
        stepper, other = EPuck(sim.port(1)), Khepera(sim.port(2))
        stepper.set_speed(305, -2000)
        other.set_speed(5, 5)
        sim.run(1.0)
        counts = [stepper.steps(), other.encoders()]
        near = [stepper.proximity(), other.proximity()]
        stepper.port.write(b"\xb2\x00")  # N in binary mode
        reply = stepper.port.read(16)
    recording = Recording(file)
    assert recording.table("positions")["value"].tolist() == list(map(list, counts))
    assert recording.table("readings")["counts"].tolist() == near
    assert recording.table("proximity")["value"].tolist() == near
    wheels = recording.table("wheels")[-2:]
    assert wheels["left_speed"].tolist() == [305, 5]
    assert wheels["right_speed"].tolist() == [-1000, 5]
    wire = recording.table("wire", 1)["data"].tolist()
    assert wire[-2:] == [b"\xb2\x00", reply]
    assert recording.columns("wire", 1)["data"][-2] == r"\xb2\x00"


def test_events_of_a_recording_that_grows_are_read_as_they_come(file: Path) -> None:
    sim = Simulation(Arena.box(300, 300), robots=2, seed=1)
    found, ring = [], Ring(sim)
    with sim.record(file) as recorder:
        RunWriter.of(sim).add(ring)
        log = RecordedLog(ring)
        reader = EventReader(log)
        for count in range(4):
            drive(sim, 0.7)
            Khepera(sim.port(2)).set_speed(12, 12)
            recorder.mark(str(count))
            recorder.flush()
            found += [*reader.contacts(), *reader.notes()]
            assert found[-1].kind == "bookmark"
            assert (log.end_ns, Replay(log, sim.now_ns).sim.state_hash()) == (sim.now_ns, sim.state_hash())
    RunWriter.of(sim).flush()
    found += [*reader.contacts(), *reader.notes()]
    table = Recording(file).table("events")
    found.sort(key=lambda event: event.time_s)
    # Of a contact, it is known within which 40 ms it began; others begin where the recording was read before.
    np.testing.assert_allclose([event.time_s for event in found], table["time_s"], rtol=0.0, atol=0.04)
    assert [(event.robot, event.kind, event.text) for event in found] == [tuple(row)[1:] for row in table.tolist()]
    assert {"contact", "bookmark"} <= set(table["kind"])


def test_the_record_of_a_watched_line_begins_anew_at_another_time(file: Path) -> None:
    sim = Simulation(Arena.box(300, 300), seed=1)
    replay = recorded(sim, file, lambda sim: drive(sim, 3.0)).replay(2.5)
    wire = replay.sim.wires[0]
    wire.watch(replay.sim.now_ns)
    replay.sim.advance_to(2_900_000_000)
    assert wire.log.pieces.count
    replay.go_to(1_500_000_000)
    assert all(piece.first_ns < 1_600_000_000 for piece in wire.log.pieces.since(0)[1])


def test_the_project_is_the_world_at_the_beginning(file: Path) -> None:
    sim = Simulation(Arena.box(300, 300), robots=2, seed=7)
    sim.fit(2, "k213")
    sim.add_cylinder(60, 60)
    before = sim.poses()
    recording = recorded(sim, file, lambda sim: drive(sim, 1.0))
    project = recording.project
    assert project.seed == 7
    assert [each.turrets for each in project.robots] == [(), ("k213",)]
    assert len(project.arena.cylinders) == 1
    np.testing.assert_allclose([tuple(start) for start in project.arena.starts], before, atol=1e-3)
    assert recording.about["kiks"] == kiks.__version__


def test_another_run_is_told_with_its_first_second(file: Path) -> None:
    sim = Simulation(Arena.box(300, 300), seed=1)
    recording = recorded(sim, file, lambda sim: drive(sim, 4.0))
    found = recording.log.next_input
    changed_ns = []

    def other(row: Any) -> Any:
        """Change one command of the third second, each time it is read."""
        answer = found(row)
        if answer is None:
            return answer
        if answer[1].data.startswith(b"D") and answer[1].time_ns > 2.1e9 and not changed_ns:
            changed_ns.append(answer[1].time_ns)
        if answer[1].time_ns in changed_ns:
            answer = (answer[0], answer[1]._replace(data=b"D,-9,4\n"), answer[2])
        return answer

    recording.log.next_input = other  # type: ignore[method-assign]
    checked = check_recording(recording.log)
    assert (checked.equal_count, checked.differs_ns) == (2, 3_000_000_000)
    assert check_recording(Recording(file).log).equal_count == 5


def test_a_score_is_recorded_with_its_times(file: Path) -> None:
    sim = Simulation(Arena.box(400, 400), robots=2, seed=1)
    with sim.record(file):
        sim.set_score("laps", 0)
        sim.run(1.3)
        sim.set_score(2, 1)
        sim.run(2.0)
        sim.set_score("laps", 1)
        sim.run(0.4)
    recording = Recording(file)
    events = recording.table("events")[["time_s", "robot", "kind", "text"]].tolist()
    assert events == [(0.0, 0, "score", "laps: 0"), (1.3, 2, "score", "1"), (3.3, 0, "score", "laps: 1")]
    for time_s, score in ((1.0, {"laps": 0}), (1.5, {"laps": 0, 2: 1}), (3.6, {"laps": 1, 2: 1})):
        assert recording.world_at(time_s).score == score
    assert check_recording(recording.log).differs_ns is None


@pytest.mark.parametrize("data", ["[1, NaN]", '["laps", 1e400]', "[0, 1]", '["", 1]', f'["laps", "{"x" * 41}"]', "[1]"])
def test_a_score_in_a_file_keeps_the_rules_of_one_that_is_set(data: str) -> None:
    with pytest.raises(ParameterError, match=r"the score of a recording: \["):
        parse_score(Entry(Kind.SCORE, 0, 0, 0, 0, data.encode()))


def test_mistakes_get_a_clear_error(file: Path) -> None:
    sim, folder = Simulation(seed=1), file.parent
    (folder / "text.mcap").write_text("no recording")
    recorder = sim.record(file)
    with pytest.raises(ParameterError, match="note must be a text, but it was 5"):
        recorder.mark(5)
    recorder.close()
    for act, words in (
        (lambda: recorder.mark("late"), "Cannot set a bookmark: the recording is closed"),
        (lambda: sim.record(folder / "run.txt"), "must end in .mcap, but"),
        (lambda: sim.record(folder / "none" / "run.mcap"), "cannot"),
        (lambda: Recording(folder / "nothing.mcap"), "no such file"),
        (lambda: Recording(folder / "text.mcap"), "must be an MCAP file"),
    ):
        with pytest.raises(ParameterError, match=words):
            act()


def test_a_file_that_can_grow_no_more_is_read_up_to_there(file, monkeypatch, caplog):
    """The system refuses the middle of a chunk, as a full disk does."""
    monkeypatch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)
    sim, alone = Simulation(seed=1), Simulation(seed=1)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    recorder = sim.record(file)
    drive(sim, 1.0)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (file.stat().st_size + 1_000, before[1]))
        drive(sim, 5.0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    (line,) = caplog.messages
    assert "File too large" in line
    assert sim.loop.recorder is None
    drive(sim, 1.0)
    with pytest.raises(ParameterError, match="File too large"):
        recorder.close()
    for seconds in (1.0, 5.0, 1.0):
        drive(alone, seconds)
    assert sim.state_hash() == alone.state_hash()
    recording = Recording(file)
    assert not recording.is_whole
    assert recording.duration_s >= 2.0
    assert check_recording(recording.log).differs_ns is None


def disk(folder: Path, total: int, room: int) -> Callable[[Path], SimpleNamespace]:
    """Return what tells the usage of a folder's disk, which has room for so many bytes of files in that folder."""

    def usage(asked: Path) -> SimpleNamespace:
        assert asked == folder
        used = sum(each.stat().st_size for each in folder.iterdir())
        return SimpleNamespace(total=total, used=used, free=room - used)

    return usage


def test_a_recording_leaves_a_reserve_of_its_disk_free(file, monkeypatch, caplog):
    size = 5_000
    monkeypatch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)
    monkeypatch.setattr("shutil.disk_usage", disk(file.parent, 1 << 40, (128 << 20) + size))
    sim, alone = Simulation(seed=1), Simulation(seed=1)
    recorder = sim.record(file)
    drive(sim, 9.0)
    (line,) = caplog.messages
    assert "some of its disk free" in line
    recorder.mark("too late")
    recorder.say(0, "too late")
    with pytest.raises(ParameterError, match=r"has ended at \d\.0 s, and is whole up to there"):
        recorder.close()
    drive(alone, 9.0)
    assert sim.state_hash() == alone.state_hash()
    recording = Recording(file)
    assert recording.is_whole
    assert 1.0 < recording.duration_s < 9.0
    assert size <= file.stat().st_size < size + 30_000
    assert check_recording(recording.log).differs_ns is None
    assert "too late" not in recording.table("events")["text"]
    # There is no room for another one, which leaves an earlier file as it is.
    with pytest.raises(ParameterError, match=r"must leave 128 MiB of its disk free, but that of .* has 12[78] MiB"):
        sim.record(file)
    assert Recording(file).is_whole


def test_the_first_chunk_leaves_the_reserve_too(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _folder: SimpleNamespace(total=10**8, used=0, free=10**7))
    assert disk_space(file.parent) == (10**7, 5 * 10**6), "a share of a small disk"
    with Simulation(seed=1).record(file):
        pass
    before = file.read_bytes()
    monkeypatch.setattr("shutil.disk_usage", disk(file.parent, 3 << 20, (154 << 10) + len(before)))
    sim = Simulation()
    with pytest.raises(ParameterError, match="the recording cannot begin"):
        sim.record(file)
    assert sim.loop.recorder is None
    assert [(path, path.read_bytes()) for path in file.parent.iterdir()] == [(file, before)]


def test_a_recording_has_one_writer(file: Path) -> None:
    link = file.parent / "link.mcap"
    link.symlink_to(file)
    for _ in range(2):  # where there is no file, and where there is one
        sim = Simulation(seed=1)
        with sim.record(file):
            for seconds in (0.0, 2.0):
                drive(sim, seconds)
                for name in (file, link):
                    with pytest.raises(ParameterError, match="another run is writing it"):
                        Simulation().record(name)
        assert check_recording(Recording(file).log).equal_count == 3
    assert sorted(file.parent.iterdir()) == [link, file]


def test_until_something_has_happened_for_a_second_the_recording_of_before_stays(file, monkeypatch, caplog):
    monkeypatch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)
    with (sim := Simulation(seed=1)).record(file):
        drive(sim, 4.0)
    before = file.read_bytes()
    with Simulation().record(file) as recorder:
        recorder.say(0, "SyntaxError")
        assert file.read_bytes() == before
    assert "nothing has happened" in caplog.text
    assert [(path, path.read_bytes()) for path in file.parent.iterdir()] == [(file, before)]
    # A killed run leaves the recording of before, or its own without the last second.
    recorder = (sim := Simulation(seed=1)).record(file)
    for driven_s, found_s in ((0.5, 4.0), (1.0, 1.0), (1.0, 2.0)):
        drive(sim, driven_s)
        assert Recording(file).duration_s == pytest.approx(found_s, abs=0.05)
    recorder.close()
    assert Recording(file).is_whole
    with (other := Simulation()).record(file):
        other.place(1, 100, 100, 0)
    assert Recording(file).duration_s == 0


def test_a_world_without_a_robot_is_made_again_with_the_robot_that_comes_or_without(file):
    def act(sim):
        ball = sim.add_ball(100, 100)
        sim.move_body(ball, 100, 100, speed_mm_s=200.0)
        sim.run(1.2)
        assert sim.add_robot() == 1
        drive(sim, 1.5)

    sim = Simulation(Arena.box(500, 500), robots=0)
    recording = recorded(sim, file, act)
    check_again(recording, sim.state_hash())
    assert recording.world_at(1.0).robot_count == 0
    assert [len(recording.project_at(time_s).robots) for time_s in (1.0, 2.0)] == [0, 1]
    poses = recording.table("poses")
    assert set(poses["robot"]) == {1}
    assert poses["time_s"].min() >= 1.2 - 1e-9
    recording = recorded(Simulation(robots=0), file, lambda sim: sim.run(1.0))
    assert check_recording(recording.log).differs_ns is None
    assert len(recording.table("poses")) == 0
    with pytest.raises(ParameterError, match="must have a robot for this, but its world has none"):
        recording.table("readings", 1)


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A robot pushes a ball; then a wall and a second robot come, and a lamp goes out. Each second is a chunk."""
    file = tmp_path_factory.mktemp("recording") / "run.mcap"
    sim = Simulation(Arena.box(500, 400), seed=3)
    sim.place(1, 100, 200, 0.1)
    sim.add_ball(180, 200)
    sim.add_lamp(400, 100)
    robot = Khepera(sim.port(1))
    robot.set_speed(12, 11)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)
        with sim.record(file):
            while sim.time_s < 5.0:
                robot.proximity()
                if sim.time_s > 2 and sim.robot_count == 1:
                    sim.add_robot()
                    walls = np.flipud(sim.arena.brightness).copy()
                    walls[20:40, 20:40] = 200
                    sim.set_arena(Arena.from_array(walls))
                    sim.lamps[0, 3] = 0
    return Recording(file)


def test_moments_are_those_of_the_run_made_again(moving: Recording) -> None:
    chance = random.Random(1)
    times_ns = sorted(chance.randrange(moving.log.begin_ns, moving.log.end_ns) for _ in range(300))
    replay = moving.replay()
    for moment in moments(moving.log, times_ns):
        replay.sim.advance_to(moment.time_ns)
        replay.sim.sync()
        np.testing.assert_array_equal(moment.poses, replay.sim.poses()[: len(moment.poses)])
        places = replay.sim.look().places
        np.testing.assert_allclose(np.column_stack([moment.bodies["x_mm"], moment.bodies["y_mm"]]), places, atol=1e-9)
        np.testing.assert_array_equal(moment.saved.lamps, replay.sim.lamps)
        np.testing.assert_array_equal(moment.saved.arena.brightness, replay.sim.arena.brightness)
        assert len(moment.saved.specs) == replay.sim.robot_count


def test_moments_are_the_same_from_any_time_on(moving: Recording) -> None:
    begin_ns, end_ns = moving.log.begin_ns, moving.log.end_ns
    for start_s in (0.0, 0.995, 1.0, 1.0049, 2.0, 3.33):
        times_ns = list(range(max(round(start_s * 1e9), begin_ns), end_ns, 33_000_000))
        earlier_ns = range(begin_ns, times_ns[0], 7_000_000)
        whole = {each.time_ns: each for each in moments(moving.log, [*earlier_ns, *times_ns])}
        for moment in moments(moving.log, times_ns):
            np.testing.assert_array_equal(moment.poses, whole[moment.time_ns].poses)
            np.testing.assert_array_equal(moment.bodies, whole[moment.time_ns].bodies)


def test_moments_have_each_tick_passed_once(moving: Recording) -> None:
    begin_ns = moving.log.begin_ns
    every = moments(moving.log, list(range(begin_ns, moving.log.end_ns, 70_000_000)))
    numbers = [tick.number for moment in every for tick in moment.passed]
    assert numbers == list(range(begin_ns // 10**7 + 1, numbers[-1] + 1))
    assert len(numbers) > 480


def test_readings_of_moments_are_the_last_that_the_program_had(moving: Recording) -> None:
    table = moving.table("readings")
    for moment in moments(moving.log, list(range(500_000_000, moving.log.end_ns, 300_000_000))):
        row = np.searchsorted(table["time_s"], moment.time_ns / 1e9, side="right") - 1
        assert list(moment.readings[0]) == table["counts"][row].tolist()
