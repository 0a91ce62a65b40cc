"""What KiKS needs of the insides of CPython; all of it stands here.

A program must find each function and each class that it would find without KiKS: the same object, wherever it or a
library has imported it, and before or after KiKS. So what is simulated is not put in the place of a name. It is put
inside: a function that is written in C gets another body, and a class of C another method, for as long as the program
runs.
"""

from __future__ import annotations

import _thread
import ctypes
import gc
import mmap
import sys
import threading
import time
from _threading_local import local
from collections.abc import Callable, Iterator, Mapping
from itertools import count
from types import BuiltinFunctionType, ModuleType
from typing import TYPE_CHECKING, Any

from kiks.errors import KiksError

if TYPE_CHECKING:
    from kiks.script.thread_scheduler import Scheduler, Task

FIRST, LAST = (3, 11), (3, 14)
"""The versions of CPython whose insides are known."""

_METHOD_OF_ARGUMENTS_AND_KEYWORDS = 0x0001 | 0x0002
"""METH_VARARGS | METH_KEYWORDS (methodobject.h)."""

_IS_IMMUTABLE = 1 << 8
"""Py_TPFLAGS_IMMUTABLETYPE (object.h)."""


class _MethodDef(ctypes.Structure):
    """PyMethodDef (methodobject.h): the body of a function in C, and how it takes its arguments."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("body", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("doc", ctypes.c_char_p),
    )


class _CFunction(ctypes.Structure):
    """PyCFunctionObject (cpython/methodobject.h): a function of a module in C."""

    _fields_ = (
        ("head", ctypes.c_byte * object.__basicsize__),
        ("definition", ctypes.c_void_p),
        ("owner", ctypes.c_void_p),
        ("module", ctypes.c_void_p),
        ("weak_references", ctypes.c_void_p),
        ("vectorcall", ctypes.c_void_p),
    )


_FLAGS_OFFSET = object.__basicsize__ + 19 * ctypes.sizeof(ctypes.c_void_p)
"""Place of tp_flags in PyTypeObject (cpython/object.h): after the size of a variable object, and 18 pointers."""

_new_function = ctypes.pythonapi.PyCFunction_NewEx
_new_function.restype = ctypes.py_object
_new_function.argtypes = [ctypes.c_void_p] * 3
_thread_values = ctypes.pythonapi.PyThreadState_GetDict
_thread_values.restype = ctypes.py_object
_type_modified = ctypes.pythonapi.PyType_Modified
_type_modified.argtypes = [ctypes.py_object]
_type_modified.restype = None
_CALL = ctypes.cast(ctypes.pythonapi.PyObject_Call, ctypes.c_void_p)


def check_interpreter() -> None:
    """Check that the insides of this interpreter are known.

    Raises:
        KiksError: If they are not.
    """
    version = sys.version_info[:2]
    is_known = sys.implementation.name == "cpython" and FIRST <= version <= LAST
    if is_known and getattr(sys, "_is_gil_enabled", lambda: True)():
        sample = _CFunction.from_address(id(time.sleep))
        if (
            _MethodDef.from_address(sample.definition).name == b"sleep"
            and sample.owner == id(time)
            and _flags(dict).value == dict.__flags__
        ):
            return
    raise KiksError(
        f"a program in simulated time must run under CPython {'.'.join(map(str, FIRST))} to "
        f"{'.'.join(map(str, LAST))} with its lock of the interpreter, but this is {sys.implementation.name} "
        f"{sys.version.split()[0]}. Install KiKS under one of these, or run the program on kiks serve."
    )


def unchanged(function: Any) -> Any:
    """Return a function that does for ever what a function in C does now."""
    head = _CFunction.from_address(id(function))
    return _new_function(head.definition, head.owner, head.module)


def _flags(owner: type) -> ctypes.c_ulong:
    return ctypes.c_ulong.from_address(id(owner) + _FLAGS_OFFSET)


class Undo:
    """Takes changes back, the last one first."""

    def __init__(self) -> None:
        self._steps: list[Callable[[], object]] = []

    def add(self, step: Callable[[], object]) -> None:
        """Note how the latest change is taken back."""
        self._steps.append(step)

    def __call__(self) -> None:
        """Take all changes back."""
        while self._steps:
            self._steps.pop()()


def change_function(function: BuiltinFunctionType, body: Callable[..., Any], undo: Undo) -> None:
    """Let a function in C call one in Python, for all who have it."""
    head = _CFunction.from_address(id(function))
    before = head.definition, head.owner, head.vectorcall
    real_module = function.__self__
    # A function in C calls its body with its owner and the arguments, and so does PyObject_Call with what it calls.
    # Pickles take the owner for the module that has the function, so it must look like one.
    kind = type("module", (ModuleType,), {"__call__": staticmethod(body)})
    owner = kind(getattr(real_module, "__name__", function.__name__))
    real = _MethodDef.from_address(head.definition)
    definition = _MethodDef(real.name, _CALL.value, _METHOD_OF_ARGUMENTS_AND_KEYWORDS, real.doc)
    # The function owns its owner; a call that is under way needs both after the change was taken back, too.
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(owner))
    _KEPT.append(definition)
    head.definition, head.owner, head.vectorcall = ctypes.addressof(definition), id(owner), None

    def take_back() -> None:
        head.definition, head.owner, head.vectorcall = before

    undo.add(take_back)


_KEPT: list[object] = []
_MISSING = object()


def change_class(owner: type, name: str, value: Any, undo: Undo) -> None:
    """Give a class, in Python or in C, another attribute."""
    names: dict[str, Any]
    (names,) = gc.get_referents(owner.__dict__)
    before = names.get(name, _MISSING)
    flags = _flags(owner)
    is_closed = flags.value & _IS_IMMUTABLE

    def put(value: Any) -> None:
        if is_closed and not name.startswith("__"):
            if value is _MISSING:
                del names[name]
            else:
                names[name] = value
            _type_modified(owner)
            return
        # Python derives the bodies of operators from such names.
        flags.value &= ~is_closed
        delattr(owner, name) if value is _MISSING else setattr(owner, name, value)
        flags.value |= is_closed

    put(value)
    undo.add(lambda: put(before))


# ---- threads ----

_IDENTS, _IDENT_STEP, _IDENT_SPACE = 1 << 44, 1 << 12, 1 << 28
"""`threading.get_ident` of the first thread that a program starts, the step to the next one, and their space."""

_MAP_FIXED_NOREPLACE = 0x100000
"""Of mmap of Linux (asm-generic/mman-common.h)."""

_HAS_HANDLES = sys.version_info >= (3, 13)


def thread_idents() -> Iterator[int]:
    """Return the idents of threads: the same in each run.

    Code in C may take an ident for the address of a `pthread_t`. It finds memory there, with zeros: a thread that has
    ended.
    """
    map_memory = ctypes.CDLL(None).mmap
    map_memory.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]
    if sys.platform == "linux":
        reading_and_writing = mmap.PROT_READ | mmap.PROT_WRITE
        private_and_empty = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
        # Memory that is mapped there already stays as it is: it is this, or not needed.
        map_memory(_IDENTS, _IDENT_SPACE, reading_and_writing, private_and_empty | _MAP_FIXED_NOREPLACE, -1, 0)
    return count(_IDENTS, _IDENT_STEP)


def thread_locals() -> dict[str, dict[str, Any]]:
    """Return what stands in for `threading.local` where its values cannot be saved by `thread_values`."""
    return {"_thread": {"_local": local}, "threading": {"local": local}} if _HAS_HANDLES else {}


def thread_values() -> tuple[Callable[[], object], Callable[[Any], object]]:
    """Return functions that save and restore all values of this thread, such as those of `threading.local`."""
    values: dict[Any, Any] = _thread_values()

    def put(saved: Any) -> None:
        values.clear()
        values.update(saved or ())

    return values.copy, put


def thread_starts(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return what stands in for the functions by which `threading` starts threads and knows of their end."""

    def check(function: object) -> None:
        if not callable(function):
            raise TypeError("first arg must be callable")

    def start_new_thread(
        function: Callable[..., object], args: tuple[Any, ...], kwargs: dict[str, Any] | None = None, /
    ) -> int:
        check(function)
        return scheduler.start(function, tuple(args), kwargs or {}).ident

    starts: dict[str, Any] = {"start_new_thread": start_new_thread, "start_new": start_new_thread}
    if not _HAS_HANDLES:

        def set_sentinel() -> Any:
            scheduler.current.sentinel = _thread.allocate_lock()
            return scheduler.current.sentinel

        return {"_thread": {**starts, "_set_sentinel": set_sentinel}}

    class Handle:
        """See `_thread._ThreadHandle`."""

        def __new__(cls) -> Any:
            return super().__new__(cls) if scheduler.is_here else real_handle()

        def __init__(self) -> None:
            self.ident: int | None = None
            # Locked from the start of the thread to its end.
            self.lives = _thread.allocate_lock()

        def is_done(self) -> bool:
            return self.ident is not None and not self.lives.locked()

        def join(self, timeout: float | None = None) -> None:
            if self.ident is None:
                raise RuntimeError("thread not started")
            if self.lives.acquire(timeout=-1 if timeout is None else timeout):
                self.lives.release()

        def _set_done(self) -> None:
            if self.lives.locked():
                self.lives.release()

    def start_joinable_thread(function: Callable[..., object], handle: Any = None, daemon: bool = True) -> Any:
        check(function)
        handle = Handle() if handle is None else handle
        task = scheduler.start(function, (), {})
        handle.ident = task.ident
        handle.lives.acquire()
        task.sentinel = handle.lives
        return handle

    real_handle = _thread._ThreadHandle  # type: ignore[attr-defined]
    return {
        "_thread": {**starts, "start_joinable_thread": start_joinable_thread, "_ThreadHandle": Handle},
        "threading": {"_ThreadHandle": Handle},
    }


def forget_threads(tasks: Mapping[int, Task]) -> None:
    """Make `threading` forget threads that have not ended, because they never go on."""
    for ident, task in tasks.items():
        thread: Any = threading._active.pop(ident, None)  # type: ignore[attr-defined]
        if _HAS_HANDLES:
            if thread is not None:
                thread._handle._set_done()
            continue
        threading._shutdown_locks.discard(task.sentinel)  # type: ignore[attr-defined]
        if thread is not None:
            thread._is_stopped, thread._tstate_lock = True, None
