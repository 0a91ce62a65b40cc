"""Files of the Matlab KiKS: the same order of pieces, exact round trips, SciPy as a peer, bad files of every kind."""

import io
import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.model.refusals import refused, traced

from kiks.errors import ArenaError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.kad import PIECES_MAX, _polygon, decode_kad, encode_kad, save_kad
from kiks.model.limits import MAT_FILE_BYTES_MAX


def greedy(picture: np.ndarray) -> list[int]:
    """Return the numbers of `walls` as section 5 of the notes tells it, cell by cell."""
    left = picture.astype(int)
    height, width = left.shape
    walls = [width, height]
    for column in range(width):
        for row in range(height):
            grey = left[row, column]
            if grey == 0:
                continue
            bottom = row
            while bottom + 1 < height and left[bottom + 1, column] == grey:
                bottom += 1
            right = column
            while right + 1 < width and (left[row : bottom + 1, right + 1] == grey).all():
                right += 1
            left[row : bottom + 1, column : right + 1] = 0
            xs = [column + 1, right + 1, right + 1, column + 1]
            ys = [row + 1, row + 1, bottom + 1, bottom + 1]
            walls += [4, *xs, *ys, int(grey)]
    return walls


def mat(**variables: object) -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    compress = bool(variables.pop("compress", False))
    savemat(file, variables, do_compression=compress)
    return file.getvalue()


def walls_of(data: bytes) -> np.ndarray:
    from scipy.io import loadmat

    return loadmat(io.BytesIO(data))["walls"]


rough = st.tuples(st.integers(0, 2**32 - 1), st.sampled_from([2, 3, 17])).map(
    lambda given: np.random.default_rng(given[0]).integers(0, given[1], (15, 16)).astype(np.uint8)
)


@settings(max_examples=share(15, 30))
@given(rough, st.integers(1, 8))
def test_pieces_are_those_of_the_matlab_kiks(grain, scale):
    picture = np.kron(grain, np.ones((scale, scale), np.uint8))
    picture = np.pad(picture, ((0, max(100 - len(picture), 0)), (0, max(100 - picture.shape[1], 0))))
    data = encode_kad(Arena.from_array(picture))
    walls = walls_of(data)
    assert (walls.dtype, walls.shape) == (np.uint16, (1, walls.size))
    assert walls[0].tolist() == greedy(picture)
    assert np.array_equal(decode_kad(data).brightness[::-1], picture)


def test_everything_else_comes_along(tmp_path):
    arena = replace(
        Arena.box(500, 300, rounded_mm=40, brightness=70),
        starts=(Pose(100.125, 100.1, -2.75), Pose(400, 200, 7.0)),
        lamps=(Lamp(10, 20, 1.5, False), Lamp(30, 40)),
        balls=(Ball(250, 150, 21.5, 30.25, 190),),
        cylinders=(Cylinder(300, 100),),
    )
    save_kad(arena, tmp_path / "room.kad")
    again = Arena.load(tmp_path / "room.kad")
    assert np.array_equal(again.brightness, arena.brightness)
    assert again.name == "room"
    for name in ("starts", "lamps", "balls", "cylinders"):
        assert getattr(again, name) == getattr(arena, name)
    assert [path.name for path in tmp_path.iterdir()] == ["room.kad"]


def test_numbers_of_any_type_and_byte_order_are_read():
    walls = np.array([120, 110, 4, 11, 15, 15, 11, 21, 21, 23, 23, 99])
    other = {"note": "hello", "cells": np.array([1, "a"], object), "z": np.ones(3) * 1j, "walls2": np.eye(3)}
    for kind in ("u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"):
        for numbers, compress in ((walls[None, :], False), (walls[:, None], True)):
            arena = decode_kad(mat(compress=compress, walls=numbers.astype(kind), **other))
            assert arena.brightness.sum() == 15 * 99
    walls = np.array([120, 110, 4, 11, 15, 15, 11, 21, 21, 23, 23, 99], ">u2").tobytes()
    parts = [(6, struct.pack(">II", 11, 0)), (5, struct.pack(">ii", 1, 12)), (1, b"walls"), (4, walls)]
    body = b"".join(struct.pack(">II", kind, len(part)) + part + bytes(-len(part) % 8) for kind, part in parts)
    data = b"x".ljust(124) + b"\x01\x00MI" + struct.pack(">II", 14, len(body)) + body
    assert decode_kad(data).brightness.sum() == 15 * 99


def test_the_first_row_is_on_top_and_polygons_are_filled_and_empty_around():
    arena = decode_kad(mat(walls=np.array([120, 110, 4, 1, 5, 5, 1, 1, 1, 3, 3, 99], np.uint16)))
    assert (arena.width_mm, arena.height_mm, arena.starts) == (120, 110, ())
    assert np.argwhere(arena.brightness).min(axis=0).tolist() == [107, 0]
    assert np.count_nonzero(arena.brightness == 99) == 15
    diamond = [3, 11, 31, 11, 1, 1, 41, 50]  # a triangle over a block
    walls = [120, 110, 4, 1, 60, 60, 1, 1, 1, 60, 60, 20, *diamond]
    picture = decode_kad(mat(walls=np.array(walls, np.uint16))).brightness[::-1]
    assert (picture[0, 10:31] == 50).all()
    assert (picture[:41, 10] == 50).all()
    assert picture[20, 20] == 50
    assert picture[21, 20] == 50 or picture[22, 21] == 0
    assert (picture[40, 30], picture[45, 30]) == (0, 20)


def row(*numbers: float) -> np.ndarray:
    return np.array(numbers, np.float64)


def test_bad_walls_and_things_and_files_that_are_none_are_refused(tmp_path):
    whole = [120, 110, 4, 1, 5, 5, 1, 1, 1, 3, 3, 99]
    for walls, words in (
        (np.zeros((1, 0)), "width and height"),
        (row(120), "width and height"),
        (np.ones((4, 4)), "must be a row of 2 to 2000002 numbers"),
        (np.ones((2, 2, 2)), "must be a row of 2 to 2000002 numbers"),
        ("hello", "'walls'"),
        (np.ones(12) * 1j, "'walls'"),
        (row(120.5, *whole[1:]), "whole numbers"),
        (row(*whole[:3], -1, *whole[4:]), "whole numbers"),
        (row(*whole[:-1], np.nan), "whole numbers"),
        (row(*whole[:-1], np.inf), "whole numbers"),
        (row(20, 20), "at least"),
        (row(0, 300), "at least"),
        (row(65535, 65535), "at most"),
        (row(*whole[:-1]), "cut short"),
        (row(120, 110, 65535, 1), "cut short"),
        (row(120, 110, 0, 1), "corners"),
        (row(120, 110, 4, 1, 121, 121, 1, *whole[7:]), "lie within"),
        (row(120, 110, 4, 0, 5, 5, 0, *whole[7:]), "lie within"),
        (row(*whole[:-1], 256), "grey"),
        (row(120, 110, 4, 1, 120, 120, 1, 1, 1, 110, 110, 9), "floor"),
    ):
        refused(words, decode_kad, mat(walls=walls), error=ArenaError)
    for name, things, words in (
        ("starts", np.ones((2, 4)), r"\[starts, 3\], but it had the shape \[2, 4\]"),
        ("starts", [[50, np.nan, 0]], "finite"),
        ("starts", [[2, 108, 0.0]], "floor"),
        ("balls", [[50, 50, 20, 20, 7.5]], "whole"),
        ("balls", [[50, 50, 20, 20, 300]], "brightness"),
        ("lamps", [[50, 50, -1, 1]], "power_w"),
        ("lamps", np.ones((1001, 4)), "1000"),
    ):
        data = mat(walls=np.array(whole, np.uint16), **{name: np.array(things)})
        refused(words, decode_kad, data, error=ArenaError)
    whole = encode_kad(Arena.box(200, 150, rounded_mm=30))
    for data, words in (
        (b"", "level 5"),
        (b"\x89PNG" * 100, "level 5"),
        (b"MATLAB 7.3 MAT-file".ljust(512), "7.3"),
        (mat(other=np.ones(3)), "variable 'walls'"),
        (bytes(MAT_FILE_BYTES_MAX + 1), "at most"),
        (whole[:128], "variable 'walls'"),
    ):
        refused(words, decode_kad, data, error=ArenaError)
        (tmp_path / "bad.kad").write_bytes(data)
        refused(words, Arena.load, tmp_path / "bad.kad", error=ArenaError)


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data


def matrix(sides: bytes, numbers: bytes, *, sides_type: int = 5, name: bytes = b"walls") -> bytes:
    parts = [(6, struct.pack("<II", 6, 0)), (sides_type, sides), (1, name), (2, numbers)]
    return element(14, b"".join(element(kind, part) + bytes(-len(part) % 8) for kind, part in parts))


FULL = [4, 1, 8000, 8000, 1, 1, 1, 8000, 8000, 9]
STAR = np.random.default_rng(3).integers(1, 8000, (2, 30_000))
HOSTILE = {
    "bomb": lambda: element(15, zlib.compress(bytes(8 * MAT_FILE_BYTES_MAX), 9)),
    "huge": lambda: element(14, struct.pack("<IIII", 6, 8, 14, 0) + struct.pack("<IIii", 5, 8, 2**31 - 1, 2**31 - 1)),
    "longer than the file": lambda: struct.pack("<II", 14, 2**32 - 1),
    "many numbers": lambda: element(15, zlib.compress(matrix(struct.pack("<ii", 1, 46 << 20), bytes(46 << 20)), 9)),
    "many starts": lambda: mat(walls=np.full((1, 2), 200), starts=np.zeros((2_000_000, 3)), compress=True)[128:],
    "infinite sides": lambda: matrix(struct.pack("<dd", 1, np.inf), b"", sides_type=9),
    "sides that are no numbers": lambda: matrix(struct.pack("<dd", 1, np.nan), b"", sides_type=9),
    "negative sides": lambda: matrix(struct.pack("<ii", -1, -5), bytes(5)),
    "painted over": lambda: mat(walls=np.array([8000, 8000, *FULL * 30], np.uint16))[128:],
    "a star": lambda: mat(walls=np.array([8000, 8000, 30_000, *STAR.ravel(), 9], np.uint16))[128:],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_files_that_would_take_endless_memory_are_refused(name):
    data = encode_kad(Arena.box(150, 120))[:128] + HOSTILE[name]()
    with traced() as peak_bytes:
        assert len(refused("must", decode_kad, data, error=ArenaError)) < 300
    assert peak_bytes[0] < 4 * MAT_FILE_BYTES_MAX


def test_a_polygon_takes_no_more_than_two_bytes_a_cell_beside_the_arena():
    data = mat(walls=np.array([4000, 4000, 5, 1, 4000, 4000, 7, 2000, 1, 1, 4000, 3999, 2000, 9], np.uint16))
    with traced() as peak_bytes:
        decode_kad(data)
    assert peak_bytes[0] < 3 * 4000 * 4000 + 40e6


@settings(max_examples=share(30, 60))
@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 9)), min_size=1, max_size=9))
def test_polygons_are_those_of_the_rule_cell_by_cell(corners):
    """An odd number of edges to the left, each with its lower and without its upper end; or on an edge."""
    expected = np.zeros((10, 13), bool)
    for row, column in np.ndindex(expected.shape):
        for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
            aside = (column - x0) * (y1 - y0) - (row - y0) * (x1 - x0)
            if aside == 0 and min(x0, x1) <= column <= max(x0, x1) and min(y0, y1) <= row <= max(y0, y1):
                expected[row, column] = True
                break
            expected[row, column] ^= min(y0, y1) <= row < max(y0, y1) and (aside > 0) == (y1 > y0)
    x, y = np.array(corners).T
    assert np.array_equal(_polygon(x, y, expected.shape), expected)


@pytest.mark.slow
def test_what_does_not_fit_is_refused(tmp_path):
    coarse = Arena.from_array(np.zeros((200, 200), np.uint8), mm_per_pixel=0.7)
    refused(r"Save it as \.kiks", encode_kad, coarse, error=ArenaError)
    noise = np.random.default_rng(2).integers(0, 256, (600, 600)).astype(np.uint8)
    refused(str(PIECES_MAX), encode_kad, Arena.from_array(noise), error=ArenaError)
    words = "an arena must go to a file that can be written"
    refused(words, save_kad, Arena.default(), tmp_path / "none" / "a.kad")
