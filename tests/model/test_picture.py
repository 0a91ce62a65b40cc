"""Pictures that were made to do harm or to be large: only an ArenaError comes out, and memory stays small."""

import io
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.at_length import at_length
from tests.model.refusals import refused

from kiks.errors import ArenaError
from kiks.model.picture import decode_picture

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
def test_a_picture_is_what_its_parts_are(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is decoded in bands of 126 rows, and cut into parts of 120."""
    monkeypatch.setattr("kiks.model.picture._BAND_PIXELS", 1 << 14)
    whole = noise(mode, 130, 600)
    parts = [whole.crop((0, top, 130, top + 120)) for top in range(0, 600, 120)]
    pixels = [decode_picture(file_of(part), 1.0) for part in parts]
    for all_of_it, of_parts in zip(decode_picture(file_of(whole), 1.0), zip(*pixels, strict=True), strict=True):
        assert np.array_equal(all_of_it, np.concatenate(of_parts))


def file_of(image: Image.Image) -> bytes:
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def noise(mode: str, width: int, height: int) -> Image.Image:
    """Return a picture with floor, with clear places if the mode has any, and with every grey and colour."""
    chance = np.random.default_rng(7)
    if mode == "I;16":
        return Image.fromarray(chance.integers(0, 65536, (height, width)).astype(np.uint16))
    picture = Image.fromarray((chance.integers(0, 256, (height, width, 4)) // 2 * 2).astype(np.uint8), "RGBA")
    picture = picture if mode in ("LA", "RGBA") else picture.convert("RGB")
    return picture.convert(mode)


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width: int, height: int, *chunks: bytes) -> bytes:
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + b"".join(chunks) + chunk(b"IEND", b"")


def bmp(width: int, height: int, bits: int = 24, packing: int = 0, body: bytes = b"") -> bytes:
    start = b"BM" + struct.pack("<IHHI", 54, 0, 0, 54 + (1024 if bits == 8 else 0))
    return start + struct.pack("<IiiHHIIiiII", 40, width, height, 1, bits, packing, *[0] * 5) + body


def tif(width: int, height: int, **changes: int) -> bytes:
    tags = {256: width, 257: height, 258: 8, 259: 8, 262: 1, 273: 8, 277: 1, 278: height, 279: 100}
    tags |= {int(tag[1:]): value for tag, value in changes.items()}
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in sorted(tags.items()))
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + struct.pack("<I", 8)


PIXELS = chunk(b"IDAT", zlib.compress(bytes(200 * 201)))
HOSTILE = {
    "an endless png": lambda: png(2**31 - 1, 2**31 - 1),
    "a png of nothing": lambda: png(0, 0),
    "a png without pixels": lambda: png(8000, 8000),
    "many texts": lambda: png(
        200, 200, *[chunk(b"zTXt", b"k\0\0" + zlib.compress(bytes(10**6), 9)) for _ in range(100)], PIXELS
    ),
    "a long text": lambda: png(200, 200, chunk(b"iTXt", b"k\0\1\0\0\0" + zlib.compress(bytes(10**8), 9)), PIXELS),
    "a long profile": lambda: png(200, 200, chunk(b"iCCP", b"k\0\0" + zlib.compress(bytes(10**8), 9)), PIXELS),
    "an endless bmp": lambda: bmp(2**31 - 1, 2**31 - 1),
    "a bmp upside down": lambda: bmp(-5, -(2**31)),
    "a bmp without pixels": lambda: bmp(8000, 8000),
    "a bmp of runs": lambda: bmp(8000, 8000, 8, 1, bytes(1024) + b"\xff\0" * 100_000),
    "an endless ppm": lambda: b"P6 999999999 999999999 65535\n",
    "a ppm in words": lambda: b"P2 8000 8000 255\n" + b"0 " * 100_000,
    "an endless tif": lambda: tif(2**31, 2**31),
    "a tif without pixels": lambda: tif(8000, 8000),
    "a tif with endless rows": lambda: tif(8000, 8000, t278=2**31),
    "a tif with many layers": lambda: tif(8000, 8000, t277=65535),
    "a tif with tiles of 1.6 billion": lambda: tif(8000, 8000, t322=40_000, t323=40_000, t324=8, t325=100),
    "a tif with tiles of 2^60": lambda: tif(8000, 8000, t322=2**30, t323=2**30, t324=8, t325=100),
}

# What a child does: it reads all files of a folder and prints by how much its memory grew, at most [MB].
CHILD = """
import sys
from pathlib import Path
from PIL import Image
from kiks.errors import ArenaError
from kiks.model.picture import read_picture
def peak_mb():
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024
Image.init()
before_mb = peak_mb()
for path in sorted(Path(sys.argv[1]).iterdir()):
    try:
        read_picture(path, 1.0)
    except ArenaError:
        pass
print(peak_mb() - before_mb)
"""


def memory_of_reading_mb(folder: Path) -> float:
    """Return by how much the memory of a process that reads all pictures of a folder grows, at most."""
    command = [sys.executable, "-W", "error", "-c", CHILD, str(folder)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True, timeout=100).stdout)


on_linux = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is read from /proc")


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_pictures_are_refused(name: str) -> None:
    assert len(refused("must", decode_picture, HOSTILE[name](), 1.0, error=ArenaError)) < 250


@at_length
@on_linux
def test_hostile_pictures_take_little_memory(tmp_path: Path) -> None:
    for name, make in HOSTILE.items():
        (tmp_path / f"{name}.png").write_bytes(make())
    assert memory_of_reading_mb(tmp_path) < 150


@at_length
@on_linux
def test_large_pictures_take_ten_bytes_a_pixel_at_most(tmp_path: Path) -> None:
    size = (3000, 3000)
    for mode in ("LA", "RGBA", "I;16"):
        Image.new(mode, size).save(tmp_path / f"{mode}.png")
    Image.new("RGB", size).save(tmp_path / "clear.png", transparency=(255, 255, 255))
    for mode in ("I", "F"):
        Image.new(mode, size).save(tmp_path / f"{mode}.tif", compression="tiff_adobe_deflate")
    assert memory_of_reading_mb(tmp_path) < 10 * 9
