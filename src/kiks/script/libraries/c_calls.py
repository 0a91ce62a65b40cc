"""Libraries whose code in C asks the operating system for the date, or waits there: they get simulated time.

Each library that is loaded from a file has a table of the functions that it calls in others (ELF, "Global Offset
Table"). The entries of such functions are changed there.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import re
import struct
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from types import ModuleType
from typing import Any

from kiks.clock.program_clock import calendar_ns
from kiks.script.clocks import CALENDARS
from kiks.script.libraries.host import Host
from kiks.script.patching import Replacements
from kiks.units import NS_PER_S

_NAMES, _NAMES_SIZE, _SYMBOLS, _CALLS, _CALLS_SIZE, _DATA, _DATA_SIZE = 5, 10, 6, 23, 2, 7, 8
"""DT_STRTAB, DT_STRSZ, DT_SYMTAB, DT_JMPREL, DT_PLTRELSZ, DT_RELA and DT_RELASZ (elf.h)."""

_SYMBOL_SIZE = 24
"""Size of Elf64_Sym (elf.h), whose first four bytes are the place of its name."""

_LOADED_ALREADY = 4
"""RTLD_NOLOAD (dlfcn.h)."""

_SEED = 28
"""SQLITE_TESTCTRL_PRNG_SEED (sqlite3.h)."""

_Ident = ctypes.CFUNCTYPE(ctypes.c_ulong)
_Time = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.POINTER(ctypes.c_int64))
_TimeOfDay = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_int64), ctypes.c_void_p)
_GetTime = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_int64))

_KEPT: list[object] = []


class _Library(ctypes.Structure):
    """The beginning of struct link_map (link.h): where a library lies, its name, and its tables."""

    _fields_ = (("base", ctypes.c_uint64), ("name", ctypes.c_char_p), ("tables", ctypes.c_uint64))


def redirect(path: str, functions: Mapping[str, tuple[Any, Any]], host: Host) -> None:
    """Let a loaded library call other functions in place of those of the operating system or of another library.

    Args:
        path: The library's file.
        functions: By name, the type in C of each function, and what it does for the program.
        host: The program. Everybody else in this process still calls the function of that name.
    """
    if sys.platform != "linux" or ctypes.sizeof(ctypes.c_void_p) != 8:
        return
    with suppress(OSError):
        library = ctypes.CDLL(path, mode=_LOADED_ALREADY)
        for name, place in _entries(path, tuple(functions)):
            kind, function = functions[name]
            # A function of Python itself is not in a library if that is in one piece.
            real = kind((name, library if hasattr(library, name) else ctypes.pythonapi))
            body = kind(_for_program(function, real, host))
            _KEPT.append(body)
            _write(place, ctypes.cast(body, ctypes.c_void_p).value or 0)


def _for_program(function: Callable[..., int], real: Callable[..., int], host: Host) -> Callable[..., int]:
    def call(*args: Any) -> int:
        if not host.scheduler.is_here:
            return real(*args)
        try:
            return function(*args)
        except BaseException as error:
            # No exception, such as that of Ctrl-C, passes through C: it comes up where C returns to Python. The loop
            # puts it there; after a call it would come up here.
            thread, kind = ctypes.c_ulong(host.scheduler.os_thread), ctypes.py_object(type(error))
            for _ in map(ctypes.pythonapi.PyThreadState_SetAsyncExc, [thread], [kind]):
                break
            return 0

    return call


def loaded(pattern: str) -> list[str]:
    """Return the files of this process whose names match a regular expression."""
    with open("/proc/self/maps") as maps:
        files = {line.split()[-1] for line in maps}
    return sorted(file for file in files if re.search(pattern, os.path.basename(file)))


def adapt_extension(name: str) -> Callable[[ModuleType, Host], Replacements]:
    """Return an adapter that lets a module in C tell the program's date; nothing more stands in."""

    def adapt(_: ModuleType, host: Host) -> Replacements:
        code = sys.modules.get(name)
        if code is not None and code.__file__:
            # A program may ask in a loop, so that asking costs time.
            dates = date_functions(
                lambda: host.clock.ask_ns() if host.scheduler.is_alone else host.scheduler.world.now_ns
            )
            redirect(code.__file__, dates, host)
        return {}

    return adapt


def adapt_sqlite(module: ModuleType, host: Host) -> Replacements:
    """Let `current_timestamp` and the like tell the program's date, and `random` follow from its seed.

    An object refuses another thread than its own, which is one of the program.
    """
    ident = {"PyThread_get_thread_ident": (_Ident, lambda: host.scheduler.current.ident)}
    redirect(sys.modules["_sqlite3"].__file__ or "", ident, host)
    for each in loaded("sqlite3"):
        redirect(each, date_functions(lambda: host.scheduler.world.now_ns), host)
        with suppress(OSError, AttributeError):
            ctypes.CDLL(each, mode=_LOADED_ALREADY).sqlite3_test_control(_SEED, host.chance.number("sqlite", 31), None)
    return {}


def date_functions(now_ns: Callable[[], int]) -> dict[str, tuple[Any, Any]]:
    """Return functions for `redirect` that tell the date.

    Args:
        now_ns: Returns the time since the program's start [ns].
    """

    def seconds_now(seconds: Any) -> int:
        now_s = calendar_ns(now_ns()) // NS_PER_S
        if seconds:
            seconds[0] = now_s
        return now_s

    def time_of_day(seconds: Any, _zone: object) -> int:
        seconds[0], rest_ns = divmod(calendar_ns(now_ns()), NS_PER_S)
        seconds[1] = rest_ns // 1000
        return 0

    def clock_time(clock: int, seconds: Any) -> int:
        time_ns = calendar_ns(now_ns()) if clock in CALENDARS else time.clock_gettime_ns(clock)
        seconds[0], seconds[1] = divmod(time_ns, NS_PER_S)
        return 0

    return {
        "time": (_Time, seconds_now),
        "gettimeofday": (_TimeOfDay, time_of_day),
        "clock_gettime": (_GetTime, clock_time),
    }


@cache
def _entries(path: str, functions: tuple[str, ...]) -> list[tuple[str, int]]:
    """Return where a loaded library keeps the addresses of functions that it calls, each with its name."""
    library = _Library.from_address(ctypes.CDLL(path, mode=_LOADED_ALREADY)._handle)
    tables = {}
    place = library.tables
    while tag := ctypes.c_int64.from_address(place).value:
        tables[tag] = ctypes.c_uint64.from_address(place + 8).value
        place += 16
    names = ctypes.string_at(tables[_NAMES], tables[_NAMES_SIZE])
    # One name may be the end of a longer one.
    pattern = rb"(?=(%s)\0)" % "|".join(functions).encode()
    wanted = {found.start(1): found[1].decode() for found in re.finditer(pattern, names)}
    entries = [
        entry
        for start, size in ((_CALLS, _CALLS_SIZE), (_DATA, _DATA_SIZE))
        for entry in struct.iter_unpack("<QQq", ctypes.string_at(tables.get(start, 0), tables.get(size, 0)))
    ]
    count = 1 + max((symbol >> 32 for _, symbol, _ in entries), default=0)
    symbols = ctypes.string_at(tables[_SYMBOLS], count * _SYMBOL_SIZE)
    name_of = [name for (name,) in struct.iter_unpack(f"<I{_SYMBOL_SIZE - 4}x", symbols)]
    return [
        (wanted[name_of[symbol >> 32]], library.base + offset)
        for offset, symbol, _ in entries
        if name_of[symbol >> 32] in wanted
    ]


def _write(place: int, address: int) -> None:
    page = place // mmap.PAGESIZE * mmap.PAGESIZE
    if ctypes.CDLL(None).mprotect(ctypes.c_void_p(page), mmap.PAGESIZE, mmap.PROT_READ | mmap.PROT_WRITE) == 0:
        ctypes.c_uint64.from_address(place).value = address
