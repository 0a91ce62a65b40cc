"""What kind of program a file is: the one table of the endings of programs, and their texts for people."""

from __future__ import annotations

import shutil
from contextlib import suppress
from enum import StrEnum
from importlib.util import decode_source
from pathlib import PurePath

from kiks.errors import ParameterError, shown
from kiks.model.notebook import code_cells


class ProgramKind(StrEnum):
    """In what a program is written, which decides how it runs."""

    PYTHON = "Python"
    NOTEBOOK = "notebook"
    OCTAVE = "Octave"


ENDINGS = {".py": ProgramKind.PYTHON, ".ipynb": ProgramKind.NOTEBOOK, ".m": ProgramKind.OCTAVE}
"""Kinds of programs by the ending of their file."""

A_PROGRAM = "a file of Python (.py), Jupyter (.ipynb) or Octave (.m)"
"""What messages call a program's file."""


def program_kind(file: PurePath) -> ProgramKind:
    """Return the kind of a program; folders, archives and files with other endings are of Python.

    Example:
        >>> from pathlib import Path
        >>> print(program_kind(Path("lab.ipynb")), program_kind(Path("ann.m")), program_kind(Path("ann")))
        notebook Octave Python
    """
    return ENDINGS.get(file.suffix.lower(), ProgramKind.PYTHON)


def why_not(file: PurePath) -> str:
    """Return why a program cannot run on this computer, as its name tells; empty if it can.

    Example:
        >>> from pathlib import Path
        >>> why_not(Path("ann.py")), why_not(Path("ann.c"))
        ('', "'ann.c' is no file of Python (.py), Jupyter (.ipynb) or Octave (.m)")
    """
    if file.suffix.lower() not in ENDINGS:
        return f"{shown(file.name)} is no {A_PROGRAM.removeprefix('a ')}"
    if program_kind(file) is ProgramKind.OCTAVE and octave() is None:
        return f"{shown(file.name)} needs Octave, but there is no octave-cli in the folders of PATH"
    return ""


def octave() -> str | None:
    """Return the command of Octave for programs; None if it is not installed."""
    return shutil.which("octave-cli")


def program_text(file: PurePath, data: bytes) -> str:
    r"""Return the text of a program for people and for comparisons: of a notebook, its cells of code.

    Args:
        file: The program's file, whose ending tells its kind.
        data: The bytes of the file.

    Example:
        >>> from pathlib import Path
        >>> program_text(Path("ann.py"), b"print(1)")
        'print(1)'
        >>> program_text(Path("ann.py"), "go = 1\r\n".encode("utf-16"))  # as Windows may save it
        'go = 1\n'
    """
    if program_kind(file) is ProgramKind.NOTEBOOK:
        try:
            cells = code_cells(data, file.name)
            return "\n\n".join(f"# cell {number}\n{cell}" for number, cell in enumerate(cells, 1))
        except ParameterError:
            pass  # reported when the program starts
    with suppress(SyntaxError, UnicodeError, LookupError):
        if b"\0" not in data:
            return decode_source(data)
    is_wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    text = data.decode("utf-16" if is_wide else "utf-8-sig", "replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")
