"""Finds out who calls a simulated function: a program gets simulated time, KiKS and compilers get real time."""

from __future__ import annotations

import os
from enum import Enum
from types import FrameType


class Caller(Enum):
    """Kind of the module that calls."""

    PROGRAM = 0
    """The program, or a library on its behalf."""
    WAITS = 1
    """A module of Python that looks at the clock for a timeout: the program does not ask for the time there."""
    REAL = 2
    """What lives in real time: KiKS, compilers that measure themselves, and what loads modules."""
    PASSES = 3
    """A module of Python that asks on behalf of its caller, so that the caller counts."""


_KINDS = {
    Caller.WAITS: "asyncio concurrent queue threading trio",
    Caller.REAL: "bdb debugpy importlib kiks llvmlite numba pdb subprocess",
    Caller.PASSES: "genericpath glob logging os pathlib posixpath random secrets shutil signal tempfile uuid",
}
"""Kinds of packages; all others are a program's."""

_FOR_PROGRAM = ("kiks.client", "kiks.script.keyboard")
"""The parts of KiKS that act for a program."""

_PYDEVD, _PYDEVD_STARTS = ("pydevd", "_pydev"), "_pydev_bundle.pydev_monkey"
"""How the modules of pydevd begin, the debugger of VS Code (debugpy) and of PyCharm, and the one that stands before the
start of a thread or a process of the program."""

INSTALLED = ("site-packages", "dist-packages")
"""Folders in which libraries are installed."""

_LIBRARY = os.path.dirname(os.__file__)

_kind_of = {package: kind for kind, packages in _KINDS.items() for package in packages.split()}


class _Kinds(dict[str | None, Caller]):
    """The kind of each module that has called."""

    def __missing__(self, module: str | None) -> Caller:
        name = str(module)
        if name.startswith(_FOR_PROGRAM):
            kind = Caller.PROGRAM
        elif name.startswith(_PYDEVD):
            kind = Caller.PASSES if name == _PYDEVD_STARTS else Caller.REAL
        else:
            kind = _kind_of.get(name.partition(".")[0], Caller.PROGRAM)
        self[module] = kind
        return kind


_kinds = _Kinds()


def caller(frame: FrameType) -> Caller:
    """Return who runs in a frame."""
    kind = _kinds[frame.f_globals.get("__name__")]
    # Such a module has no time of its own: `logging` is asked by the program, and by KiKS.
    return caller(frame.f_back) if kind is Caller.PASSES and frame.f_back is not None else kind


def is_for_program(frame: FrameType | None) -> bool:
    """Return whether code of the program itself asks, such as in a watch, while a debugger has stopped it."""
    while frame is not None:
        kind, file = _kinds[frame.f_globals.get("__name__")], frame.f_globals.get("__file__") or ""
        if kind is Caller.REAL or any(folder in file for folder in INSTALLED):
            return False
        # Of Python's own library only its caller says who asks: a prompt is built on it.
        if kind is Caller.PROGRAM and not file.startswith(_LIBRARY):
            return True
        frame = frame.f_back
    return False
