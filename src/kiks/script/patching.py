"""Replaces names of modules while a program runs."""

from __future__ import annotations

import _thread
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

_MISSING = object()

_SWEPT = sys.stdlib_module_names | {"serial"}


@contextmanager
def replaced(
    replacements: Mapping[str, Mapping[str, Any]], new_lock: Callable[[], object] | None = None
) -> Iterator[None]:
    """Replace names, also where modules of Python and pyserial have imported them from others.

    Other modules that KiKS has imported keep the originals, because they live in real time.

    Args:
        replacements: The new values, by module, or module and class, and name.
        new_lock: Makes locks that replace those which modules have created at their import; None to keep them.
    """
    undo: list[tuple[Any, str, Any]] = []

    def put(owner: Any, name: str, value: Any) -> None:
        undo.append((owner, name, vars(owner).get(name, _MISSING)))
        setattr(owner, name, value)

    # References to the originals, so that no other object gets the same id.
    named: list[tuple[Any, str, Any]] = []
    stands_for: dict[int, tuple[Any, Any]] = {}
    for path, names in replacements.items():
        owner: Any = sys.modules.get(path)
        if owner is None and path.rpartition(".")[0] in sys.modules:
            parent, _, attribute = path.rpartition(".")
            owner = getattr(sys.modules[parent], attribute, None)
        if owner is None:
            continue
        for name, value in names.items():
            original = vars(owner).get(name)
            # A name that a module has imported is replaced only in its own module.
            if callable(original) and getattr(original, "__module__", None) == path:
                stands_for[id(original)] = (original, value)
            named.append((owner, name, value))
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] not in _SWEPT or not hasattr(module, "__dict__"):
            continue
        for attribute, value in list(vars(module).items()):
            if id(value) in stands_for and value is stands_for[id(value)][0]:
                put(module, attribute, stands_for[id(value)][1])
            elif new_lock is not None and type(value) is _thread.LockType and not value.locked():
                put(module, attribute, new_lock())
    for owner, name, value in named:
        put(owner, name, value)
    before = set(sys.modules)
    try:
        yield
    finally:
        # Modules imported meanwhile have imported replacements.
        originals = {id(value): original for original, value in stands_for.values()}
        for name in sys.modules.keys() - before:
            for attribute, value in list(vars(sys.modules[name]).items()):
                if id(value) in originals:
                    setattr(sys.modules[name], attribute, originals[id(value)])
        for owner, name, value in reversed(undo):
            if value is _MISSING:
                delattr(owner, name)
            else:
                setattr(owner, name, value)
