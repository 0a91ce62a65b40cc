"""Debuggers that people bring along: while one has stopped a program, it lives in real time, and the world stands.

Those of VS Code and PyCharm are pydevd; most others build on Python's own `bdb`. Both have few calls in which they wait
for a person.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import wraps
from types import FrameType, ModuleType
from typing import Any

from kiks.script.cpython import carrying, change_class, real_locals
from kiks.script.here import showing_robot
from kiks.script.libraries.host import Host
from kiks.script.patching import Replacements
from kiks.script.thread_scheduler import Scheduler

_STOPS = ("user_line", "user_call", "user_return", "user_exception", "user_opcode")
"""Methods of a debugger that `bdb` calls at a stop."""


def _standing(scheduler: Scheduler, real: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(real)
    def call(*args: Any, **kwargs: Any) -> Any:
        with scheduler.standing():
            return real(*args, **kwargs)

    return call


def _all_standing(scheduler: Scheduler, owner: Any, *names: str) -> dict[str, Any]:
    return {name: _standing(scheduler, getattr(owner, name)) for name in names if hasattr(owner, name)}


def adapt_bdb(bdb: ModuleType, host: Host) -> Replacements:
    """Let the world stand at a stop of a debugger that builds on `bdb`, such as pdb, ipdb, pudb and Spyder's."""
    carry_trace(host.scheduler)
    known: set[type] = {object}

    def adapt(debugger: type) -> None:
        for each in {*debugger.__mro__} - known:
            known.add(each)
            for name in _STOPS:
                if name in vars(each):
                    change_class(each, name, _standing(host.scheduler, vars(each)[name]), host.undo)
        for each in debugger.__subclasses__():
            adapt(each)

    def reset(self: Any) -> None:
        # It begins, and may be of a class that was not there before.
        adapt(type(self))
        real_reset(self)

    real_reset = bdb.Bdb.reset
    adapt(bdb.Bdb)
    return {"bdb.Bdb": {"reset": reset}}


def adapt_pydevd(pydevd: ModuleType, host: Host) -> Replacements:
    """Let the world stand at a stop of pydevd, and while it gets in contact with an editor."""
    scheduler = host.scheduler
    carry_trace(scheduler)
    for each in real_locals():
        scheduler.carry(*carrying(vars(each)))
    wait = pydevd.PyDB.do_wait_suspend

    def stop(debugger: Any, thread: Any, frame: FrameType, *args: Any, **kwargs: Any) -> Any:
        with scheduler.standing(), showing_robot(frame):
            return wait(debugger, thread, frame, *args, **kwargs)

    return {
        "pydevd.PyDB": {
            "do_wait_suspend": stop,
            # A condition takes no time of the program.
            **_all_standing(scheduler, pydevd.PyDB, "handle_breakpoint_condition", "handle_breakpoint_expression"),
        },
        "pydevd": _all_standing(scheduler, pydevd, "settrace", "_wait_for_attach"),
        # It waits for a thread of its own.
        "pydevd_tracing": _all_standing(scheduler, sys.modules.get("pydevd_tracing"), "set_trace_to_threads"),
    }


def adapt_start(*names: str) -> Callable[[ModuleType, Host], Replacements]:
    """Return an adapter for functions by which a debugger starts: its processes, sockets and threads are real ones."""
    return lambda module, host: {module.__name__: _all_standing(host.scheduler, module, *names)}


def carry_trace(scheduler: Scheduler) -> None:
    """Let each thread of the program have its own function that traces it."""
    scheduler.carry(_take_trace, _put_trace)


def _take_trace() -> Any:
    trace = sys.gettrace()
    _put_trace(None)
    return trace


def _put_trace(trace: Any) -> None:
    # In the place of Python's own function, pydevd has put one that warns of it.
    getattr(sys.modules.get("pydevd_tracing"), "_original_settrace", sys.settrace)(trace)
