"""Finds out who calls a simulated function: a program gets simulated time, KiKS and compilers get real time."""

from __future__ import annotations

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


_WAITS = frozenset({"asyncio", "concurrent", "queue", "threading", "trio"})
_REAL = frozenset({"importlib", "kiks", "llvmlite", "numba", "subprocess"})
_PASSES = frozenset(
    "genericpath glob logging os pathlib posixpath random secrets shutil signal tempfile uuid".split()  # noqa: SIM905
)
_CLIENT = "kiks.client"
"""The part of KiKS that programs use."""


class _Kinds(dict[str | None, Caller]):
    def __missing__(self, module: str | None) -> Caller:
        top = str(module).partition(".")[0]
        kind = Caller.WAITS if top in _WAITS else Caller.PROGRAM
        if top in _PASSES:
            kind = Caller.PASSES
        if top in _REAL and not str(module).startswith(_CLIENT):
            kind = Caller.REAL
        self[module] = kind
        return kind


_kinds = _Kinds()


def caller(frame: FrameType) -> Caller:
    """Return who runs in a frame."""
    kind = _kinds[frame.f_globals.get("__name__")]
    return caller(frame.f_back) if kind is Caller.PASSES and frame.f_back is not None else kind
