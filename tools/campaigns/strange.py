"""Files that are none in ways that mutations would hardly find: lying heads, bombs, arrays of another kind."""

from __future__ import annotations

import io
import math
import random
import struct
import zipfile
import zlib
from contextlib import suppress
from typing import Any

import numpy as np
from tools.campaigns.hostile import BYTES_MAX, NUMBERS, hostile_value, mutated
from tools.campaigns.runner import SECRET

BOMB_BYTES = 900 << 20
"""What a bomb of less than 1 MB unpacks to."""


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


def strange_npy(rng: random.Random) -> bytes:
    """Return a .npy file whose head lies."""
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


def strange_npz(members: dict[str, Any], rng: random.Random) -> bytes:
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
                written = strange_npy(rng) if rng.random() < 0.7 else mutated(rng, written)
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


def strange_mat(rng: random.Random) -> bytes:
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


def strange_kad(rng: random.Random) -> bytes:
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


def strange_png(rng: random.Random) -> bytes:
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


def strange_netpbm(rng: random.Random) -> bytes:
    """Return a PBM, PGM, PPM or PFM with any head."""
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
