"""One line for a program that cannot run in simulated time: what it must do, what it did, and where."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from types import FrameType

from kiks.script.callers import INSTALLED
from kiks.script.thread_scheduler import Scheduler

OURS = (str(Path(__file__).parent.parent), os.path.dirname(os.__file__))
"""Folders of foreign code: KiKS, and Python's own library."""


def refusal(must: str, given: str, way: str = "") -> str:
    """Return the line for a program: what it must do, what it did, and what to do instead."""
    advice = f"{way}run it on kiks serve, where time is real."
    return f"a program in simulated time must {must}, but {given}. {advice[0].upper()}{advice[1:]}"


def refuse(scheduler: Scheduler, must: str, given: str, way: str = "") -> None:
    """End the program with this line."""
    scheduler.end(1, refusal(must, given + where(sys._getframe()), way))


def refuse_network(scheduler: Scheduler, given: str) -> None:
    """End a program that talks to others than its robots."""
    refuse(scheduler, "talk to its robots alone", given)


def is_of_kiks(name: str) -> bool:
    """Return whether a file of code is one of KiKS."""
    return name.startswith(OURS[0])


def is_of_program(name: str) -> bool:
    """Return whether a file of code is one of the program's own, not of a library."""
    return not name.startswith(("<", *OURS)) and not any(folder in name for folder in INSTALLED)


def where(frame: FrameType | None) -> str:
    """Say where in the program a frame is.

    Returns:
        The innermost line of the program's own files; that of an installed library if there is none; or nothing.
    """
    found = ""
    while frame is not None:
        name = frame.f_code.co_filename
        is_own = is_of_program(name)
        if is_own or any(folder in name for folder in INSTALLED):
            found = found if found and not is_own else f" ({os.path.basename(name)}, line {frame.f_lineno})"
            if is_own:
                break
        frame = frame.f_back
    return found
