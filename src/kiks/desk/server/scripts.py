"""The programs of a desk: listed, read, and checked before they run."""

from __future__ import annotations

import re
import shlex
import unicodedata
import warnings
from collections.abc import Iterable
from itertools import takewhile
from pathlib import Path, PurePath
from typing import NamedTuple

from kiks.desk.server.folder import Folder
from kiks.errors import ParameterError, shown
from kiks.model.atomic_files import program_in
from kiks.model.data_file import read_file
from kiks.model.limits import NOTEBOOK_BYTES_MAX, PROGRAM_BYTES_MAX
from kiks.model.package import shipped
from kiks.model.program_kinds import ENDINGS, ProgramKind, program_kind, program_text
from kiks.ports.program_command import ProgramCommand

EXAMPLES = shipped("examples/demos").resolve()
"""Folder of the example programs, which are those of the demonstrations."""

NEW = '''"""My program."""

import serial

with serial.Serial("/dev/ttyUSB0", 9600, timeout=1) as port:
    port.write(b"D,5,5\\n")
    print(port.readline())
'''
"""Text of a new program."""


class ProgramFolder(Folder):
    """A folder whose files are programs; those in folders below it are not offered."""

    opened = saved = tuple(ENDINGS)
    depth_max = 0


def offered(folder: Folder, commands: Iterable[ProgramCommand] = ()) -> dict[Path, str]:
    """Return the programs of a folder, those of its project and the examples, with what the list calls them."""
    own = {folder.path / name: name for name in folder.names()}
    files = {each.program.resolve() for each in commands if each.program.suffix in ENDINGS}
    attached = {path: f"{path.name} of the project" for path in sorted(files - own.keys()) if path.is_file()}
    examples = {path: f"example: {path.stem.replace('_', ' ')}" for path in sorted(EXAMPLES.glob("[!_]*.py"))}
    return own | examples | attached


def name_of(title: str) -> str:
    """Return the name of a program's file for a title: letters and digits that every file system takes.

    Example:
        >>> name_of("What does sensor 3 see?"), name_of("Übung 1")
        ('what_does_sensor_3_see.py', 'ubung_1.py')
    """
    plain = unicodedata.normalize("NFKD", title.lower()).encode("ascii", "ignore").decode()
    return f"{'_'.join(re.findall('[a-z0-9]+', plain))[:60] or 'mine'}.py"


def read_script(path: Path) -> str:
    """Return the text of a program; of a notebook, that of its cells."""
    path, name = program_in(path.parent, path.name), path.name
    try:
        if is_notebook(name):
            what = f"The notebook {shown(name)}"
            return program_text(path, read_file(path, what, bytes_max=NOTEBOOK_BYTES_MAX))[:PROGRAM_BYTES_MAX]
        if path.stat().st_size > PROGRAM_BYTES_MAX:
            raise ParameterError(
                f"a program must have at most {PROGRAM_BYTES_MAX} bytes to be edited here, but "
                f"{shown(name)} has {path.stat().st_size}. Edit it elsewhere."
            )
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"a program must be readable text, but {shown(name)} is not: {error}.") from None


def is_notebook(name: str) -> bool:
    """Return whether a program is a notebook, which the desk shows and runs, but does not change."""
    return program_kind(PurePath(name)) is ProgramKind.NOTEBOOK


def encode_script(text: str, name: str = "") -> bytes:
    """Return the bytes of a program's file, of which the name tells the kind."""
    if is_notebook(name):
        raise ParameterError(
            f"a notebook must be changed in Jupyter, but {shown(name)} was changed here. Save this text as another "
            "program, under a name that ends in .py."
        )
    data = text.encode("utf-8", errors="replace")
    if len(data) > PROGRAM_BYTES_MAX:
        raise ParameterError(f"a program must have at most {PROGRAM_BYTES_MAX} bytes, but this one has {len(data)}.")
    return data


class Mistake(NamedTuple):
    """A syntax error of a program.

    Attributes:
        line: Number of its line, from 1.
        message: What is wrong.
        begin: Where it begins in the program, from 0.
        end: Where it ends; the same place if only the line is known.
    """

    line: int
    message: str
    begin: int = 0
    end: int = 0

    def __str__(self) -> str:
        return f"Line {self.line}: {self.message}"


def find_mistake(text: str, name: str = "") -> Mistake | None:
    r"""Return the first syntax error of a program, which is compiled and not executed; None if it has none.

    Args:
        text: The program.
        name: The name of its file: in Octave's language nothing is looked for.

    Example:
        >>> print(find_mistake("x = 1\nif x = 2:\n    pass\n"))
        Line 2: invalid syntax. Maybe you meant '==' or ':=' instead of '='?
    """
    if program_kind(PurePath(name)) is ProgramKind.OCTAVE:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            compile(text, "program", "exec", dont_inherit=True)
    except SyntaxError as error:
        lines = text.split("\n")
        # At the end of the text, the error may be of the line after the last one.
        number = min(error.lineno or 1, len(lines))
        code, line_begin = lines[number - 1], sum(len(line) + 1 for line in lines[: number - 1])
        begin = min(max((error.offset or 1) - 1, 0), len(code))
        is_within = error.end_lineno == error.lineno and (error.end_offset or 0) > begin + 1
        end = min((error.end_offset or 0) - 1, len(code)) if is_within else len(code)
        return Mistake(number, error.msg, line_begin + begin, line_begin + max(end, begin))
    except (ValueError, RecursionError, MemoryError) as error:
        return Mistake(1, str(error) or "too deeply nested")
    return None


def moved(lines: Iterable[int], before: str, after: str) -> list[int]:
    r"""Return where lines are after a change of a text, by their numbers from 1; those that are gone are left out.

    Example:
        >>> moved([1, 3], "a\nb\nc", "a\nnew\nb\nc")
        [1, 4]
    """
    old, new = before.split("\n"), after.split("\n")
    head = _same_count(old, new)
    tail = _same_count(old[head:][::-1], new[head:][::-1])
    last, shift = len(old) - tail, len(new) - len(old)
    return [line + shift * (line > last) for line in lines if line > last or line <= last + shift]


def _same_count(some: list[str], others: list[str]) -> int:
    """Return with how many equal lines two texts begin."""
    return len([*takewhile(lambda pair: pair[0] == pair[1], zip(some, others, strict=False))])


def split_arguments(text: str) -> list[str]:
    """Split a line into words as a shell does."""
    try:
        return shlex.split(text)
    except ValueError as error:
        raise ParameterError(
            f"arguments must be words with blanks between them, but they were {shown(text)}: {str(error).lower()}. "
            "Close the quotes."
        ) from None
