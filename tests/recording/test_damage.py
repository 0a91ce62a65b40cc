"""Recordings whose run was killed, that were cut off, or that hold anything: read as far as they go, or refused."""

import json
import random
import resource
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import lz4.frame
import numpy as np
import pytest
from mcap.opcode import Opcode
from tests.at_length import share
from tools.campaigns import recordings
from tools.campaigns.recordings import Parts, many_entries, sound, sound_parts, use

import kiks
from kiks.errors import KiksError, ParameterError
from kiks.recording.entries import Entry
from kiks.recording.mcap_file import McapReader
from kiks.recording.recorder import CHECK_NS
from kiks.recording.replay import check_recording
from kiks.sim.run_log import Kind

KILLS = share(1, 30)
"""How many runs are killed."""

CUTS = share(12, 1000)
"""How many recordings are cut off, and how many have bytes flipped."""

MEMORY_MB = 400
"""Most memory that reading may add, however little the file is [MB]."""

RUN = """
import sys, kiks
from kiks.recording import recorder
recorder.CHUNK_S = 0.0  # of a world in real time, each checkpoint makes a chunk
sim = kiks.Simulation(kiks.Arena.box(600, 300), seed=1)
sim.place(1, 100, 150, 0)
sim.add_ball(300, 150)
port = sim.port(1)
port.write(b"D,7,5\\n")
with sim.record(sys.argv[1]):
    while True:
        port.write(b"N\\n")
        sim.run(0.25)
        print(sim.now_ns, flush=True)
"""

SHOWS = "save_figures", "save_page", "save_film"
DRAWINGS = {name: share(lambda *_, **__: None, getattr(recordings, name)) for name in SHOWS}


def read(file: Path) -> None:
    """Do with a recording what `use` does; `make test` does not draw it, which takes most of the time and memory."""
    with patch.multiple(recordings, **DRAWINGS):
        use(file)


def refused(file: Path) -> str:
    """Return why a recording is refused."""
    with pytest.raises(KiksError) as caught:
        read(file)
    text = str(caught.value)
    assert text.isprintable()
    assert len(text) <= 500
    return text


def is_read(file: Path) -> bool:
    """Say whether a recording can be read; any error but KiKS's own goes on."""
    with suppress(KiksError):
        read(file)
        return True
    return False


# ---- a killed run ----


@pytest.mark.slow
def test_a_killed_run_lacks_at_most_a_second(file: Path) -> None:
    rng = random.Random(1)
    for _ in range(KILLS):
        run = subprocess.Popen([sys.executable, "-c", RUN, str(file)], stdout=subprocess.PIPE)
        with run, run.stdout as out:
            lines = [int(next(out)) for _ in range(rng.randint(1, 300))]
            for _ in range(rng.randint(0, 100_000)):
                pass
            run.kill()
            lines += [int(line) for line in out if line.endswith(b"\n")]
        recording = kiks.Recording(file)
        assert not recording.is_whole
        assert recording.log.end_ns >= lines[-1] - CHECK_NS
        checked = check_recording(recording.log)
        assert checked.differs_ns is None
        assert checked.equal_count == recording.log.end_ns // CHECK_NS


# ---- cut off, and flipped ----


def test_a_recording_can_be_cut_off_anywhere(file: Path) -> None:
    data, rng = sound(), random.Random(2)
    is_good = []
    for end in [*range(10), *(rng.randrange(len(data)) for _ in range(CUTS)), len(data) - 1]:
        file.write_bytes(data[:end])
        is_good.append(is_read(file))
    assert not any(is_good[:10])
    assert is_good[-1]
    use(file)


def test_flipped_bytes_are_noticed_or_lie_elsewhere(file: Path) -> None:
    """Whatever was flipped: what is said of the run is true."""
    data, rng = sound(), random.Random(3)
    file.write_bytes(data)
    recording = kiks.Recording(file)
    whole = recording.table("wheels")
    for _ in range(CUTS):
        flipped = bytearray(data)
        flipped[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        file.write_bytes(flipped)
        if is_read(file):
            recording = kiks.Recording(file)
            assert check_recording(recording.log).differs_ns is None
            assert np.isin(recording.table("wheels"), whole).all()


def test_a_flipped_byte_of_an_attachment_is_noticed(file: Path) -> None:
    data = sound()
    place = data.index(b"diameter_mm = 55.0") + len(b"diameter_mm = ")
    file.write_bytes(data[:place] + b"2" + data[place + 1 :])
    assert "whole attachments" in refused(file)


def with_entries(kind: Kind, /, **changes: int) -> Parts:
    return sound_parts().with_entry(lambda entry: entry.kind == kind, lambda entry: entry._replace(**changes))


def of_another_version(parts: Parts) -> Parts:
    return replace(parts, about={**parts.about, "layout": "other", "kiks": "9.9"})


def vast(parts: Parts) -> Parts:
    """Return parts whose arena takes gigabytes."""
    (name,) = (each for each in parts.attachments if each.endswith(".kiks"))
    arena = b"kiks = 1\n[walls]\nsize_mm = [1000000, 1000000]\n"
    return replace(parts, attachments={**parts.attachments, name: arena})


def test_parts_that_do_not_belong_together_are_refused(file: Path) -> None:
    sound_parts().save(file)
    use(file)  # parts that are written again are the same recording
    for change, words in (
        (lambda parts: replace(parts, blocks=[parts.blocks[0], *parts.blocks[2:]]), "a part is missing after 0.000 s"),
        (of_another_version, "KiKS 9.9"),
        (of_another_version, "Read it with that version"),
        (many_entries, "1000000 entries"),
        (vast, ""),
    ):
        change(sound_parts()).save(file)
        assert file.stat().st_size < 500_000
        assert words in refused(file)


def test_no_time_is_far_from_the_last_state(file: Path) -> None:
    with_entries(Kind.STATE, time_ns=10**18).save(file)
    recording = kiks.Recording(file)
    with pytest.raises(ParameterError, match=r"a state of 1\.200 s is at"):
        recording.replay()


# ---- what kernels trust ----


def test_no_state_holds_what_kernels_cannot_take(file: Path) -> None:
    for value, names in (
        (np.nan, "x_mm heading_rad"),
        (np.inf, "trail"),
        (-1001, "x_mm"),
        (1e300, "y_mm"),
        (1e9, "motor_speed velocity_x jaws hold_aside_mm"),
        (1e6, "kick_share"),
        (2.0**62, "battle_ns"),
        (200, "camera_period"),
        (17, "radio_to_length"),
        (7, "held_row"),
        (3, "holder motor_mode"),
        (0, "profile_acceleration radius_mm"),
        (-1, "holder friction_mm_s2"),
    ):
        for name in names.split():
            sound_parts().with_records(name, value).save(file)
            assert name.replace("trail", "") in refused(file)


def test_memory_of_turrets_holds_any_number(file: Path) -> None:
    for value in (np.nan, np.inf, -1e300):
        sound_parts().with_records("turret_memory", value).save(file)
        kiks.Recording(file).world_at(0.0).run(0.5)


def test_what_a_gripper_lifts_over_a_thin_wall_can_be_recorded(file: Path) -> None:
    sim = kiks.Simulation(kiks.Arena.box(300, 300, wall_mm=1), seed=1)
    sim.fit(1, "gripper")
    sim.place(1, 150, 150, 0)
    sim.add_ball(195, 150, radius_mm=10)
    port = sim.port(1)
    with sim.record(file):
        for command in (b"T,1,E,255\n", b"T,1,D,1\n", b"T,1,E,100\n", b"D,8,8\n"):
            port.write(command)
            sim.run(2.0)
    assert sim.bodies()["is_lifted"].all()
    assert sim.bodies()["x_mm"].max() > 300
    use(file)


def with_head(change: Callable[[dict[str, Any]], None]) -> Parts:
    def changed(entry: Entry) -> Entry:
        line, _, rest = entry.data.partition(b"\n")
        head = json.loads(line)
        change(head)
        return entry._replace(data=json.dumps(head).encode() + b"\n" + rest)

    return sound_parts().with_entry(lambda entry: entry.kind == Kind.STATE, changed)


def test_no_state_lies_about_itself(file: Path) -> None:
    for change, words in (
        (lambda head: head.update(robots=[]), ""),
        (lambda head: head.update(robots=2), ""),
        (lambda head: head.update(robots=[{}] * 2), ""),
        (lambda head: head.update(bodies=99_999), ""),
        (lambda head: head.update(lamps=-1), ""),
        (lambda head: head.update(tick_count=2**62), ""),
        (lambda head: head.update(now_ns=10**18), ""),
        (lambda head: head.update(arena="world/0.kiks"), ""),
        (lambda head: head.update(arena="programs/1-cash$_$.py"), ""),
        (lambda head: head.update(arena=head["robots"][0]["kind"]), "kiks must be 1"),
        (lambda head: head.update(seed=-1), ""),
        (lambda head: head["robots"][0]["wire"].update(partial="\u20ac"), "partial"),
        (lambda head: head["robots"][0].update(kind="world/0.toml"), ""),
        (lambda head: head["robots"][0].update(turrets=["k999"]), ""),
        (lambda head: head["robots"][0].update(turrets=[{"number": 24}]), ""),
    ):
        with_head(change).save(file)
        assert words in refused(file)


# ---- the log ----


def test_no_entry_of_the_log_holds_anything(file: Path) -> None:
    for kind, changes in (
        (Kind.CHECK, {"time_ns": 2**62}),
        (Kind.CHECK, {"time_ns": 0}),
        (Kind.SEND, {"time_ns": -5}),
        (Kind.SEND, {"number": -(2**63)}),
        (Kind.SEND, {"robot": 2**16 - 1}),
        (Kind.SEND, {"kind": Kind.SET_BAUD, "number": 0}),
        (Kind.SEND, {"kind": 255}),
        (Kind.SEND, {"kind": Kind.STATE}),
        (Kind.STATE, {"kind": Kind.TEXT}),
    ):
        with_entries(kind, **changes).save(file)
        refused(file)


@pytest.mark.parametrize("reply", [b"n,1,2,3,4,5,6,7,x\r\n", b"n," + b"9" * 5000 + b",0" * 7 + b"\r\n"])
def test_replies_that_are_no_readings_are_none(reply: bytes, file: Path) -> None:
    parts = sound_parts()
    parts.save(file)
    readings = kiks.Recording(file).table("readings")
    first, *others = parts.blocks
    replace(parts, blocks=[[*first, first[-1]._replace(kind=Kind.ACT, data=reply)], *others]).save(file)
    np.testing.assert_array_equal(kiks.Recording(file).table("readings"), readings)


def test_a_loop_that_prints_and_changes_things_is_within_those_limits(file: Path) -> None:
    sim = kiks.Simulation(kiks.Arena.box(300, 300), robots=0, seed=1)
    with sim.record(file) as recorder:
        for _ in range(60):
            sim.remove_body(sim.add_ball(100, 100))
            for _ in range(300):
                recorder.say(0, "")
            sim.run(0.01)
    recording = kiks.Recording(file)
    assert len(recording.table("events")) > 60 * 300
    assert recording.table("poses").size == 0


def chunk(inside: bytes, begin_ns: int = 0, declared: int | None = None) -> bytes:
    """Return the record of a chunk that says its own size or another one."""
    packed = lz4.frame.compress(inside)
    words = np.array([begin_ns, begin_ns, len(inside) if declared is None else declared], "<u8").tobytes() + bytes(4)
    body = words + b"\x03\0\0\0lz4" + len(packed).to_bytes(8, "little") + packed
    return bytes([Opcode.CHUNK]) + len(body).to_bytes(8, "little") + body


@pytest.mark.parametrize("more", [bytes([0x77]) + bytes(8), bytes([Opcode.METADATA, 30]) + bytes(7 + 30)])
def test_a_chunk_has_messages_and_what_they_need_alone(more: bytes, file: Path) -> None:
    file.write_bytes(sound())
    reader = McapReader(file)
    last = reader.chunks[-1]
    other = chunk(more + b"".join(reader._inside(last)), last.begin_ns)
    file.write_bytes(sound()[: last.offset] + other + sound()[last.offset + last.length :])
    assert "whole records" in refused(file)


# ---- memory ----


def test_a_file_takes_no_more_memory_than_its_size_allows(file: Path) -> None:
    data = sound()
    for tail in (  # bombs, a lie, an endless record, a terabyte
        lambda: chunk(bytes(1 << 30), declared=1000),
        lambda: chunk(bytes(1 << 30)),
        lambda: chunk(bytes(1000), declared=2**63),
        lambda: bytes([Opcode.CHUNK]) + b"\xff" * 8,
        lambda: bytes([Opcode.ATTACHMENT]) + (1 << 40).to_bytes(8, "little"),
    ):
        file.write_bytes(data[: data.rindex(bytes([Opcode.DATA_END, 4]) + bytes(7))] + tail())
        size = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        before = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (size + (MEMORY_MB << 20), before[1]))
        try:
            is_read(file)
        finally:
            resource.setrlimit(resource.RLIMIT_AS, before)


def test_a_table_of_texts_is_no_larger_than_memory(file: Path) -> None:
    parts = sound_parts()
    long, short = (Entry(Kind.TEXT, 0, 0, 0, 0, b"x" * length) for length in (10**6, 1))
    first, *others = parts.blocks
    replace(parts, blocks=[[*first, long, *[short] * 1000], *others]).save(file)
    recording = kiks.Recording(file)
    with pytest.raises(ParameterError, match="fit into a table"):
        recording.table("events")
