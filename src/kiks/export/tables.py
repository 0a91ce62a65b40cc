"""Tables in files: of recordings, and of any columns."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from kiks.errors import library
from kiks.model.atomic_files import ending_of, replace_file
from kiks.model.columns import Columns
from kiks.model.replaceable import MADE_BY
from kiks.recording.recording import Recording

_MAT_TEXT_BYTES = 116
"""Length of the text with which a file of MATLAB's level 5 begins."""


def save_table(recording: Recording, path: str | Path, *, table: str = "poses", robot: int | None = None) -> None:
    """Write a table of a recording.

    Args:
        recording: The recording.
        path: The file: .csv, .parquet, or .mat for Octave and MATLAB.
        table: Which: see `kiks.Recording.table`.
        robot: Of this robot alone; of all if left out.
    """
    save_columns(recording.columns(table, robot), path)


def save_columns(columns: Columns, path: str | Path) -> None:
    """Write columns as a .csv, .parquet or .mat file."""
    _WRITERS[ending_of(path, "a table", _WRITERS)](columns, path, "a table")


def write_parquet(columns: Columns, path: str | Path, what: str) -> None:
    """Write columns of equal length as a Parquet file."""
    pyarrow, parquet = library("pyarrow"), library("pyarrow.parquet")
    buffer = io.BytesIO()
    parquet.write_table(pyarrow.table(columns, metadata={"creator": MADE_BY}), buffer)
    replace_file(path, buffer.getvalue(), what)


def _write_csv(columns: Columns, path: str | Path, what: str) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))
    replace_file(path, text.getvalue(), what)


def _write_mat(columns: Columns, path: str | Path, what: str) -> None:
    from scipy.io import savemat

    buffer = io.BytesIO()
    texts = {name: values.astype(object) for name, values in columns.items() if values.dtype.kind == "U"}
    savemat(buffer, {**columns, **texts}, oned_as="column", do_compression=True)
    header = f"MATLAB 5.0 MAT-file, {MADE_BY}".encode().ljust(_MAT_TEXT_BYTES)  # in place of a date and a system
    replace_file(path, header + buffer.getvalue()[_MAT_TEXT_BYTES:], what)


_WRITERS = {".csv": _write_csv, ".parquet": write_parquet, ".mat": _write_mat}
