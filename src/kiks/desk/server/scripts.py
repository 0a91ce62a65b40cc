"""The Python programs of a desk: listed, opened, saved, and checked before they run."""

from __future__ import annotations

import shlex
import warnings
from dataclasses import dataclass
from pathlib import Path

from kiks.desk.server.folder import check_name
from kiks.errors import ParameterError, shown
from kiks.model.atomic_files import inside, program_in, replace_file
from kiks.model.limits import PROGRAM_BYTES_MAX
from kiks.model.shipped import shipped

COUNT_LIMIT = 200
"""Maximum number of listed files of the folder."""

EXAMPLES = shipped("examples/demos")
"""Folder of the example programs, which are those of the demonstrations."""

NEW = '''"""My program."""

import serial

with serial.Serial("/dev/ttyUSB0", 9600, timeout=1) as port:
    port.write(b"D,5,5\\n")
    print(port.readline())
'''
"""Text of a new program."""


@dataclass(frozen=True)
class Script:
    """A program in the list.

    Attributes:
        name: Its file name in the desk's folder or that of the examples.
        is_example: Whether it is an example.
    """

    name: str
    is_example: bool

    @property
    def label(self) -> str:
        """Its entry in the list."""
        return f"example: {self.name.removesuffix('.py').replace('_', ' ')}" if self.is_example else self.name


def offered(folder: Path) -> list[Script]:
    """Return the programs of a folder and the examples."""
    try:
        files = [path for path in sorted(folder.glob("*.py")) if path.is_file() and not path.name.startswith(".")]
    except OSError:
        files = []
    own = [Script(path.name, is_example=False) for path in files[:COUNT_LIMIT]]
    return own + [Script(path.name, is_example=True) for path in sorted(EXAMPLES.glob("[!_]*.py"))]


def path_of(folder: Path, script: Script) -> Path:
    """Return the path of a program."""
    return program_in(EXAMPLES if script.is_example else folder, script.name)


def read_script(folder: Path, script: Script) -> str:
    """Return the text of a program."""
    path = path_of(folder, script)
    try:
        if path.stat().st_size > PROGRAM_BYTES_MAX:
            raise ParameterError(
                f"a program must have at most {PROGRAM_BYTES_MAX} bytes to be edited here, but "
                f"{shown(script.name)} has {path.stat().st_size}. Edit it elsewhere."
            )
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"a program must be readable text, but {shown(script.name)} is not: {error}.") from None


def save_script(
    folder: Path, name: str, text: str, *, may_replace: Script | None = None, known: str | None = None
) -> Script:
    """Write a program into a folder.

    Args:
        folder: The folder.
        name: Its file name; .py is appended if it is missing.
        text: The program.
        may_replace: The script that it was read from; no other file is replaced.
        known: The text that was read or saved last; another one is not replaced. Any if left out.
    """
    name = name.strip()
    name = name if name.endswith(".py") else f"{name}.py"
    check_name(name, (".py",))
    if "/" in name:
        raise ParameterError(
            f"a program's name must have no folder, but it was {shown(name)}. Take letters and digits: square.py."
        )
    data = text.encode("utf-8", errors="replace")
    if len(data) > PROGRAM_BYTES_MAX:
        raise ParameterError(f"a program must have at most {PROGRAM_BYTES_MAX} bytes, but this one has {len(data)}.")
    script, path = Script(name, is_example=False), inside(folder, name, "the program")
    if path.exists() and script != may_replace:
        raise ParameterError(
            f"a program must have a name that is free, but there is a {shown(name)} already. Take another name, or "
            "open that one and change it."
        )
    if known is not None and path.exists() and read_script(folder, script) != known:
        raise ParameterError(
            f"a program must be saved as it was opened, but {shown(name)} has changed meanwhile, in another editor. "
            "Save this one under another name, and then open that one again."
        )
    replace_file(path, data, "a program")
    return script


@dataclass(frozen=True)
class Mistake:
    """A syntax error.

    Attributes:
        line: Number of the line, from 1.
        message: Python's message.
        text: The line.
    """

    line: int
    message: str
    text: str

    def __str__(self) -> str:
        shown = f": {self.text.strip()}" if self.text.strip() else ""
        return f"Line {self.line}: {self.message}{shown}"


def find_mistake(text: str) -> Mistake | None:
    r"""Return the first syntax error of a program; None if it has none.

    Example:
        >>> print(find_mistake("x = 1\nif x = 2:\n    pass\n"))
        Line 2: invalid syntax. Maybe you meant '==' or ':=' instead of '='?: if x = 2:
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            compile(text, "program", "exec", dont_inherit=True)
    except SyntaxError as error:
        line = error.lineno or 1
        lines = text.splitlines()
        return Mistake(line, error.msg, lines[line - 1] if line <= len(lines) else "")
    except (ValueError, RecursionError, MemoryError) as error:
        return Mistake(1, str(error) or "too deeply nested", "")
    return None


def split_arguments(text: str) -> list[str]:
    """Split a line into words as a shell does."""
    try:
        return shlex.split(text)
    except ValueError as error:
        raise ParameterError(
            f"arguments must be words with blanks between them, but they were {shown(text)}: {str(error).lower()}. "
            "Close the quotes."
        ) from None
