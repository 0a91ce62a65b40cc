"""Devices of serial lines: a program in simulated time opens none, because a real robot may be at its other end."""

from __future__ import annotations

import os
import re
import stat
from contextlib import suppress
from pathlib import Path
from typing import Any

DRIVERS = Path("/proc/tty/drivers")
"""Where Linux lists the drivers of terminals, with the numbers of their devices and what they are for (man 5 proc)."""

_NAME = re.compile(r"/dev/(tty[A-Za-z]|cu\.|serial/|rfcomm)")
_SPACE = re.compile(r"[\s;&|()<>='\"]+")


def is_serial(path: Any) -> bool:
    """Return whether a path leads to the device of a serial line, in whatever way it is written.

    The number of the device tells, as it does the kernel. One that is not there is known by its name.

    Example:
        >>> is_serial("/dev/../dev/ttyUSB0"), is_serial(b"/dev/ttyACM3"), is_serial("/dev/null"), is_serial("/dev/tty")
        (True, True, False, False)
    """
    if not isinstance(path, str | bytes | os.PathLike):
        return False
    if _NAME.match(os.fsdecode(path)):
        return True
    try:
        state = os.stat(path)
    except (OSError, ValueError):
        return _leads_to_name(path)
    return stat.S_ISCHR(state.st_mode) and (_is_driven(state.st_rdev) or _leads_to_name(path))


def serial_in(command: str) -> str | None:
    """Return the first word of a command that is such a path; None if there is none."""
    return next((word for word in _SPACE.split(command) if is_serial(word)), None)


def _leads_to_name(path: Any) -> bool:
    return _NAME.match(os.path.realpath(os.fsdecode(path))) is not None


def _is_driven(device: int) -> bool:
    """Return whether a driver of serial lines has a device."""
    with suppress(OSError):
        for line in DRIVERS.read_text().splitlines():
            *_, major, minors, purpose = line.split()
            first, _, last = minors.partition("-")
            if purpose == "serial" and int(major) == os.major(device) and int(first) <= os.minor(device):
                return os.minor(device) <= int(last or first)
    return False
