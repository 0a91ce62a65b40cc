"""Fingerprints of what values depend on: numbers, and functions with all that they call and the constants they use.

Need: an evolution resumes, and results are compared, only if nothing differs on which a value depends. Names do not
tell: `goal_mm(100, 300)` and `goal_mm(500, 300)` have the same one, and a helper may be edited.
Method: a value is pickled, and a user's function as its instructions, defaults, closure and the globals that it names;
a module of theirs as its text, and what it has from other modules. So files, lines, comments and docstrings of
functions do not count, and a fingerprint is the same in each process, each folder and on each computer.
Assumption: what comes with KiKS, Python or an installed library counts by its name; an evolution has the version of
KiKS beside its fingerprints, and continues only if its candidates are the same to the bit.
"""

from __future__ import annotations

import ctypes
import dis
import hashlib
import importlib
import inspect
import io
import pickle
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from kiks.control.compiled_function import Compiled
from kiks.model.arena import Arena

# isort: split
from numba.core.dispatcher import Dispatcher

COMPILED_HERE = f" by {sys.implementation.cache_tag}"
"""How the fingerprint of a user's function ends. Older files, whose fingerprints were made otherwise, have no `by`."""

_LABELS = {"kernel", "address", "recipe", "advice", "needs"}
"""Attributes of controllers, measures and senses that follow from the others, name a file, or are for people."""

_TAKING = {"LOAD_ATTR", "LOAD_METHOD", "IMPORT_FROM"}
"""Instructions that take an attribute of a module."""

# Python's own pickler can be overridden for each part of a value; it is not annotated.
_pickle: Any = pickle


def fingerprints(values: Mapping[str, Any]) -> dict[str, str]:
    """Return a fingerprint of each value: 16 hexadecimal digits.

    After those of functions stands the Python that compiled them, for another one does so differently.

    Example:
        >>> def scaled(scale):
        ...     return lambda values: scale * values["path_mm"]
        >>> one, same, other = (fingerprints({"fitness": scaled(scale)}) for scale in (2.0, 2.0, 3.0))
        >>> one == same, differing(one, other)
        (True, 'fitness')
    """
    return {name: _Writer().fingerprint(value) for name, value in values.items()}


def differing(one: Mapping[str, str], other: Mapping[str, str], but: Collection[str] = ()) -> str:
    """Return the names whose fingerprints differ, but for some, as text; nothing if none do."""
    return ", ".join(name for name in {**one, **other} if one.get(name) != other.get(name) and name not in but)


class _Writer(_pickle._Pickler):  # type: ignore[misc, unused-ignore]
    """Writes down what a value reaches."""

    def __init__(self) -> None:
        self._written = io.BytesIO()
        super().__init__(self._written, protocol=2)
        self.fast = True  # what is equal counts as equal, whether it is one thing or two
        self._met: dict[int, tuple[int, Any]] = {}  # with the things, so that no other one gets their ids
        self._python = ""

    def fingerprint(self, value: Any) -> str:
        """Return the fingerprint of a value."""
        self.save(value)
        return hashlib.sha256(self._written.getvalue()).hexdigest()[:16] + self._python

    def save(self, value: Any, save_persistent_id: bool = True) -> None:
        """Write down a value; the pickler calls it for each part of one."""
        try:
            super().save(self._taken_apart(value))
        except Exception:  # whatever an object raises that cannot be pickled: it counts by its type
            inside = getattr(value, "__wrapped__", None) or getattr(value, "fget", None)
            self.save(inside or f"{type(value).__module__}.{type(value).__qualname__}")

    def _taken_apart(self, value: Any) -> Any:
        """Return what a value consists of, if the pickler would not see that, or as text what a library has."""
        if isinstance(value, FunctionType | type | ModuleType):
            is_new = id(value) not in self._met
            number, _ = self._met.setdefault(id(value), (len(self._met), value))
            return [type(value).__name__, number, *(self._parts(value) if is_new else ())]
        if isinstance(value, set | frozenset):  # their order depends on the process
            return ["set", *sorted(value, key=lambda each: str(getattr(each, "__qualname__", each)))]
        if isinstance(value, Dispatcher):
            return [value.py_func, value.targetoptions]
        if isinstance(value, ctypes.CDLL):  # else it would count by its address
            return value._name
        if isinstance(value, Compiled):
            named = vars(value).items()
            return [type(value), {name: part for name, part in named if name not in _LABELS and name[:2] != "__"}]
        if is_dataclass(value):
            parts = [(each.name, getattr(value, each.name)) for each in fields(value) if each.init]
            # An arena is what it looks like, whatever its file is called.
            return [type(value), *(each for each in parts if not (isinstance(value, Arena) and each[0] == "name"))]
        return value

    def _parts(self, value: Any) -> Iterator[Any]:
        """Yield what a function, a class or a module consists of; of a library's, its name and what it holds."""
        is_function = isinstance(value, FunctionType)
        # Decorators may have changed the module that a function names.
        module = value.__globals__.get("__name__", "") if is_function else getattr(value, "__module__", value.__name__)
        if _is_shipped(module):
            yield module, value.__code__.co_qualname if is_function else value.__name__
        elif isinstance(value, ModuleType):
            with suppress(OSError, TypeError):  # a folder of modules has none
                yield module, inspect.getsource(value)
            # The text does not say what it has from other modules.
            parts = [
                part for part in vars(value).values() if isinstance(part, FunctionType | type | ModuleType | Compiled)
            ]
            yield [part for part in parts if getattr(part, "__module__", "") != value.__name__]
        elif is_function:
            yield from self._code(value)
        else:
            yield value.__bases__
            for name, part in vars(value).items():
                if name[:2] != "__" or isinstance(part, FunctionType | property):
                    yield name, getattr(part, "__func__", part)
        if is_function:
            yield value.__defaults__, value.__kwdefaults__, [each.cell_contents for each in value.__closure__ or ()]

    def _code(self, function: FunctionType) -> Iterator[Any]:
        """Yield the instructions of a function and of those in it, and what the names in them lead to."""
        self._python, codes = COMPILED_HERE, [function.__code__]
        found: Any = None
        for code in codes:
            arguments = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            takes_more = code.co_flags & 0x0C  # *args and **kwargs
            yield code.co_argcount, code.co_posonlyargcount, arguments, takes_more, code.co_exceptiontable
            for each in dis.get_instructions(code):
                if isinstance(each.argval, CodeType):
                    codes.append(each.argval)
                    continue
                yield each.opname, each.argval
                holder, found = found, None
                with suppress(Exception):  # the code of a module runs, or it is missing
                    if each.opname == "LOAD_GLOBAL":
                        found = function.__globals__.get(each.argval)
                    elif each.opname == "IMPORT_NAME":
                        found = importlib.import_module(each.argval)
                    elif each.opname in _TAKING and isinstance(holder, ModuleType) and not _is_shipped(holder.__name__):
                        found = getattr(holder, each.argval)
                yield found


def _is_shipped(module: str) -> bool:
    """Return whether a module comes with KiKS, Python or an installed library."""
    top = module.partition(".")[0]
    places = Path(getattr(sys.modules.get(top), "__file__", None) or "").parts
    return top in {"kiks", *sys.stdlib_module_names} or not {"site-packages", "dist-packages"}.isdisjoint(places)
