"""How kernels are compiled: the same bits on every machine, and from the disk cache at the second start.

Need: `fastmath` would let the compiler reorder sums, and then the bits depend on the width of the processor's vectors.
Need: Numba's cache notices changes in the file of the cached function alone, but an entry point is made of functions
from many files.
Method: the cache folder carries a digest of the source of all folders that hold kernels, so that any change starts a
fresh one.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import config, njit

KERNEL_FOLDERS = ("engine", "control", "batch")
"""Folders beside one another whose files hold kernels."""

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": False, "nogil": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that only other kernels call."""
    return njit(**_OPTIONS)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function into each kernel that calls it.

    For pieces of a sensor's reading: called, they would cost a sixth of it more, as lanes then go by way of memory.
    """
    return njit(forceinline=True, **_OPTIONS)(function)


def spliced(function: Callable[..., Any]) -> Any:
    """Compile a function as a piece of the kernel that calls it, and never by itself.

    For large ones with one caller: what they call is then linked and compiled once, not again at each level.
    """
    return njit(inline="always", **_OPTIONS)(function)


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, and keep the machine code on disk."""
    settings: Any = config
    folder_before = settings.CACHE_DIR
    settings.CACHE_DIR = str(cache_folder())
    try:
        return njit(cache=True, **_OPTIONS)(function)
    finally:
        settings.CACHE_DIR = folder_before


def cache_folder() -> Path:
    """Return the folder that holds the compiled engine: under `NUMBA_CACHE_DIR`, else the user's cache folder.

    Code that checks its indices (`NUMBA_BOUNDSCHECK=1`) has one of its own: Numba's cache does not tell the two apart.
    """
    settings: Any = config
    digest = hashlib.sha256(b"checked" if settings.BOUNDSCHECK else b"")
    for folder in KERNEL_FOLDERS:
        for source in sorted((Path(__file__).parent.parent / folder).glob("*.py")):
            digest.update(source.read_bytes())
    root = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "kiks" / digest.hexdigest()[:16]


def is_compiled(name: str = "advance") -> bool:
    """Say whether the machine code of a function that Python calls lies in the cache, so that its first call is quick.

    Args:
        name: Name of the function; that of the tick, without which nothing moves, if left out.
    """
    return any(cache_folder().rglob(f"*.{name}-*.nbc"))
