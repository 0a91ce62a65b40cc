"""Arrays from outside: the gate is its rule, and no file gets past it, whatever it is made of and announces."""

import io
import re
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tests.model.refusals import refused, traced

from kiks.errors import ParameterError
from kiks.model.array_checks import Numbers, check_array, read_arrays

RULES = {
    "row": Numbers(("row",), -10, 1e6, advice="Count the rows."),
    "table": Numbers(("row", 2), 0, 1000, is_whole=True),
    "alone": Numbers(()),
}


def good() -> dict[str, np.ndarray]:
    return {
        "row": np.array([1.5, -2, 7], ">f8"),
        "table": np.asfortranarray(np.arange(6, dtype=np.uint16).reshape(3, 2)),
        "alone": np.float32(3.5),
    }


def npy(shape: object, descr: str = "<f8", body: bytes = b"") -> bytes:
    head = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(head)) + head + body


def npz(method: int = zipfile.ZIP_DEFLATED, **members: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, member in members.items():
            archive.writestr(f"{name}.npy", member)
    return file.getvalue()


def saved(compress: bool, **members: np.ndarray) -> bytes:
    file = io.BytesIO()
    (np.savez_compressed if compress else np.savez)(file, **members)
    return file.getvalue()


def test_what_numpy_saves_is_read(tmp_path: Path) -> None:
    for compress in (False, True):
        (tmp_path / "a.npz").write_bytes(saved(compress, **good(), other=np.array([None])))
        found = read_arrays(tmp_path / "a.npz", RULES, "File 'a'")
        assert {name: (array.dtype, array.tolist()) for name, array in found.items()} == {
            "row": (np.float64, [1.5, -2, 7]),
            "table": (np.int64, [[0, 1], [2, 3], [4, 5]]),
            "alone": (np.float64, 3.5),
        }


def test_what_breaks_a_rule_is_told_and_what_is_no_array_of_numbers_is_refused(tmp_path: Path) -> None:
    for name, values, words in (
        ("row", [1.5, np.nan, 7], "row must be finite numbers from -10 to 1e6 [row], but it was nan at [1]. Count"),
        ("row", [1.5, 7, -np.inf], "but it was -inf at [2]."),
        ("row", [1, 2, 3j], "but it was of type 'complex128'."),
        ("row", ["a", "b", "c"], "but it was of type '<U1'."),
        ("row", [None], "but it was of type 'object'."),
        ("row", np.zeros(3, "datetime64[s]"), "but it was of type 'datetime64[s]'."),
        ("row", np.zeros(3, [("a", "f8")]), "but it was of type \"[('a', '<f8')]\"."),
        ("row", [], "but it had the shape [0]."),
        ("row", 5.0, "but it had the shape []."),
        (
            "row",
            [1.0, 2.0],
            "table must be whole numbers from 0 to 1000 [row, 2], but it had the shape [3, 2], row = 2.",
        ),
        ("table", [[1, 2], [3, 4.5], [0, 0]], "but it was 4.5 at [1, 1]."),
        ("table", [[1, 2], [3, -4], [0, 0]], "but it was -4 at [1, 1]."),
        ("table", np.full((3, 2), 2**64 - 1, np.uint64), "but it was 18446744073709551615 at [0, 0]."),
        ("table", np.zeros((3, 3)), "but it had the shape [3, 3], row = 3."),
        ("alone", np.inf, "alone must be finite numbers [], but it was inf."),
        ("alone", np.zeros(1), "alone must be finite numbers [], but it had the shape [1]."),
    ):
        (tmp_path / "a.npz").write_bytes(saved(True, **(good() | {name: np.array(values)})))
        refused(f"^File 'a'.*{re.escape(words)}", read_arrays, tmp_path / "a.npz", RULES, "File 'a'")
    words = r"^row must be finite numbers \[row\], but it (was|had) "
    for values in (None, "abc", {}, [[1], [2, 3]], 10**400, [10**400], [1j], object(), [[[]]], b"\0"):
        refused(words, check_array, values, Numbers(("row",)), "row")


def rewritten(data: bytes, place: int, value: bytes) -> bytes:
    """Return a zip whose first entry in the table of contents is changed."""
    start = data.index(b"PK\1\2") + place
    return data[:start] + value + data[start + len(value) :]


WHOLE = saved(True, **good())
ROW = npy("(3,)", body=bytes(24))
HOSTILE = {
    "nothing": (b"", "must be a whole .npz file"),
    "no zip": (b"8 180 20 5 2\n", "must be a whole .npz file"),
    "cut": (WHOLE[:-30], "must be a whole .npz file"),
    "an unknown method": (rewritten(WHOLE, 10, b"\x63\0"), "compressed in another way"),
    "a secret": (rewritten(WHOLE, 8, b"\1\0"), "encrypted"),
    "no deflate": (WHOLE[:57] + b"\xff" + WHOLE[58:], "Error -3"),
    "a bomb of lzma": (npz(zipfile.ZIP_LZMA, row=npy("(3,)", body=bytes(10**7))), "another way"),
    "a bomb of bzip2": (npz(zipfile.ZIP_BZIP2, row=npy("(3,)", body=bytes(10**7))), "another way"),
    "a bomb that says so": (npz(row=npy("(1250000,)", body=bytes(10**7))), "1250000 of them, more than 1000."),
    "a bomb that does not": (npz(row=npy("(3,)", body=bytes(10**7))), "as many bytes as its head says, but it has 25"),
    "too short": (npz(row=npy("(3,)", body=bytes(23))), "as many bytes as its head says, but it has 23"),
    "10^12 numbers": (npz(row=npy("(1000000000000,)")), "1000000000000 of them"),
    "10^25 numbers": (npz(row=npy(f"({10**25},)")), f"{10**25} of them"),
    "10^500 numbers": (npz(row=npy(f"({10**500},)")), "of them, more than 1000."),
    "10^12 in a table": (npz(row=ROW, table=npy("(1000000, 1000000)")), "but it had the shape [1000000, 1000000]"),
    "fewer than none": (npz(row=npy("(-1,)")), "had the shape [-1]"),
    "a pickle": (npz(row=npy("(1,)", "|O", b"\x80\x04K\1.")), "of type 'object'"),
    "a program": (npz(row=npy("(__import__('os').abort(),)")), "must be a whole .npz file"),
    "brackets": (npz(row=b"\x93NUMPY\1\0" + struct.pack("<H", 9000) + b"(" * 9000), "must be a whole .npz file"),
    "a long head": (npz(row=b"\x93NUMPY\2\0" + b"\xff" * 4 + b"{" * 1000), "must be a whole .npz file"),
    "a head of blanks": (npz(row=npy("(3,)" + " " * 9000, body=bytes(24))), "must be a whole .npz file"),
    "no mark": (npz(row=ROW[1:]), "must be a whole .npz file"),
    "a type that is none": (npz(row=npy("(3,)", "<f3", bytes(9))), "f3"),
}


def test_hostile_files_are_refused_for_next_to_no_memory(tmp_path: Path) -> None:
    for name, (data, words) in HOSTILE.items():
        (tmp_path / "a.npz").write_bytes(data)
        with traced() as peak_bytes, pytest.raises(ParameterError) as caught:
            read_arrays(tmp_path / "a.npz", RULES, "File 'a'", numbers_max=1000)
        assert words in str(caught.value), name
        assert len(str(caught.value)) < 300, name
        assert "\n" not in str(caught.value), name
        assert peak_bytes[0] < 1e6, name


kinds = st.sampled_from([np.float64, np.float32, np.float16, np.int8, np.int64, np.uint64])


@given(kinds.flatmap(lambda kind: arrays(kind, st.sampled_from([(0,), (2,), (3,), (2, 3), ()]))), st.booleans())
def test_the_gate_is_its_rule(values: np.ndarray, is_whole: bool) -> None:
    rule = Numbers(("row",), -100, 100, is_whole=is_whole)
    listed = values.ravel().tolist()
    is_good = values.ndim == 1 and len(listed) > 0 and all(-100 <= value <= 100 for value in listed)
    is_good = is_good and not (is_whole and any(value != int(value) for value in listed))
    if is_good:
        assert check_array(values, rule, "row").tolist() == listed
    else:
        refused("row", check_array, values, rule, "row")
