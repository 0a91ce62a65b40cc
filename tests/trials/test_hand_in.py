"""What is handed in: it holds the program, and a file from elsewhere takes neither memory nor time."""

from __future__ import annotations

import io
import zipfile

import pytest

from kiks.errors import ParameterError
from kiks.trials.hand_in import PROGRAM, packed, program_of


def zipped(name: str, data: bytes) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return made.getvalue()


def test_the_program_comes_back_and_the_same_content_makes_the_same_file() -> None:
    made = [packed(b"x = 1\n", [], exercise="One", recording=b"r", page=b"p") for _ in range(2)]
    assert made[0] == made[1]
    assert program_of(made[0]) == b"x = 1\n"


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "not a zip file"),
        (b"x = 1\n", "not a zip file"),
        (zipped("other.py", b"x"), "There is no item named 'program.py'"),
        (zipped(PROGRAM, bytes(3_000_000)), "more than 200000 bytes"),
        (zipped(PROGRAM, b"x" * 1000).replace(b"x", b"y", 1)[:-30], "not a zip file"),
    ],
)
def test_a_file_of_another_kind_is_refused_in_one_line(data: bytes, why: str) -> None:
    with pytest.raises(ParameterError, match="must be a file that the desk's 'Hand in' made") as refused:
        program_of(data)
    assert why in str(refused.value)
    assert "\n" not in str(refused.value)
