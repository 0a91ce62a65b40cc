"""Runs a notebook as its cells of code, one after the other, without Jupyter."""

from __future__ import annotations

import ast
import linecache
import re
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import CodeType
from typing import Any

from kiks.errors import ParameterError, shown
from kiks.model.data_file import read_file
from kiks.model.limits import NOTEBOOK_BYTES_MAX
from kiks.model.notebook import code_cells

_OF_JUPYTER = re.compile(r"\s*(?:[%!?]|[A-Za-z_][\w., ]*=\s*[%!]|[\w.]+\?{1,2}\s*$)")
"""How a line begins that Python does not know: a magic, a command for the shell, a question."""

_OF_THE_PAGE = re.compile(r"\s*(?:%(?:matplotlib|config|load_ext|autoreload)|[%!]\s*(?:pip|conda)|%%time|%%capture)\b")
"""Those that prepare a page or a computer, and without which a program does the same."""


def run_notebook(path: str, names: dict[str, Any]) -> None:
    """Run the cells of a notebook; as in Jupyter, the value of a last line is shown, here by its text.

    Args:
        path: Its file.
        names: The globals that all cells share.

    Raises:
        ParameterError: If it is no notebook of Python, or a cell has a line of Jupyter on which a run depends; then no
            cell has run.
        SyntaxError: If a cell is no Python; then no cell has run.
    """
    name = path.rpartition("/")[2]
    data = read_file(Path(path), f"The notebook {shown(name)}", bytes_max=NOTEBOOK_BYTES_MAX)
    pieces = [
        piece
        for number, cell in enumerate(code_cells(data, name), 1)
        for piece in _compiled(cell, f"{path}, cell {number}", f"{name}, cell {number}")
    ]
    names["display"] = _display
    for code in pieces:
        exec(code, names)


def _display(*objects: Any) -> None:
    for each in objects:
        sys.displayhook(each)


def _compiled(cell: str, file: str, what: str) -> Iterator[CodeType]:
    """Yield the code of a cell, and that of its last line if this is to be shown.

    Args:
        cell: The text of the cell.
        file: What tracebacks call its file.
        what: What a message calls it.
    """
    linecache.cache[file] = len(cell), None, [f"{line}\n" for line in cell.split("\n")], file
    made: Callable[..., CodeType] = partial(compile, filename=file, dont_inherit=True)
    try:
        tree: Any = compile(cell, file, "exec", ast.PyCF_ONLY_AST, dont_inherit=True)
        shown_last = []
        if tree.body and isinstance(tree.body[-1], ast.Expr) and not cell.rstrip().endswith(";"):
            shown_last.append(tree.body.pop())
        yield made(tree, mode="exec")
        if shown_last:
            yield made(ast.Interactive(shown_last), mode="single")
    except SyntaxError as error:
        lines, at = cell.split("\n"), (error.lineno or 1) - 1
        if at < len(lines) and _OF_THE_PAGE.match(lines[at]):
            print(f"kiks: {what}, line {at + 1} is left out: {shown(lines[at].strip())}", file=sys.stderr)
            lines[at] = re.sub(r"\S.*", "pass", lines[at])
            yield from _compiled("\n".join(lines), file, what)
            return
        for number, line in enumerate(lines, 1):
            if _OF_JUPYTER.match(line):
                raise ParameterError(
                    f"{what}, line {number} must be Python, but it is {shown(line.strip())}, which only Jupyter knows. "
                    "Delete the line, or write it in Python."
                ) from None
        raise
