"""Libraries whose code in C asks the operating system for the date: they get the program's.

Each library that is loaded from a file has a table of the functions that it calls in others (ELF, "Global Offset
Table"). The entries for the date are changed there.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import re
import struct
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from types import ModuleType
from typing import Any

from kiks.clock.program_clock import calendar_ns
from kiks.script.clocks import CALENDARS
from kiks.script.libraries.host import Host
from kiks.units import NS_PER_S

_NAMES, _NAMES_SIZE, _SYMBOLS, _CALLS, _CALLS_SIZE, _DATA, _DATA_SIZE = 5, 10, 6, 23, 2, 7, 8
"""DT_STRTAB, DT_STRSZ, DT_SYMTAB, DT_JMPREL, DT_PLTRELSZ, DT_RELA and DT_RELASZ (elf.h)."""

_SYMBOL_SIZE = 24
"""Size of Elf64_Sym (elf.h), whose first four bytes are the place of its name."""

_LOADED_ALREADY = 4
"""RTLD_NOLOAD (dlfcn.h)."""

_SEED = 28
"""SQLITE_TESTCTRL_PRNG_SEED (sqlite3.h)."""

_Time = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.POINTER(ctypes.c_int64))
_TimeOfDay = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_int64), ctypes.c_void_p)
_GetTime = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_int64))

_KEPT: list[object] = []


class _Library(ctypes.Structure):
    """The beginning of struct link_map (link.h): where a library lies, its name, and its tables."""

    _fields_ = (("base", ctypes.c_uint64), ("name", ctypes.c_char_p), ("tables", ctypes.c_uint64))


def adapt_extension(name: str) -> Callable[[ModuleType, Host], dict[Any, dict[str, Any]]]:
    """Return an adapter that lets a module in C tell the program's date; nothing more stands in."""

    def adapt(_: ModuleType, host: Host) -> dict[Any, dict[str, Any]]:
        code = sys.modules.get(name)
        if code is not None and code.__file__:
            # A program may ask in a loop, so that asking costs time.
            _redirect(
                code.__file__,
                lambda: host.clock.ask_ns() if host.scheduler.is_alone else host.scheduler.world.now_ns,
                host,
            )
        return {}

    return adapt


def adapt_sqlite(module: ModuleType, host: Host) -> dict[Any, dict[str, Any]]:
    """Let `current_timestamp` and the like tell the program's date, and `random` follow from its seed."""
    with open("/proc/self/maps") as maps:
        files = {line.split()[-1] for line in maps if "sqlite3" in os.path.basename(line.split()[-1])}
    for each in sorted(files):
        _redirect(each, lambda: host.scheduler.world.now_ns, host)
        with suppress(OSError, AttributeError):
            ctypes.CDLL(each, mode=_LOADED_ALREADY).sqlite3_test_control(_SEED, host.chance.number("sqlite", 31), None)
    return {}


def _redirect(path: str, now_ns: Callable[[], int], host: Host) -> None:
    """Let a library ask this for the date [ns since the program's start]."""
    if sys.platform != "linux" or ctypes.sizeof(ctypes.c_void_p) != 8:
        return

    def date_ns() -> int:
        return calendar_ns(now_ns()) if host.scheduler.is_here else time.time_ns()

    def tell(seconds: Any) -> int:
        now_s = date_ns() // NS_PER_S
        if seconds:
            seconds[0] = now_s
        return now_s

    def tell_exactly(seconds: Any, _zone: object) -> int:
        seconds[0], rest_ns = divmod(date_ns(), NS_PER_S)
        seconds[1] = rest_ns // 1000
        return 0

    def tell_clock(clock: int, seconds: Any) -> int:
        seconds[0], seconds[1] = divmod(date_ns() if clock in CALENDARS else time.clock_gettime_ns(clock), NS_PER_S)
        return 0

    bodies = {"time": _Time(tell), "gettimeofday": _TimeOfDay(tell_exactly), "clock_gettime": _GetTime(tell_clock)}
    _KEPT.extend(bodies.values())
    with suppress(OSError):
        for name, place in _entries(path):
            _write(place, ctypes.cast(bodies[name], ctypes.c_void_p).value or 0)


@cache
def _entries(path: str) -> list[tuple[str, int]]:
    """Return where the addresses of functions that tell the date stand in a loaded library, each with its name."""
    library = _Library.from_address(ctypes.CDLL(path, mode=_LOADED_ALREADY)._handle)
    tables = {}
    place = library.tables
    while tag := ctypes.c_int64.from_address(place).value:
        tables[tag] = ctypes.c_uint64.from_address(place + 8).value
        place += 16
    names = ctypes.string_at(tables[_NAMES], tables[_NAMES_SIZE])
    # One name may be the end of a longer one.
    wanted = {
        found.start(1): found[1].decode() for found in re.finditer(rb"(?=(time|gettimeofday|clock_gettime)\0)", names)
    }
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
