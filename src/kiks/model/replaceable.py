"""Which files may be replaced without being asked for: those that KiKS has written, and can write again.

What people have drawn, written or measured stays, whatever its name ends in; so does a recording, but for that of a new
run. Method: KiKS leaves `MADE_BY` in its files, at a place that their format has for that; a recording, a table, a page
and thinking times are known by how they begin.
"""

from __future__ import annotations

import re
from pathlib import Path

MADE_BY = "KiKS, the Khepera simulator"
"""The mark."""

RECORDING, THINKING = "recording", "thinking times"
"""Kinds of files whose endings do not say what they are; other kinds are called by their ending."""

_WINDOW_BYTES = 1 << 16
"""Where the mark is looked for, at both ends of a file [bytes]."""

# An MCAP file begins with its magic, the code and length of its header, the profile, and the library.
_BEGINNINGS = {
    RECORDING: rb"\x89MCAP0\r\n.{9}\x04\0\0\0kiks",
    THINKING: rb"(\d+\n)+\d*\Z",
    ".csv": rb"time_s,robot,",
    ".html": rb"<!DOCTYPE html>.{,4000}<meta name=\"generator\" content=\"KiKS",
}


def is_replaceable(path: Path, kind: str) -> bool:
    r"""Return whether there is no file, or an empty one, or one of this kind that KiKS has written.

    Args:
        path: The file.
        kind: The ending of its name, or one of the kinds above.

    Example:
        >>> import tempfile
        >>> file = Path(tempfile.mkdtemp(), "run.csv")
        >>> is_replaceable(file, ".csv")
        True
        >>> _ = file.write_text("time_s,proximity_0_counts\n")  # of a real robot, which nothing can make again
        >>> is_replaceable(file, ".csv")
        False
    """
    if not path.is_file() or not (size := path.stat().st_size):
        return True
    with path.open("rb") as file:
        data = file.read(_WINDOW_BYTES)
        file.seek(max(size - _WINDOW_BYTES, 0))
        end = file.read()
    if (beginning := _BEGINNINGS.get(kind)) is not None:
        return re.match(beginning, data, re.DOTALL) is not None
    return MADE_BY.encode() in data + end
