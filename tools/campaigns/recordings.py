"""Recordings with any part replaced: what no flipped byte reaches, as chunks are compressed and have checksums."""

from __future__ import annotations

import json
import random
import tempfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from tools.campaigns.hostile import NUMBERS, mutated, mutated_text

import kiks
from kiks.engine.state import BODY, ROBOT
from kiks.export.figures import save_figures
from kiks.export.film import save_film
from kiks.export.page import save_page
from kiks.recording.entries import Entry, pack_entries, unpack_entries
from kiks.recording.log import HASH_LENGTH, has_state
from kiks.recording.mcap_file import McapFile, McapReader
from kiks.recording.recorder import PROGRAMS, RunRecorder
from kiks.recording.replay import check_recording
from kiks.recording.tables import TABLES
from kiks.sim.run_log import Kind


@dataclass(frozen=True)
class Parts:
    """What a recording consists of.

    Args:
        attachments: Its attachments, by name.
        about: Its metadata.
        blocks: For each chunk the entries of the log.
    """

    attachments: dict[str, bytes]
    about: dict[str, str]
    blocks: list[list[Entry] | bytes] = field(default_factory=list)

    @classmethod
    def of(cls, path: Path) -> Parts:
        """Return the parts of a recording."""
        reader = McapReader(path)
        parts = cls(dict(reader.attachments), dict(reader.about))
        for block in reader.blocks:
            parts.blocks.append(unpack_entries(reader.read(block), "log"))
        return parts

    def save(self, path: Path) -> None:
        """Write a recording of these parts."""
        file = McapFile(path)
        for name, data in self.attachments.items():
            file.attach(name, data, "application/json")
        file.describe("run", self.about)
        for entries in self.blocks:
            time_ns, log = 0, entries
            if not isinstance(entries, bytes):
                time_ns = min(max(entries[0].time_ns, 0), 2**63) if entries else 0
                log = pack_entries([value for entry in entries for value in entry])
            file.write(time_ns, log)
        file.close()

    def with_entry(self, is_meant: Callable[[Entry], bool], change: Callable[[Entry], Entry]) -> Parts:
        """Return these parts with the entries changed that are meant."""
        blocks = [[change(each) if is_meant(each) else each for each in rows] for rows in self.blocks]
        return replace(self, blocks=blocks)

    def with_records(self, name: str, value: float) -> Parts:
        """Return these parts with a field of all robots' or all bodies' records in all states set to a number."""
        return self.with_entry(has_state, lambda entry: _set(entry, name, value))


def _set(entry: Entry, name: str, value: float) -> Entry:
    """Return a state with a field of its records set to a number."""
    begin = HASH_LENGTH if entry.kind == Kind.CHECK else 0
    end = entry.data.index(b"\n", begin) + 1
    head = json.loads(entry.data[begin:end])
    records = bytearray(entry.data[end:])
    robot_count = len(head["robots"])
    robots: Any = np.frombuffer(records, ROBOT, robot_count)
    bodies: Any = np.frombuffer(records, BODY, head["bodies"], robot_count * ROBOT.itemsize)
    with np.errstate(invalid="ignore"):
        for each in (robots, bodies):
            if name in each.dtype.names:
                each[name] = np.float64(value).astype(each.dtype[name].base)
    return entry._replace(data=entry.data[:end] + bytes(records))


@cache
def sound() -> bytes:
    """Return a recording in which much happens."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sound.mcap"
        sim = kiks.Simulation(kiks.Arena.box(300, 300), robots=2, seed=1)
        for turret in ("k213", "gripper"):
            sim.fit(1, turret)
        sim.add_ball(150, 200, radius_mm=15)
        # Each checkpoint makes a chunk, however fast this computer is.
        programs = {"1-cash$_$.py": "import serial\n"}
        with patch("kiks.recording.recorder.CHUNK_S", 0.0), RunRecorder(sim, file, programs=programs) as recorder:
            port = sim.port(1)
            port.write(b"D,9,-7\nN\nT,1,D,1\nT,2,N\n")
            sim.run(1.2)
            recorder.mark("a note")
            recorder.say(0, "a line")
            sim.add_lamp(100, 100)
            sim.add_cylinder(60, 240)
            sim.port(2).write(b"D,3,2\nO\nC,9,9\n")
            sim.run(1.1)
        return file.read_bytes()


@cache
def sound_parts() -> Parts:
    """Return the parts of that recording."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sound.mcap"
        file.write_bytes(sound())
        return Parts.of(file)


def strange_recording(rng: random.Random) -> bytes:
    """Return a recording with a few hostile parts, whose checksums are right."""
    parts = sound_parts()
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        parts = rng.choice((_attachment, _state_text, _state_bytes, _field, _numbers, _numbers, _rows, _program))(
            rng, parts
        )
    if rng.random() < 0.03:
        parts = many_entries(parts)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "strange.mcap"
        parts.save(file)
        return file.read_bytes()


def _attachment(rng: random.Random, parts: Parts) -> Parts:
    name = rng.choice(list(parts.attachments))
    data = mutated_text(rng, parts.attachments[name], list(parts.attachments.values()), is_json=True)
    return replace(parts, attachments={**parts.attachments, name: data})


def _is_state(rng: random.Random) -> Callable[[Entry], bool]:
    return lambda entry: has_state(entry) and rng.random() < 0.5


def _state_text(rng: random.Random, parts: Parts) -> Parts:
    def change(entry: Entry) -> Entry:
        begin = HASH_LENGTH if entry.kind == Kind.CHECK else 0
        end = entry.data.find(b"\n", begin) % (len(entry.data) + 1)
        text = mutated_text(rng, entry.data[begin:end], is_json=True)
        return entry._replace(data=entry.data[:begin] + text + entry.data[end:])

    return parts.with_entry(_is_state(rng), change)


def _state_bytes(rng: random.Random, parts: Parts) -> Parts:
    return parts.with_entry(_is_state(rng), lambda entry: entry._replace(data=mutated(rng, entry.data)))


def _field(rng: random.Random, parts: Parts) -> Parts:
    name = rng.choice((*ROBOT.names, *BODY.names))
    try:
        return parts.with_records(name, float(rng.choice(NUMBERS)))
    except (
        ValueError,
        OverflowError,
        KeyError,
        TypeError,
        RecursionError,
    ):  # another mutation has left no records there
        return parts


def _numbers(rng: random.Random, parts: Parts) -> Parts:
    place = rng.choice(("kind", "time_ns", "robot", "number", "other"))
    low, high = {"kind": (0, 255), "robot": (0, 65535)}.get(place, (-(2**63), 2**63 - 1))
    value = rng.choice([number for number in NUMBERS if isinstance(number, int) and low <= number <= high])
    kind = rng.choice(list(Kind))
    if place == "kind" and rng.random() < 0.5:
        value = int(rng.choice(list(Kind)))
    return parts.with_entry(lambda entry: entry.kind == kind, lambda entry: entry._replace(**{place: value}))


def _rows(rng: random.Random, parts: Parts) -> Parts:
    """Return parts with other rows, blocks or data of entries."""
    blocks = list(parts.blocks)
    choice, number = rng.random(), rng.randrange(len(blocks))
    entries = blocks[number]
    if choice < 0.2:
        del blocks[number]
    elif choice < 0.4:
        blocks.insert(rng.randrange(len(blocks)), blocks[number])
    elif choice < 0.6:
        blocks[number] = rng.sample(entries, rng.randint(0, len(entries)))
    else:
        blocks[number] = [
            each._replace(data=mutated(rng, each.data)) if rng.random() < 0.3 else each for each in entries
        ]
    return replace(parts, blocks=blocks or parts.blocks)


def _program(rng: random.Random, parts: Parts) -> Parts:
    """Return parts with another program."""
    name = rng.choice(("a.py", "$x^$.py", "<b>.py", "\\$.txt", "\0.py", "n" * 5000))
    text = rng.choice((b" \n" * 90_000, b"\r \x0c" * 60_000, b"(" * 100_000, b'f"{' * 40_000, b"\xff\0</script>"))
    return replace(parts, attachments={**parts.attachments, f"{PROGRAMS}1-{name}": text})


def many_entries(parts: Parts) -> Parts:
    """Return parts with a million empty lines of output."""
    time_ns = max((each.time_ns for each in parts.blocks[-1] if isinstance(each, Entry)), default=0)
    return replace(parts, blocks=[*parts.blocks, pack_entries([Kind.TEXT, time_ns, 0, 0, 0, b""] * 1_000_000)])


def use(path: Path) -> None:
    """Do with a recording all that can be done; what is refused in one part may be done in others.

    Raises:
        KiksError: If anything was refused.
    """
    errors = []

    def attempt(act: Callable[[], object]) -> None:
        try:
            act()
        except kiks.KiksError as error:
            errors.append(error)

    recording = kiks.Recording(path)
    for name in TABLES:
        attempt(lambda name=name: recording.table(name))  # type: ignore[misc]
    attempt(lambda: check_recording(recording.log))
    attempt(lambda: _go_on(recording))
    attempt(lambda: repr(recording) and recording.programs and recording.project.to_bytes())
    # The same file is always shown in the same way: each takes as long as all the rest.
    shows = (
        lambda: save_figures([recording], path.with_suffix(".svg")),
        lambda: save_page(recording, path.with_suffix(".html")),
        lambda: save_film(recording, path.with_suffix(".gif"), size=(160, 120), fps=4),
    )
    attempt(shows[zlib.crc32(path.read_bytes()) % len(shows)])
    if errors:
        raise errors[0]


def _go_on(recording: kiks.Recording) -> None:
    """Look at the world in the middle, and let it go on."""
    sim = recording.world_at((recording.log.begin_ns + recording.log.end_ns) / 2e9)
    sim.run(0.5)
    sim.look()
    sim.state_hash()
