"""curses and pygame: what their code in C asks of others, a wait or the time, becomes simulated.

A wait for a key ends with one, as any wait for a file does.
"""

from __future__ import annotations

import ctypes
import select
from itertools import count
from types import ModuleType
from typing import Any

from kiks.script.libraries.c_calls import date_functions, loaded, redirect
from kiks.script.libraries.host import Host
from kiks.script.patching import Replacements
from kiks.script.thread_scheduler import timeout_ns
from kiks.sim.read_completion import NEVER_NS
from kiks.units import NS_PER_S

NS_PER_MS = 1_000_000

_Int, _Pointer = ctypes.c_int, ctypes.c_void_p
_Poll = ctypes.CFUNCTYPE(_Int, _Pointer, ctypes.c_ulong, _Int)
_Read = ctypes.CFUNCTYPE(ctypes.c_ssize_t, _Int, _Pointer, ctypes.c_size_t)
_Sleep = ctypes.CFUNCTYPE(_Int, ctypes.POINTER(ctypes.c_long), _Pointer)
_Ticks, _Delay = ctypes.CFUNCTYPE(ctypes.c_uint32), ctypes.CFUNCTYPE(_Int, ctypes.c_uint32)
_Ring = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_uint32, _Pointer)
_AddTimer = ctypes.CFUNCTYPE(_Int, ctypes.c_uint32, _Ring, _Pointer)


def adapt_curses(_: ModuleType, host: Host) -> Replacements:
    """Let waits for keys and `napms` take simulated time."""
    system = ctypes.CDLL(None)
    real_poll, real_read = _Poll(("poll", system)), _Read(("read", system))

    def poll(files: Any, file_count: int, timeout_ms: int) -> int:
        keyboard, timeout_s = ctypes.c_int.from_address(files).value, None if timeout_ms < 0 else timeout_ms / 1000
        host.files.wait(lambda block_ms: real_poll(files, file_count, block_ms), timeout_s, (keyboard,))
        return int(real_poll(files, file_count, 0))

    def read(descriptor: int, data: Any, size: int) -> int:
        host.files.wait_for(descriptor, select.POLLIN)
        return int(real_read(descriptor, data, size))

    def sleep(duration: Any, _rest: object) -> int:
        host.clock.sleep(duration[0] + duration[1] / NS_PER_S)
        return 0

    functions = {"poll": (_Poll, poll), "read": (_Read, read), "nanosleep": (_Sleep, sleep)}
    for each in loaded("curses|tinfo"):
        redirect(each, date_functions(lambda: host.scheduler.world.now_ns) | functions, host)
    return {}


def adapt_pygame(module: ModuleType, host: Host) -> Replacements:
    """Let clocks, waits and timers of `pygame.time` take simulated time."""
    scheduler, start_ns, numbers = host.scheduler, host.scheduler.world.now_ns, count(1)

    def ticks() -> int:
        return (host.clock.ask_ns() - start_ns) // NS_PER_MS

    def delay(milliseconds: int) -> int:
        host.clock.sleep(milliseconds / 1000)
        return 0

    def add_timer(interval_ms: int, ring: Any, data: Any) -> int:
        def run() -> None:
            at_ns, wait_ms = scheduler.world.now_ns, interval_ms
            while wait_ms:
                at_ns += wait_ms * NS_PER_MS
                scheduler.sleep_until(at_ns)
                wait_ms = ring(wait_ms, data)
                host.note_event()

        scheduler.start(run, (), {})
        return next(numbers)

    functions = {"SDL_GetTicks": (_Ticks, ticks), "SDL_Delay": (_Delay, delay), "SDL_AddTimer": (_AddTimer, add_timer)}
    redirect(str(module.__file__), functions, host)
    return {}


def adapt_pygame_events(module: ModuleType, host: Host) -> Replacements:
    """Return what stands in for names of `pygame.event`."""
    world, real_post = host.scheduler.world, module.post

    def post(event: Any, /) -> bool:
        is_posted = bool(real_post(event))
        host.note_event()
        return is_posted

    def wait(timeout: int = 0) -> Any:
        until_ns = world.now_ns + timeout_ns(timeout / 1000) if timeout > 0 else NEVER_NS
        while not (event := module.poll()) and world.now_ns < until_ns:
            host.wait_for_event(until_ns)
        return event

    return {"pygame.event": {"post": post, "wait": wait}}
