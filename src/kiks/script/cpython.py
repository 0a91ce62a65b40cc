"""What KiKS needs of the insides of CPython; all of it stands here.

A program must find each function and each class that it would find without KiKS: the same object, wherever it or a
library has imported it, and before or after KiKS. So what is simulated is not put in the place of a name. It is put
inside: a function that is written in C gets another body, and a class of C another method, for as long as the program
runs.
"""

from __future__ import annotations

import _queue
import _random
import _thread
import asyncio
import concurrent.futures.thread
import ctypes
import gc
import logging
import mmap
import os
import runpy
import sys
import threading
import time
from _threading_local import local
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from opcode import opname
from types import BuiltinFunctionType, FrameType, ModuleType
from typing import Any

from kiks.errors import KiksError
from kiks.script.callers import Caller, caller

FIRST, LAST = (3, 11), (3, 15)
"""The versions of CPython whose insides are known: those under which all tests have passed."""

_HAS_HANDLES = sys.version_info >= (3, 13)
"""Whether `threading` knows of the end of a thread by a handle, not by a lock."""

_HANDLE, EVENT_LOOP_POLICY = (
    ("_os_thread_handle", "_BaseDefaultEventLoopPolicy")
    if sys.version_info >= (3, 14)
    else ("_handle", "BaseDefaultEventLoopPolicy")
)
"""Names that 3.14 changed: of a thread's handle, and in `asyncio.events`."""

_LOCAL = _thread._local

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
_own, _disown = ctypes.pythonapi.Py_IncRef, ctypes.pythonapi.Py_DecRef
_own.argtypes = _disown.argtypes = [ctypes.py_object]
_own.restype = _disown.restype = None
_open_file = ctypes.CDLL(None, use_errno=True).fopen
_open_file.restype, _open_file.argtypes = ctypes.c_void_p, [ctypes.c_char_p] * 2
_run_file = ctypes.pythonapi.PyRun_FileExFlags
_run_file.restype = ctypes.py_object
_run_file.argtypes = [
    ctypes.c_void_p,
    ctypes.c_char_p,
    ctypes.c_int,
    *[ctypes.py_object] * 2,
    ctypes.c_int,
    ctypes.c_void_p,
]
_write_locals = getattr(ctypes.pythonapi, "PyFrame_LocalsToFast", None)
if _write_locals is not None:
    _write_locals.argtypes, _write_locals.restype = [ctypes.py_object, ctypes.c_int], None
_CALL = ctypes.cast(ctypes.pythonapi.PyObject_Call, ctypes.c_void_p)


def _private_names() -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Yield the private names of the standard library that `script` uses, with the objects that have them."""
    yield asyncio, ("_get_running_loop", "_set_running_loop", "_enter_task", "_leave_task")
    yield asyncio.events, ("_event_loop_policy", EVENT_LOOP_POLICY)
    yield getattr(asyncio.events, EVENT_LOOP_POLICY, None), ("_Local",)
    yield concurrent.futures.thread, ("_shutdown", "_threads_queues")
    yield concurrent.futures._base.Future, ("__hash__",)
    yield logging, ("_startTime",)
    yield runpy, ("_run_module_as_main",)
    yield sys, ("_current_frames", "_getframe")
    yield _queue.SimpleQueue, ("get", "get_nowait", "put", "put_nowait")
    yield _random.Random, ("seed",)
    yield _thread, ("LockType", "RLock", "_local", "allocate_lock", "get_ident", "start_new_thread")
    yield _thread.LockType, ("acquire", "locked", "release")
    yield _thread.RLock, ("_acquire_restore", "_is_owned", "_release_save", "acquire", "release")
    yield threading, ("_active", "_counter", "_threading_atexits")
    yield threading.Condition(), ("_is_owned", "_lock")
    thread = threading.Thread(name="")
    if _HAS_HANDLES:
        yield _thread, ("_ThreadHandle", "start_joinable_thread")
        yield threading, ("_ThreadHandle",)
        yield thread, (_HANDLE,)
    else:
        yield _thread, ("_set_sentinel",)
        yield threading, ("_shutdown_locks",)
        yield thread, ("_is_stopped", "_tstate_lock")


def check_interpreter() -> None:
    """Check that the insides of this interpreter are known."""
    lacks = ""
    if sys.implementation.name != "cpython" or not FIRST <= sys.version_info[:2] <= LAST:
        lacks = "whose insides are not known"
    elif "t" in sys.abiflags:
        # Even if it is switched on: objects look otherwise, and classes may be changed by other threads meanwhile.
        lacks = "built without its lock of the interpreter"
    elif not _has_known_structures():
        lacks = "whose structures are not those of its version"
    else:
        for owner, names in _private_names():
            for name in names:
                if not hasattr(owner, name):
                    lacks = f"where {getattr(owner, '__name__', type(owner).__name__)} has no {name}"
    if lacks:
        raise KiksError(
            f"a program in simulated time must run under CPython {'.'.join(map(str, FIRST))} to "
            f"{'.'.join(map(str, LAST))}, but this is {sys.implementation.name} {sys.version.split()[0]}, {lacks}. "
            "Install KiKS under one of these, or run the program on kiks serve."
        )


def _has_known_structures() -> bool:
    sample = _CFunction.from_address(id(time.sleep))
    return (
        _MethodDef.from_address(sample.definition).name == b"sleep"
        and sample.owner == id(time)
        and _flags(dict).value == dict.__flags__
    )


def unchanged(function: Any) -> Any:
    """Return a function that does for ever what a function in C does now."""
    head = _CFunction.from_address(id(function))
    return _new_function(head.definition, head.owner, head.module)


def _flags(owner: type) -> ctypes.c_ulong:
    return ctypes.c_ulong.from_address(id(owner) + _FLAGS_OFFSET)


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect no garbage meanwhile: what finalizes it would find classes that are changed by half."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


_FILE_INPUT = 257
"""Py_file_input (compile.h)."""


def run_source(path: str, names: dict[str, Any]) -> None:
    """Run a file of source text with the globals `names`.

    Python reads it itself: what has been read already, as bytes, it compiles without checking that they are what the
    file declares.
    """
    file = _open_file(os.fsencode(path), b"rbe")
    if not file:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), path)
    _run_file(file, os.fsencode(path), _FILE_INPUT, names, names, True, None)


class Undo:
    """Takes changes back, the last one first."""

    def __init__(self) -> None:
        self._steps: list[Callable[[], object]] = []

    def add(self, step: Callable[[], object]) -> None:
        """Note how the latest change is taken back."""
        self._steps.append(step)

    def __call__(self) -> None:
        """Take all changes back."""
        with uncollected():
            while self._steps:
                self._steps.pop()()


class _StandIn:
    """The definition and the owner that a changed function has meanwhile.

    They live for ever, as a call may be under way when the change is taken back; the next change takes them again.
    """

    def __init__(self, function: BuiltinFunctionType) -> None:
        real = _MethodDef.from_address(_CFunction.from_address(id(function)).definition)
        # A function in C calls its body with its owner and the arguments, and so does PyObject_Call with what it calls.
        self.definition = _MethodDef(real.name, _CALL.value, _METHOD_OF_ARGUMENTS_AND_KEYWORDS, real.doc)
        # Pickles take the owner for the module that has the function, so it must look like one.
        self.kind: Any = type("module", (ModuleType,), {})
        self.owner = self.kind(getattr(function.__self__, "__name__", function.__name__))
        # The function must not end while it is changed.
        self.function = function


_spare: dict[int, list[_StandIn]] = {}
"""Those that are not in use, by the identity of the function."""


def change_function(function: BuiltinFunctionType, body: Callable[..., Any], undo: Undo) -> None:
    """Let a function in C call one in Python, for all who have it."""
    head = _CFunction.from_address(id(function))
    before = head.definition, head.owner, head.vectorcall
    spare = _spare.setdefault(id(function), [])
    stand_in = spare.pop() if spare else _StandIn(function)
    stand_in.kind.__call__ = staticmethod(body)
    # The collector of garbage counts on it that a function owns its owner.
    _own(stand_in.owner)
    head.definition, head.owner, head.vectorcall = ctypes.addressof(stand_in.definition), id(stand_in.owner), None

    def take_back() -> None:
        head.definition, head.owner, head.vectorcall = before
        _disown(stand_in.owner)
        del stand_in.kind.__call__
        spare.append(stand_in)

    undo.add(take_back)


_MISSING = object()


def change_class(owner: type, name: str, value: Any, undo: Undo) -> None:
    """Give a class, in Python or in C, another attribute.

    An operator, such as `__hash__`, cannot be changed in a class of the interpreter itself, such as `dict`: from 3.12
    on, those have other dictionaries.
    """
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


def write_locals(frame: FrameType) -> None:
    """Give a function the variables that were set in `frame.f_locals`; from 3.13 on, they are the function's own."""
    if _write_locals is not None and sys.version_info < (3, 13):
        _write_locals(frame, 0)


def is_suspended(frame: FrameType) -> bool:
    """Return whether a coroutine or generator that returns will go on: it waits, or has yielded."""
    return opname[frame.f_code.co_code[frame.f_lasti]] in ("YIELD_VALUE", "RESUME")


# ---- threads ----

FIRST_IDENT = 1 << 32
"""`threading.get_ident` of the first thread that a program starts."""

IDENT_STEP, IDENT_COUNT = 4096, 1 << 16
"""Distance between two of them [bytes], more than what the C library keeps of a thread, and their number."""

_PLACED = 0x02 | 0x20 | 0x4000 | 0x100000
"""MAP_PRIVATE, MAP_ANONYMOUS, MAP_NORESERVE and MAP_FIXED_NOREPLACE of Linux (sys/mman.h)."""


def new_idents() -> Iterator[int]:
    """Return the identities of a program's threads.

    Libraries in C take such a number for the address of what the C library knows of a thread (`pthread_t`), for example
    to give the thread a name. So there is memory at these addresses, full of zeros: a thread that has ended.
    """
    if sys.platform == "linux":
        map_memory = ctypes.CDLL(None).mmap
        map_memory.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]
        map_memory(FIRST_IDENT, IDENT_STEP * IDENT_COUNT, mmap.PROT_READ | mmap.PROT_WRITE, _PLACED, -1, 0)
    return count(FIRST_IDENT, IDENT_STEP)


def thread_locals() -> dict[str, dict[str, Any]]:
    """Return what stands in for `threading.local` where its values cannot be saved by `thread_values`."""
    return {"_thread": {"_local": local}, "threading": {"local": local}} if _HAS_HANDLES else {}


def real_locals() -> list[Any]:
    """Return the `threading.local` objects of before the program whose values `thread_values` does not save."""
    if not _HAS_HANDLES:
        return []
    gc.unfreeze()  # what is frozen would not be found
    found = [each for each in gc.get_objects() if type(each) is _LOCAL]
    gc.freeze()
    return found


def thread_values() -> tuple[Callable[[], Any], Callable[[Any], None]]:
    """Return functions that take this thread's values away, such as those of `threading.local`, and put them back."""
    values: dict[Any, Any] = _thread_values()
    # It is only lent: ctypes would give it back once more than it was taken.
    _own(values)
    return carrying(values)


def carrying(values: dict[Any, Any]) -> tuple[Callable[[], Any], Callable[[Any], None]]:
    """Return functions that take the items of a dictionary away, and put them back."""

    def take() -> dict[Any, Any]:
        taken = values.copy()
        values.clear()
        return taken

    def put(taken: dict[Any, Any]) -> None:
        values.clear()
        values.update(taken)

    return take, put


def thread_starts(scheduler: Any) -> dict[str, dict[str, Any]]:
    """Return what stands in for the functions by which `threading` starts threads and knows of their end.

    Args:
        scheduler: The program's threads, a `Scheduler`, which needs this file itself.
    """

    def check(function: object, args: object = (), kwargs: object = None) -> None:
        if not (callable(function) and isinstance(args, tuple) and isinstance({} if kwargs is None else kwargs, dict)):
            raise TypeError  # Python's own function says what is wrong

    def start_new_thread(
        function: Callable[..., object], args: tuple[Any, ...], kwargs: dict[str, Any] | None = None, /
    ) -> int:
        check(function, args, kwargs)
        return int(scheduler.start(function, args, kwargs or {}).ident)

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
            is_done = self.ident is not None and not self.lives.locked()
            # A debugger asks at any instant, and in threads of its own.
            if not is_done and scheduler.is_here and caller(sys._getframe(1)) is Caller.WAITS:
                scheduler.poll()
            return is_done

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
    if hasattr(_thread, "set_name"):
        # From 3.14 on, it would rename the one thread of the operating system that runs all of the program's.
        starts["set_name"] = lambda name, /: None
    return {
        "_thread": {**starts, "start_joinable_thread": start_joinable_thread, "_ThreadHandle": Handle},
        "threading": {"_ThreadHandle": Handle},
    }


_FRAMES_OF_A_THREAD = 3
"""Calls of KiKS between the hub of the scheduler and the function of a thread."""


@contextmanager
def whole_recursion() -> Iterator[dict[str, dict[str, Any]]]:
    """Let each thread of a program recurse as deeply as without KiKS, whose calls lie below those of the program.

    Yields:
        What stands in for the functions that tell and set the limit.
    """
    frame: FrameType | None = sys._getframe()
    below = _FRAMES_OF_A_THREAD
    while frame is not None:
        below, frame = below + 1, frame.f_back
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(before + below)

    def set_limit(limit: int, /) -> None:
        sys.setrecursionlimit(limit + below if limit > 0 else limit)

    try:
        yield {"sys": {"getrecursionlimit": lambda: sys.getrecursionlimit() - below, "setrecursionlimit": set_limit}}
    finally:
        sys.setrecursionlimit(before)


def name_of_thread(ident: int) -> str:
    """Return what `threading` calls a thread; it has no name if only `_thread` knows it."""
    thread = threading._active.get(ident)  # type: ignore[attr-defined]
    return "a thread" if thread is None else thread.name


def forget_threads(tasks: Mapping[int, Any]) -> None:
    """Make `threading` forget threads that have not ended, because they never go on."""
    for ident, task in tasks.items():
        thread: Any = threading._active.pop(ident, None)  # type: ignore[attr-defined]
        if _HAS_HANDLES:
            if thread is not None:
                getattr(thread, _HANDLE)._set_done()
            continue
        threading._shutdown_locks.discard(task.sentinel)  # type: ignore[attr-defined]
        if thread is not None:
            thread._is_stopped, thread._tstate_lock = True, None
