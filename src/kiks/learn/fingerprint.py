"""Fingerprints of what values depend on: numbers, and functions with all that they call and the constants they use.

Need: a folder goes on, and results are compared, only if nothing differs on which a value depends. Names do not tell:
`goal_mm(100, 300)` and `goal_mm(500, 300)` have the same one, and a helper may be edited.
Method: what a function reaches is written down and digested: its instructions, defaults and closure, the globals that
it names, the attributes that it takes from modules, and so on in these; other objects as pickle takes them apart.
Files, lines, comments and docstrings do not count, nor does the order in which sets are kept. So a fingerprint is the
same in each process, each folder and on each computer.
Assumption: what comes with Python or an installed library changes with the library's version. KiKS and the libraries
with which it calculates count by name: an evolution has the version of KiKS beside its fingerprints, and continues only
if its candidates are the same to the bit.
"""

from __future__ import annotations

import builtins
import ctypes
import dis
import functools
import hashlib
import importlib
import io
import logging
import os
import pickle
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import is_dataclass, replace
from pathlib import Path
from types import CodeType, FunctionType, GetSetDescriptorType, MemberDescriptorType, ModuleType
from typing import Any

from kiks.control.compiled_function import Compiled
from kiks.model.arena import Arena

# isort: split
from numba.core.dispatcher import Dispatcher

_ROOTS = Path(os.__file__).parent, Path(__file__).parents[1]
"""The folders of Python's own library and of KiKS."""

_BY_NAME = {*sys.stdlib_module_names, "kiks", "numpy", "numba", "scipy"}
"""What counts without its version."""

_ESCAPES = {"__import__", "eval", "exec", "globals", "input", "open", "vars"}
"""Functions of Python that lead to what no code names."""

_LABELS = {"kernel", "recipe", "advice", "needs", "__wrapped__", *functools.WRAPPER_ASSIGNMENTS}
"""Attributes of controllers and measures that follow from the others, name a file, or are for people."""

_WITHOUT = ", without "

# Python's own pickler can be overridden for each part of a value; it is not annotated.
_pickle: Any = pickle


def fingerprints(values: Mapping[str, Any]) -> dict[str, str]:
    """Return a fingerprint of each value: 16 hexadecimal digits.

    After those of functions stands the Python that compiled them, for another one does so differently, and then what
    they leave out.

    Example:
        >>> def scaled(scale):
        ...     return lambda values: scale * values["path_mm"]
        >>> one, same, other = (fingerprints({"fitness": scaled(scale)}) for scale in (2.0, 2.0, 3.0))
        >>> one == same, differing(one, other)
        (True, 'fitness')
    """
    return {name: _Walk().fingerprint(value) for name, value in values.items()}


def differing(one: Mapping[str, str], other: Mapping[str, str], but: Collection[str] = ()) -> str:
    """Return the names whose fingerprints differ, but for some, as text; nothing if none do."""
    return ", ".join(name for name in {**one, **other} if one.get(name) != other.get(name) and name not in but)


def warn_untracked(found: Mapping[str, str], what: str) -> None:
    """Tell the user what fingerprints leave out, because KiKS cannot see it, and what goes on all the same."""
    rests = {name: text.partition(_WITHOUT)[2] for name, text in found.items()}
    if text := "; ".join(f"{name}: {rest}" for name, rest in rests.items() if rest):
        logging.getLogger("kiks.learn").warning("%s even if this differs, which KiKS cannot see: %s.", what, text)


class _Walk(_pickle._Pickler):  # type: ignore[misc, unused-ignore]
    """Writes down what a value reaches."""

    def __init__(self) -> None:
        self._written = io.BytesIO()
        super().__init__(self._written, protocol=2)
        self.fast = True  # what is equal counts as equal, whether it is one thing or two
        self._met: dict[int, tuple[int, Any]] = {}  # with the things, so that no other one gets their ids
        self._untracked: set[str] = set()
        self._python = ""

    def fingerprint(self, value: Any) -> str:
        """Return the fingerprint of a value."""
        try:
            self.save(value)
        except RecursionError:
            self._opaque("what lies too deep")
        digits = hashlib.sha256(self._written.getvalue()).hexdigest()[:16]
        return digits + self._python + (_WITHOUT + ", ".join(sorted(self._untracked))) * bool(self._untracked)

    def save(self, value: Any, save_persistent_id: bool = True) -> None:
        """Write down a value; the pickler calls it for each part of one."""
        try:
            super().save(self._taken_apart(value))
        except RecursionError:
            raise
        except Exception:  # whatever an object raises that cannot be taken apart
            self.save_global(value)

    def save_global(self, value: Any, name: str = "") -> None:
        """Write down what pickle would look up by its name, or what has none."""
        known = name not in _ESCAPES and name and self._library(value, name)
        inside = getattr(value, "__wrapped__", None) or getattr(value, "fget", None)
        self.save(known or inside or self._opaque(name or f"{type(value).__module__}.{type(value).__qualname__}"))

    def _opaque(self, what: str) -> str:
        """Note, and return, the name of what cannot be seen."""
        self._untracked.add(what)
        return what

    def _taken_apart(self, value: Any) -> Any:
        """Return what a value consists of, if the pickler would not see that."""
        if isinstance(value, FunctionType | type | ModuleType):
            is_new = id(value) not in self._met
            number, _ = self._met.setdefault(id(value), (len(self._met), value))
            return [type(value).__name__, number, *(self._parts(value) if is_new else ())]
        if isinstance(value, set | frozenset):
            return ["set", *sorted(value, key=lambda each: str(getattr(each, "__qualname__", each)))]
        if isinstance(value, Dispatcher):
            return [value.py_func, value.targetoptions]
        if isinstance(value, ctypes.CDLL):
            raise TypeError  # it could be taken apart, into addresses
        if isinstance(value, Arena):
            return replace(value, name="")
        if isinstance(value, Compiled) or (is_dataclass(value) and hasattr(value, "__dict__")):
            labels = _LABELS if isinstance(value, Compiled) else ()
            return [type(value), {name: part for name, part in vars(value).items() if name not in labels}]
        return value

    def _parts(self, value: Any) -> Iterator[Any]:
        """Yield what a function, a class or a module consists of; a library's is its name."""
        library = self._library(value, value.__name__)
        if isinstance(value, FunctionType):
            yield from (library or [*self._code(value)], value.__defaults__, value.__kwdefaults__)
            yield [cell.cell_contents for cell in value.__closure__ or ()]
        elif library:
            yield library
        else:
            yield getattr(value, "__bases__", ())
            for name, part in vars(value).items():
                is_plumbing = name.startswith("__") or isinstance(part, GetSetDescriptorType | MemberDescriptorType)
                if not is_plumbing or isinstance(part, FunctionType | classmethod | staticmethod | property):
                    yield from (name, part)

    def _code(self, function: FunctionType) -> Iterator[Any]:
        """Yield the instructions of a function and of those in it, and what the names in them lead to."""
        self._python, codes = f" {sys.implementation.cache_tag}", [function.__code__]
        module: Any = None
        for code in codes:
            arguments = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            takes_more = code.co_flags & 0x0C  # *args and **kwargs
            yield from (code.co_argcount, code.co_posonlyargcount, arguments, takes_more, code.co_exceptiontable)
            for each in dis.get_instructions(code):
                name, holder, found, module = each.argval, module, None, None
                if isinstance(name, CodeType):
                    codes.append(name)
                    name = ""
                yield from (each.opname, name)
                if holder is not None and each.opname in ("LOAD_ATTR", "LOAD_METHOD", "IMPORT_FROM"):
                    holder, found = None, getattr(holder, name, None)
                elif each.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
                    found = function.__globals__.get(name, getattr(builtins, name, None))
                elif each.opname == "IMPORT_NAME":
                    with suppress(Exception):  # its code runs
                        found = importlib.import_module(name)
                    found = found or self._opaque(f"import {name}")
                if isinstance(found, ModuleType) and not self._library(found, found.__name__):
                    module, found = found, None  # what the next instruction takes from it counts, else all of it
                yield from (holder, found)

    def _library(self, value: Any, name: str) -> str:
        """Return name and version of what belongs to a library; nothing if it is a user's own."""
        if isinstance(value, FunctionType):  # decorators may have changed what it says of itself
            home, name = value.__globals__.get("__name__", ""), value.__code__.co_qualname
        else:
            home = name if isinstance(value, ModuleType) else _pickle.whichmodule(value, name)
        top = home.partition(".")[0]
        file = getattr(sys.modules.get(top), "__file__", None)
        is_shipped = any(map(Path(file).is_relative_to, _ROOTS)) if file else top in sys.stdlib_module_names
        if top == "__main__" or not (is_shipped or {"site-packages", "dist-packages"} & {*Path(file or "").parts}):
            return ""
        version = "" if top in _BY_NAME else getattr(sys.modules.get(top), "__version__", "") or self._opaque(top)
        return f"{home}.{name} {version}"
