"""Every kind of file that KiKS reads, mutated, read, and what was read used as it would be."""

from __future__ import annotations

import io
import math
import random
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from tools.campaigns.hostile import BYTES_MAX, NUMBERS, hostile_value, mutated, mutated_text
from tools.campaigns.runner import SECRET, Campaign, Play

import kiks
from kiks.clock.thinking import parse_thinking
from kiks.desk.folder import decode
from kiks.fit.models import thesis
from kiks.fit.samples import load_samples, nearnesses
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.arena_file import save_arena
from kiks.model.kad import encode_kad
from kiks.model.network import THESIS, NetworkResponse
from kiks.model.project import Project, ProjectRobot
from kiks.sim.building import simulation_of
from kiks.sim.simulation import Simulation
from kiks.toolbox.host import Door

CASES = 10_000
"""Mutations of each kind of file."""

MEMORY_MB = 2000
"""Most memory for a file [MB]."""

CELLS_MAX = 2_000_000
"""Larger arenas are read, and driven in but seldom: that takes many seconds and is right."""

BOMB_BYTES = 900 << 20
"""What a bomb of less than 1 MB unpacks to."""


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Args:
        name: What the campaign is called.
        file: Its name in its folder.
        sound: Good files of the kind.
        read: Reads one and uses what it has read.
        text: Whether it is 'toml' or 'json', or neither.
        strange: What makes files of the kind that mutations would hardly find.
        beside: Other files of the folder.
    """

    name: str
    file: str
    sound: Sequence[bytes]
    read: Callable[[Path], object]
    text: str = ""
    strange: Sequence[Callable[[random.Random], bytes]] = ()
    beside: tuple[tuple[str, bytes], ...] = ()

    def make(self, rng: random.Random) -> bytes:
        """Return a hostile file."""
        data, choice = rng.choice(self.sound), rng.random()
        if self.strange and choice < 0.4:
            return rng.choice(self.strange)(rng)
        if self.text and choice < 0.85:
            return mutated_text(rng, data, self.sound, is_json=self.text == "json")
        return mutated(rng, data, self.sound)

    def prepare(self) -> Play:
        """Return what plays a case."""

        def play(rng: random.Random) -> None:
            with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
                for name, data in self.beside:
                    (Path(folder) / name).write_bytes(data)
                file = Path(folder) / self.file
                file.parent.mkdir(exist_ok=True)
                file.write_bytes(self.make(rng)[:BYTES_MAX])
                self.read(file)

        return play


# ---- what is done with what was read ----


def drive(sim: Simulation) -> None:
    """Let the robots of a world sense and drive."""
    for number in range(1, min(sim.robot_count, 3) + 1):
        port = sim.port(number)
        port.timeout = 5.0
        port.write(b"D,9,-7\nN\nO\nE\n")
        port.read(200)
        if sim.turrets(number):
            port.write(b"T,2,N\nT,1,F\n")
            port.read(400)
    sim.run(0.05)
    sim.look()
    sim.state_hash()


def drive_in(arena: Arena) -> None:
    """Let a robot drive in an arena."""
    if arena.brightness.size <= CELLS_MAX:
        drive(Simulation(arena, robots=max(1, min(len(arena.starts), 20)), seed=1))


def _robot(path: Path) -> None:
    drive(Simulation(_BOX, robot=[str(path), "khepera"], seed=1))


def _project(path: Path) -> None:
    project = Project.load(path)
    project.to_bytes()
    if project.arena.brightness.size <= CELLS_MAX and len(project.robots) <= 20:
        drive(simulation_of(project, path.parent))


def _uploaded(path: Path) -> None:
    project = decode(path.name, path.read_bytes())
    if project.arena.brightness.size <= CELLS_MAX and len(project.robots) <= 20:
        drive(simulation_of(project, path.parent))


def _champion(path: Path) -> None:
    champion = kiks.Champion.load(path)
    sim, ports = champion.simulation(_BOX, seed=1)
    driver = champion.driver(ports)
    for _ in range(3):
        driver.step()
    sim.state_hash()


def _evolution(path: Path) -> None:
    folder = path.parent if path.name == "evolution.json" else path.parents[1]
    evolution = kiks.Evolution(_task(), "ga", seed=3, population=4, folder=folder)
    evolution.ask()
    if evolution.generations:
        evolution.champion._text({})


def _network(path: Path) -> None:
    thesis(_SAMPLES[0], NetworkResponse.load(path))


def _samples(path: Path) -> None:
    samples = load_samples(path)
    if samples.counts.size <= 100_000:
        nearnesses(samples, _FAN)


def _replay(path: Path) -> None:
    sim = Simulation(_BOX, thinking=f"replay:{path}", seed=1)
    parse_thinking(f"replay:{path}")
    drive(sim)


# ---- strange files ----


def _bomb(kind: str) -> bytes:
    """Return zeros without end, packed: a deflate stream of far less than a thousandth."""
    packer = zlib.compressobj(9, zlib.DEFLATED, 15 if kind == "zlib" else -15)
    block = bytes(1 << 20)
    return b"".join(packer.compress(block) for _ in range(BOMB_BYTES >> 20)) + packer.flush()


_BOMBS: dict[str, bytes] = {}


def bomb(kind: str) -> bytes:
    """Return a bomb, made when it is first asked for."""
    if kind not in _BOMBS:
        _BOMBS[kind] = _bomb(kind)
    return _BOMBS[kind]


def npy(header: bytes, data: bytes, version: int = 1) -> bytes:
    """Return a .npy file with any header."""
    size = struct.pack("<H" if version == 1 else "<I", len(header) % (65536 if version == 1 else 1 << 32))
    return b"\x93NUMPY" + bytes([version, 0]) + size + header + data


_DESCRIPTIONS = (
    "<f8",
    "<i8",
    "|O",
    "<c16",
    "|S5",
    "<U3",
    "<M8[s]",
    "|V8",
    "<f2",
    "|b1",
    "<f4",
    ">i4",
    "<u8",
    "|i1",
    "x" * 300,
)
_SHAPES = (
    "()", "(1,)", "(0,)", "(3, 4)", "(10**12,)", "(1000000000000,)", "(4611686018427387904, 4)", "(-1,)", "(2.5,)",
    "(True,)",
    "(9" * 1 + "9" * 400 + ",)", "'a'", "(" * 200 + ")" * 200, "None", "(1, 1, 8)", "(65536, 65536)",
)  # fmt: skip


def _strange_npy(rng: random.Random) -> bytes:
    if rng.random() < 0.2:
        header = rng.choice(
            (b"(" * 50_000, b"{" * 3000, b"[" * 90 + b"]" * 90, b"-" * 9000 + b"1", b"\xff" * 100, SECRET.encode())
        )
    else:
        shape, order = rng.choice(_SHAPES), rng.choice(("False", "True", "None"))
        header = f"{{'descr': '{rng.choice(_DESCRIPTIONS)}', 'fortran_order': {order}, 'shape': {shape}}}".encode()
    return npy(header.ljust(118) + b"\n", rng.randbytes(rng.choice((0, 8, 96, 800))), rng.choice((1, 1, 2, 3, 9)))


def _hostile_array(rng: random.Random, array: Any) -> Any:
    """Return an array with other numbers, or of another kind or shape."""
    array = np.array(array)
    choice = rng.randrange(9)
    if choice < 4:
        wide = array.astype(rng.choice((np.float64, np.float64, np.int64, np.float32, np.complex128)))
        for _ in range(rng.choice((1, 3))):
            with np.errstate(all="ignore"), suppress(OverflowError, ValueError, IndexError):
                wide.flat[rng.randrange(max(wide.size, 1))] = rng.choice(NUMBERS)
        return wide
    if choice == 4:
        return array.astype(
            rng.choice((np.complex128, np.float16, np.int8, np.uint64, np.bool_, "S5", "U5", np.float32))
        )
    if choice == 5:
        return array.reshape(rng.choice(((-1,), (1, *array.shape), (*array.shape, 1), array.shape[::-1])))
    if choice == 6:
        return array[: rng.randint(0, len(array))] if array.ndim else array
    if choice == 7:
        return np.full(array.shape, rng.choice((np.nan, np.inf, -1.0, 1e308, 5e-324)))
    value = hostile_value(rng)
    try:
        return np.array(value) if np.array(value).dtype.kind != "O" else array
    except (ValueError, TypeError, RecursionError, OverflowError):
        return array


def _strange_npz(members: dict[str, Any], rng: random.Random) -> bytes:
    """Return a zip of arrays that are not what they should be."""
    file = io.BytesIO()
    method = rng.choice(
        (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    )
    chosen = rng.choice(list(members))
    if rng.random() < 0.03:
        return _zip_bomb(f"{chosen}.npy", rng)
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, array in members.items():
            data = io.BytesIO()
            np.save(data, _hostile_array(rng, array) if name == chosen else array, allow_pickle=False)
            written = data.getvalue()
            if name == chosen and rng.random() < 0.3:
                written = _strange_npy(rng) if rng.random() < 0.7 else mutated(rng, written)
            archive.writestr(f"{name}.npy" if rng.random() < 0.95 else rng.choice((name, "../x.npy", SECRET)), written)
    data = bytearray(file.getvalue())
    if rng.random() < 0.15:
        # Another method of compression, or the mark of one that is encrypted, in the heads of all members.
        for mark, place in ((b"PK\x01\x02", 8), (b"PK\x03\x04", 6)):
            begin = data.find(mark)
            word = rng.choice(
                ((1).to_bytes(2, "little") + b"\0\0", b"\0\0" + rng.choice((1, 6, 9, 12, 14, 99)).to_bytes(2, "little"))
            )
            while begin >= 0 and len(data) >= begin + place + 4:
                data[begin + place : begin + place + 4] = word
                begin = data.find(mark, begin + 4)
    return bytes(data)


def _zip_bomb(name: str, rng: random.Random) -> bytes:
    """Return a zip whose only member is a bomb behind the head of an array."""
    count = BOMB_BYTES // 8
    head = npy(f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({count},)}}".encode().ljust(118) + b"\n", b"")
    packer = zlib.compressobj(0, zlib.DEFLATED, -15)
    content = packer.compress(head) + packer.flush(zlib.Z_FULL_FLUSH) + bomb("deflate")
    size, crc = len(head) + BOMB_BYTES, rng.getrandbits(32)
    label = name.encode()
    common = struct.pack("<HHHHHIIIHH", 20, 0, 8, 0, 0x21, crc, len(content), size, len(label), 0)
    local = b"PK\x03\x04" + common + label + content
    central = b"PK\x01\x02" + struct.pack("<H", 20) + common + struct.pack("<HHHII", 0, 0, 0, 0, 0) + label
    return local + central + b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 1, 1, len(central), len(local), 0)


def _mat_element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def _strange_mat(rng: random.Random) -> bytes:
    """Return a MATLAB file with a matrix that does not fit itself."""
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    if rng.random() < 0.05:
        return head + struct.pack("<II", 15, len(bomb("zlib"))) + bomb("zlib")
    numbers = [rng.choice(NUMBERS) for _ in range(rng.choice((0, 1, 2, 12)))]
    dims_kind, shape_code = rng.choice(
        ((5, "i"), (9, "d"), (9, "d"), (7, "f"), (12, "q"), (13, "Q"), (1, "b"), (16, "i"), (99, "i"))
    )
    shape = [
        rng.choice((0, 1, -1, 2, 7, 300, 2**31 - 1, 2**40, math.inf, math.nan, 1e300, 0.5))
        for _ in range(rng.choice((1, 2, 2, 2, 3, 33)))
    ]
    content, sound = b"", b""
    for value in shape:
        try:
            sound += struct.pack(f"<{shape_code}", value if shape_code in "df" else int(value))
        except (struct.error, ValueError, OverflowError):
            sound += b"\xff" * struct.calcsize(f"<{shape_code}")
    if rng.random() < 0.5:
        numbers = [12.0, 9.0, *numbers]
        sound, dims_kind = struct.pack("<ii", 1, len(numbers)), 5
    for number in numbers:
        content += struct.pack("<d", number if abs(number) < 1e308 or number != number else math.inf)
    flags = struct.pack("<II", rng.choice((6, 6, 6, 7, 13, 4, 1, 6 | 0x0800)), 0)
    name = rng.choice((b"walls", b"walls", b"starts", b"balls", SECRET.encode(), b"\xff\0"))
    matrix = _mat_element(6, flags) + _mat_element(dims_kind, sound) + _mat_element(1, name)
    matrix = _mat_element(14, matrix + _mat_element(rng.choice((9, 9, 9, 7, 14, 15, 0)), content))
    if rng.random() < 0.4:
        packed = zlib.compress(matrix * rng.choice((1, 1, 3, 1000)))
        matrix = struct.pack("<II", 15, len(packed)) + packed
    return head + matrix * rng.choice((1, 2, 100))


def _strange_kad(rng: random.Random) -> bytes:
    """Return a .kad file that is a sound MATLAB file of numbers that are none of an arena."""
    from scipy.io import savemat

    walls = [rng.choice((120, 300, 300, 8000, 65535)), rng.choice((120, 200, 8000, 65535))]
    for _ in range(rng.choice((0, 1, 1, 5, 200))):
        x, y = sorted(rng.randint(0, 310) for _ in "12"), sorted(rng.randint(0, 210) for _ in "12")
        walls += [4, x[0], x[1], x[1], x[0], y[0], y[0], y[1], y[1], rng.choice((0, 1, 255, 256))]
    if rng.random() < 0.3:
        walls[rng.randrange(len(walls))] = rng.choice([n for n in NUMBERS if abs(n) < 1e308 or n != n])
    found: dict[str, Any] = {"walls": np.array([walls], np.float64)}
    for label, width in (("starts", 3), ("lamps", 4), ("balls", 5), ("cylinders", 5)):
        if rng.random() < 0.4:
            rows = np.array([[150.0, 100.0, 1.0, 20.0, 255.0][:width]] * rng.choice((1, 1, 2, 1001)))
            found[label] = _hostile_array(rng, rows)
    file = io.BytesIO()
    savemat(
        file,
        {name: array for name, array in found.items() if array.dtype.kind in "fiub"},
        do_compression=rng.random() < 0.5,
    )
    return file.getvalue()


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _strange_png(rng: random.Random) -> bytes:
    """Return a PNG with any head and any other chunks, all of them with the right check sum."""
    width, height = (rng.choice((0, 1, 99, 100, 300, 8000, 65535, 2**31 - 1, 2**32 - 1)) for _ in "12")
    depth, colour = rng.choice((1, 2, 4, 8, 8, 16, 3)), rng.choice((0, 0, 2, 3, 4, 6, 9))
    head = _chunk(
        b"IHDR",
        struct.pack(">IIBBBBB", width, height, depth, colour, rng.choice((0, 0, 0, 1)), 0, rng.choice((0, 0, 1))),
    )
    image = zlib.compress(bytes(300 * 301)) if rng.random() < 0.7 else bomb("zlib")
    others = (
        _chunk(b"zTXt", b"a\0\0" + bomb("zlib")), _chunk(b"iCCP", b"a\0\0" + bomb("zlib")), _chunk(b"PLTE",
        b"\1\2\3" * rng.choice((1, 256, 400))),
        _chunk(b"tRNS", b"\0" * rng.choice((1, 2, 6, 300))), _chunk(b"gAMA", b""), _chunk(b"eXIf", rng.randbytes(30)),
        _chunk(b"pHYs", b"\xff" * 9),
        _chunk(b"acTL", struct.pack(">II", 2**31, 0)), _chunk(b"IDAT", b""), _chunk(b"iTXt",
        b"a\0\1\0\0\0" + bomb("zlib")),
    )  # fmt: skip
    middle = b"".join(rng.choice(others) for _ in range(rng.choice((0, 0, 1, 3))))
    return b"\x89PNG\r\n\x1a\n" + head + middle[: BYTES_MAX // 2] + _chunk(b"IDAT", image) + _chunk(b"IEND", b"")


def _strange_netpbm(rng: random.Random) -> bytes:
    kind = rng.choice((b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"P7", b"Pf", b"PF"))
    sizes = b" ".join(str(rng.choice((0, 1, 120, 300, 8000, 65536, -5, 10**30))).encode() for _ in "12")
    depth = rng.choice((b"255", b"65535", b"1", b"0", b"-1", b"9" * 400, b"nan", SECRET.encode()))
    return (
        kind
        + b"\n# "
        + SECRET.encode()
        + b"\n"
        + sizes
        + b"\n"
        + depth
        + b"\n"
        + rng.randbytes(rng.choice((0, 9, 40_000)))
    )


# ---- sound files ----


def _picture_bytes(suffix: str) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    raster = np.zeros((120, 140), np.uint8)
    raster[:10], raster[60:70, 30:90] = 255, 128
    Image.fromarray(raster).save(file, suffix)
    return file.getvalue()


def _arena() -> Arena:
    box = Arena.box(300, 260, rounded_mm=40)
    return Arena(
        box.brightness, 1.0, "sound", (Pose(100.0, 100.0, 1.0), Pose(200.0, 120.0, -2.0)), (Lamp(50.0, 50.0, 1.0),),
        (Ball(150.0, 200.0),), (Cylinder(220.0, 200.0),),
    )  # fmt: skip


def _npz(**arrays: Any) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


@cache
def _task() -> kiks.Task:
    return kiks.tasks.avoid(seconds=1.0, worlds=3)


def _evolved() -> tuple[bytes, bytes, dict[str, Any]]:
    """Return what an evolution leaves: its identity, its first generation, and the arrays of that."""
    with tempfile.TemporaryDirectory() as folder:
        evolution = kiks.Evolution(_task(), "ga", seed=3, population=4, folder=folder)
        asked = evolution.ask()
        evolution.tell(np.linspace(0.0, 1.0, 4))
        identity = (Path(folder) / "evolution.json").read_bytes()
        generation = (Path(folder) / "generations" / "000001.npz").read_bytes()
    return (
        identity,
        generation,
        {"candidates": asked, "values": np.linspace(0.0, 1.0, 4)[:, None], "seconds": np.float64(1.0)},
    )


_ARENA_TOML = b"""name = "sound"
size_mm = [300, 260]
wall_mm = 10
rounded_mm = 30
brightness = 200
[[start]]
at_mm = [100, 100]
heading_deg = 45
[[lamp]]
at_mm = [50.5, 60]
power_w = 1.0
is_on = true
[[ball]]
at_mm = [150, 200]
radius_mm = 20.0
friction_mm_s2 = 20.0
brightness = 255
[[cylinder]]
at_mm = [220, 200]
radius_mm = 14
"""

_PROJECT_EXTRA = b"""
[[robot]]
name = "one"
kind = "own.toml"
turrets = ["k213", "gripper"]
arguments = ["a"]
brightness = 90
"""

_TEXT_SAMPLES = (
    "8 2 3 5 2\n" + "".join(f"TURN {n}\n0 1 2 3 4 5 6 1023\n9 8 7 6 5 4 3 2\n" for n in range(3)) + "END\n"
).encode()


def _kinds() -> Iterator[Kind]:
    robots = [path.read_bytes() for path in _files("robots") if path.name.endswith(".toml")]
    yield Kind("robot", "own.toml", robots, _robot, "toml")

    with tempfile.TemporaryDirectory() as folder:
        save_arena(_arena(), Path(folder) / "sound.toml")
        pictured, png = (Path(folder) / "sound.toml").read_bytes(), (Path(folder) / "sound.png").read_bytes()
    yield Kind(
        "arena",
        "own.toml",
        [_ARENA_TOML, pictured],
        lambda path: drive_in(Arena.load(path)),
        "toml",
        beside=(("sound.png", png),),
    )

    pictures = {
        suffix: _picture_bytes(kind)
        for suffix, kind in (("png", "PNG"), ("tif", "TIFF"), ("bmp", "BMP"), ("pgm", "PPM"), ("jpg", "JPEG"))
    }
    strange = {"png": (_strange_png,), "pgm": (_strange_netpbm,)}
    for suffix, data in pictures.items():
        yield Kind(
            suffix, f"own.{suffix}", [data], lambda path: drive_in(Arena.load(path)), strange=strange.get(suffix, ())
        )
    beside = tuple((name, data) for name, data in (("own.toml", pictured.replace(b"sound.png", b"own.png")),))
    yield Kind(
        "arena_picture",
        "own.png",
        [png, *pictures.values()],
        lambda path: drive_in(Arena.load(path.with_suffix(".toml"))),
        beside=beside,
    )

    kad = encode_kad(_arena())
    yield Kind("kad", "own.kad", [kad], lambda path: drive_in(Arena.load(path)), strange=(_strange_mat, _strange_kad))
    yield Kind("mat", "own.mat", [kad], lambda path: drive_in(Arena.load(path)))

    project = Project(
        _arena(),
        robots=(ProjectRobot(turrets=("k213",)), ProjectRobot(kind="khepera_ii", name="b")),
        seed=3,
        thinking="fixed:2",
    ).to_bytes()
    projects = [project, project.partition(b"[[start]]")[0] + _PROJECT_EXTRA + b"[walls]\nsize_mm = [300, 260]\n"]
    files = (("own.toml", robots[0]),)
    yield Kind("project", "own.kiks", projects, _project, "toml", (partial(_project_of, png),), files)
    yield Kind("upload_project", "own.kiks", projects, _uploaded, "toml")
    yield Kind("upload_arena", "own.toml", [_ARENA_TOML, pictured], _uploaded, "toml")

    task = _task()
    champion = kiks.Champion(task.controller, (0.1,) * task.parameter_count, task="avoid", measures={"a": 1.0})
    with tempfile.TemporaryDirectory() as folder:
        champion.save(Path(folder) / "own.toml")
        saved = (Path(folder) / "own.toml").read_bytes()
    yield Kind("champion", "own.toml", [saved], _champion, "toml")

    identity, generation, arrays = _evolved()
    there = (("evolution.json", identity), ("generations/000001.npz", generation))
    yield Kind("evolution", "evolution.json", [identity], _evolution, "json")
    yield Kind(
        "generation",
        "generations/000001.npz",
        [generation],
        _evolution,
        strange=(partial(_strange_npz, arrays),),
        beside=there[:1],
    )

    yield Kind("network", "own.json", [THESIS.read_bytes()[:200_000]], _network, "json")

    table = {
        "values": np.arange(3 * 4 * 8).reshape(3, 4, 8),
        "gap_mm": np.array([5.0, 7.0, 9.0]),
        "object_angle_deg_cw": np.arange(4) * 90.0,
    }
    yield Kind("samples_table", "own.npz", [_npz(**table)], _samples, strange=(partial(_strange_npz, table),))
    yield Kind("samples_text", "own.sam", [_TEXT_SAMPLES], _samples, "toml")
    yield Kind("replay", "own.txt", [b"".join(b"%d\n" % (n * 1000) for n in range(40))], _replay, "toml")
    yield Kind("door", "session-1", [Door(1, 4711, SECRET).line().encode()], Door.read, "toml")


def _project_of(png: bytes, rng: random.Random) -> bytes:
    """Return a project with any picture for its walls."""
    import base64

    picture = _strange_png(rng) if rng.random() < 0.7 else mutated(rng, png)
    text = base64.b64encode(picture[: BYTES_MAX // 2]) + rng.choice((b"", b"", b"=", b"\xff", SECRET.encode()))
    return b"kiks = 1\n[walls]\nmm_per_cell = %s\npng = '''%s'''\n" % (
        rng.choice((b"1.0", b"0.1", b"nan", b"1e308")),
        text,
    )


def _files(folder: str) -> list[Any]:
    return list((resources.files("kiks.model") / folder).iterdir())


_BOX = Arena.box(300, 300)
_FAN: Any = None
_SAMPLES: list[Any] = []


def _warm() -> None:
    """Have everything loaded and compiled that cases need."""
    global _FAN
    if _FAN is not None:
        return
    from kiks.fit.networks import PLACES
    from kiks.fit.samples import Fan

    drive(Simulation(_arena(), robots=2, seed=1))
    drive(simulation_of(Project(_arena(), robots=(ProjectRobot(turrets=("k213", "gripper")),), response="thesis")))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "own.sam").write_bytes(_TEXT_SAMPLES)
        _SAMPLES.append(load_samples(Path(folder) / "own.sam"))
        _champion_file = Path(folder) / "own.toml"
        task = _task()
        kiks.Champion(task.controller, (0.1,) * task.parameter_count).save(_champion_file)
        _champion(_champion_file)
    _FAN = Fan.spread(*PLACES["rim"])
    for kind in ("zlib", "deflate"):
        bomb(kind)


def _prepared(kind: Kind) -> Play:
    _warm()
    return kind.prepare()


def campaigns() -> Iterator[Campaign]:
    """Yield one for each kind of file."""
    for kind in _kinds():
        yield Campaign(f"files.{kind.name}", CASES, partial(_prepared, kind), memory_mb=MEMORY_MB)
