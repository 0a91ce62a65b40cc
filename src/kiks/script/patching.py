"""Puts what is simulated inside the functions and classes of Python while a program runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial, update_wrapper
from itertools import chain
from types import BuiltinFunctionType
from typing import Any

from kiks.script.callers import Caller, caller, is_for_program
from kiks.script.cpython import Undo, change_class, change_function, unchanged, uncollected
from kiks.script.thread_scheduler import Scheduler

Replacements = Mapping[str, Mapping[str, Any]]
"""What stands in, by module, or module and class, and name."""

_MISSING = object()


class Query:
    """What stands in for a clock.

    Args:
        asked: Returns the time to a program that asks for it, which costs it some.
        waited: Returns it to a library that waits with a timeout.
    """

    def __init__(self, asked: Callable[..., Any], waited: Callable[..., Any]) -> None:
        self.asked = asked
        self.waited = waited


class ForAll:
    """What stands in for all callers in this process.

    Args:
        body: The function.
    """

    def __init__(self, body: Callable[..., Any]) -> None:
        self.body = body


@contextmanager
def replaced(parts: Iterable[Replacements], scheduler: Scheduler) -> Iterator[None]:
    """Let names of modules and classes mean something else, for the threads of a program.

    A function in C stays the same object and gets another body, which the program and its libraries reach. KiKS, and
    other threads of this process, still get the function as it was. Anything else in a module gets another value.
    A class stays the same object and gets an attribute; a method that must tell callers apart uses `for_program`.

    Args:
        parts: What stands in. A module that has not been imported, or has no such name, is left alone.
        scheduler: The threads of the program.
    """
    undo = Undo()
    try:
        change(chain.from_iterable(part.items() for part in parts), scheduler, undo)
        yield
    finally:
        undo()


@uncollected()
def change(replacements: Iterable[tuple[str, Mapping[str, Any]]], scheduler: Scheduler, undo: Undo) -> None:
    """Put in what stands in, by path; see `replaced`."""
    for path, names in replacements:
        owner = _find(path)
        found = {} if owner is None else vars(owner)
        for name, value in names.items():
            # In the place of some functions of threads, pydevd has put its own, and keeps them under such a name.
            before = found.get(f"_original_{name}", found.get(name, _MISSING))
            if isinstance(owner, type):
                change_class(owner, name, value, undo)
            # This version of Python has no such name.
            elif before is _MISSING:
                continue
            elif isinstance(before, BuiltinFunctionType) and isinstance(value, ForAll):
                change_function(before, value.body, undo)
            elif isinstance(before, BuiltinFunctionType) and (callable(value) or isinstance(value, Query)):
                change_function(before, for_program(scheduler, value, unchanged(before)), undo)
            else:
                undo.add(partial(setattr, owner, name, before))
                setattr(owner, name, value)


def for_program(
    scheduler: Scheduler, simulated: Callable[..., Any] | Query, real: Callable[..., Any]
) -> Callable[..., Any]:
    """Return a function that does one thing for a program and its libraries, another for what lives in real time."""
    frame = sys._getframe
    asked, waited = (simulated.asked, simulated.waited) if isinstance(simulated, Query) else (simulated, simulated)
    bodies = {Caller.PROGRAM: asked, Caller.WAITS: waited, Caller.REAL: real}

    def call(*args: Any, **kwargs: Any) -> Any:
        if not scheduler.is_here:
            if scheduler.is_standing and is_for_program(frame(1)):
                with scheduler.resumed():
                    return asked(*args, **kwargs)
            return real(*args, **kwargs)
        try:
            return bodies[caller(frame(1))](*args, **kwargs)
        # A wrong call must say what it says without KiKS.
        except (AttributeError, TypeError) as error:
            if not _is_about_arguments(error):
                raise
            wrong = error
        # Python has its own words for it.
        real(*args, **kwargs)
        raise wrong

    return update_wrapper(call, real, ("__name__", "__qualname__", "__doc__"), ())


def _is_about_arguments(error: AttributeError | TypeError) -> bool:
    """Return whether an error came up in what stands in, not in code of the program that it called."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and str(trace.tb_frame.f_globals.get("__name__")).startswith("kiks.script.")


def _find(path: str) -> Any:
    if path in sys.modules:
        return sys.modules[path]
    parent, _, name = path.rpartition(".")
    return getattr(sys.modules.get(parent), name, None)
