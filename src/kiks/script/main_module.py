"""Starts a program as Python does: it has the `__main__`, `sys.argv` and `sys.path` that it has without KiKS."""

from __future__ import annotations

import builtins
import os
import runpy
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.machinery import SourceFileLoader, SourcelessFileLoader
from io import IOBase
from pathlib import Path
from pkgutil import get_importer
from types import ModuleType
from typing import Any
from warnings import catch_warnings

from kiks.model.program_kinds import ProgramKind, program_kind
from kiks.script.cpython import run_source


@contextmanager
def main_module(program: Path, arguments: list[str], module: str) -> Iterator[Callable[[], None]]:
    """Yield a function that runs a program in a new `__main__`; the names of before come back at the end.

    Args:
        program: Its file, or a folder or an archive with a `__main__.py`.
        arguments: Its arguments in `sys.argv`.
        module: Name of a module or package to run in place of the file, as `python -m` does; empty for none.
    """
    before = sys.argv, sys.path[:], sys.modules["__main__"]
    main = sys.modules["__main__"] = ModuleType("__main__")
    vars(main).update(__builtins__=builtins)
    if sys.version_info < (3, 14):
        vars(main).update(__annotations__={})
    path = os.path.join(os.getcwd(), program)
    sys.argv = [str(program), *arguments]
    # Python itself starts modules, folders and archives by this function of runpy (Modules/main.c).
    as_main: Callable[..., None] = runpy._run_module_as_main  # type: ignore[attr-defined]
    if module:
        sys.path.insert(0, os.getcwd())
        run = partial(as_main, module)
    elif get_importer(path) is not None:
        sys.path.insert(0, path)
        run = partial(as_main, "__main__", alter_argv=False)
    else:
        sys.path.insert(0, os.path.dirname(os.path.realpath(path)))
        run = partial(_run_file, path, main)
        if program_kind(program) is ProgramKind.NOTEBOOK:
            from kiks.script.notebook import run_notebook  # here, for it needs NumPy, which programs may not load

            run = partial(run_notebook, path, vars(main))
    try:
        yield run
    finally:
        sys.argv, sys.path[:], sys.modules["__main__"] = before
        clear_names(vars(main))


def clear_names(names: dict[str, Any]) -> None:
    """Let go of the globals of a program's module as Python does at its end (`_PyModule_ClearDict`).

    As garbage in a cycle with its functions, an open file would lose what it has not written yet.
    """
    hook = sys.unraisablehook
    # Python 3.13 tells of files that cannot be flushed as their port is closed; earlier ones do not.
    sys.unraisablehook = lambda dropped: None if isinstance(dropped.object, IOBase) else hook(dropped)
    try:
        with catch_warnings(action="ignore", category=ResourceWarning):
            for name in sorted(names, key=lambda name: not (name.startswith("_") and not name.startswith("__"))):
                if name != "__builtins__":
                    names[name] = None
    finally:
        sys.unraisablehook = hook


def _run_file(path: str, main: ModuleType) -> None:
    """Run a file as Python runs the file that its command line names (Python/pythonrun.c)."""
    is_compiled = path.endswith(".pyc")
    loader = SourcelessFileLoader("__main__", path) if is_compiled else SourceFileLoader("__main__", path)
    vars(main).update(__file__=path, __loader__=loader)
    if sys.version_info < (3, 15):
        vars(main).update(__cached__=None)
    if isinstance(loader, SourcelessFileLoader):
        code = loader.get_code("__main__")
        assert code is not None
        exec(code, vars(main))
    else:
        run_source(path, vars(main))
