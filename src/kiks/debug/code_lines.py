"""The lines of a file at which a debugger can stop."""

from __future__ import annotations

from dis import findlinestarts
from pathlib import Path
from types import CodeType

BYTES_MAX = 10_000_000
"""Longest file that is looked at."""


def code_lines(file: Path) -> list[int]:
    """Return the lines of a file of Python at which code stands, in their order; none if it is no such file."""
    try:
        with file.open("rb") as source:
            left = [compile(source.read(BYTES_MAX), str(file), "exec", dont_inherit=True)]
    except (OSError, SyntaxError, ValueError):
        return []
    lines = set[int]()
    while left:
        code = left.pop()
        # The first line of a function is none of its own.
        lines.update(line for _, line in findlinestarts(code) if line is not None and line > 0)
        left += [each for each in code.co_consts if isinstance(each, CodeType)]
    return sorted(lines)
