"""The functions of the Matlab KiKS: `kopen`, `ksend`, `kclose`, `ktime` and `pause`.

A negative port is a simulated robot (-1 is robot 1, -2 robot 2 of the newest simulation), any other number a real
serial port (0 is the first one). Source: thesis 3.3 ("The interface") and appendix A, kiks-behaviour.md 1.2.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from kiks.client.khepera import Khepera
from kiks.client.port import open_port
from kiks.errors import LinkError, ParameterError, shown
from kiks.model.array_checks import check_numbers
from kiks.model.checks import SECONDS_MAX, check_kind, check_number

Reference = tuple[float, float, float, float]
"""Result of `kopen`: four numbers, as in the Matlab KiKS, each that of the port."""

_OPEN: dict[int, tuple[Khepera, float]] = {}
"""The robots at open ports, and when they were opened [s], by their numbers, the oldest first."""


def kopen(settings: Sequence[float]) -> Reference:
    r"""Open a robot's port and return a reference for `ksend` and `kclose`.

    Args:
        settings: [port, baud, timeout]: port number (negative: simulated), line speed [bit/s] (9600 if left out) and
            timeout [s] (1 if left out).

    Raises:
        LinkError: If the port does not exist or is open already.

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation()
        >>> ref = kopen([-1, 9600, 1])
        >>> ksend("D,0,0\n", ref)
        'd'
        >>> kclose(ref)
    """
    given: object = settings
    values: Any = None if isinstance(given, str) else check_numbers("settings", given).tolist()
    is_list = isinstance(values, list) and 1 <= len(values) <= 3
    if not is_list or isinstance(values[0], list) or abs(values[0]) > 9999 or any(each % 1 for each in values[:2]):
        raise ParameterError(
            f"settings must be [port, baud, timeout], the first two whole numbers, but it was {shown(settings)}. "
            "Simulated: [-1, 9600, 1]."
        )
    number = int(values[0])
    baud = int(values[1]) if len(values) > 1 else 9600
    timeout_s = values[2] if len(values) > 2 else 1.0
    if number in _OPEN:
        raise LinkError(
            f"port {number} must be closed before it is opened, but it is open. Call kclose(ref) or kclose([]) first."
        )
    robot = Khepera(open_port(f"kiks://{-number}" if number < 0 else _device(number), baud, timeout_s))
    _OPEN[number] = robot, robot.time_s
    reference = float(number), float(number), float(number), float(number)
    # The Matlab KiKS exchanged a first command, too. A real robot that is off gives an empty reply.
    ksend("B\r", reference)
    return reference


def ksend(text: str, ref: Sequence[float], timeout: float | None = None) -> str:
    r"""Send a command and return the reply without its line end.

    Args:
        text: The command with its terminator, LF or CR; empty to let time pass only.
        ref: Result of `kopen`.
        timeout: Longest time to wait for the reply [s], if it is not that of `kopen`.

    Returns:
        The reply, or the part of it that arrived before the timeout.

    Raises:
        LinkError: If the port is not open.

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation(seed=1)
        >>> ref = kiks.kopen([-1, 9600, 1])
        >>> kiks.ksend("B\n", ref)
        'b,5.02,5.01'
        >>> kiks.kclose(ref)
    """
    check_kind("text", text, str, r'Write ksend("N\n", ref).')
    robot = _open_robot(ref)
    port: Any = robot.port
    if not text:
        _ = robot.time_s
        return ""
    before = port.timeout
    if timeout is not None:
        port.timeout = check_number("timeout", timeout, 0)
    try:
        port.write(text.encode("latin-1", errors="replace"))
        if not text.endswith(("\n", "\r")):
            return ""
        reply: bytes = port.read_until(b"\n")
        return reply.rstrip(b"\r\n").decode("ascii", errors="replace")
    finally:
        port.timeout = before


def kclose(ref: Sequence[float]) -> None:
    """Close a port; `[]` closes every simulated one. Does nothing if it is not open. The robot drives on.

    Example:
        >>> import kiks
        >>> kiks.kclose([])
    """
    if isinstance(ref, list | tuple) and not ref:
        numbers = [number for number in _OPEN if number < 0]
    else:
        numbers = [_port_number(ref)]
    for number in numbers:
        if number in _OPEN:
            _OPEN.pop(number)[0].close()


def ktime(port: int | Sequence[float]) -> float | None:
    """Return the time since a port was opened [s], simulated or real; None if it is not open.

    Args:
        port: The port's number, or the result of `kopen`.

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation(seed=1)
        >>> ref = kiks.kopen([-1, 9600, 1])
        >>> kiks.pause(0.5)
        >>> round(kiks.ktime(-1), 1)
        0.5
        >>> kiks.kclose(ref)
    """
    robot, opened_s = _OPEN.get(_port_number(port), (None, 0.0))
    return None if robot is None else robot.time_s - opened_s


def pause(seconds: float) -> None:
    """Let time pass [s]: simulated time if a simulated port was opened last, else real time.

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation(seed=1)
        >>> ref = kiks.kopen([-1, 9600, 1])
        >>> kiks.pause(0.5)  # of simulated time
        >>> kiks.kclose(ref)
    """
    robot, _ = next(reversed(_OPEN.values()), (None, 0.0))
    if robot is not None:
        robot.pause(seconds)
    else:
        time.sleep(check_number("seconds", seconds, 0, SECONDS_MAX, "Time never runs backwards."))


def _open_robot(ref: Sequence[float]) -> Khepera:
    number = _port_number(ref) if isinstance(ref, list | tuple) and len(ref) >= 4 else None
    if number not in _OPEN:
        raise LinkError(
            f"ref must be what kopen returned and still be open, but it was {shown(ref)}. "
            "Open it with kopen([-1, 9600, 1])."
        )
    return _OPEN[number][0]


def _port_number(ref: Any) -> int:
    """Return the number of the port that a reference, or the number itself, names."""
    numbers = check_numbers("ref", ref).ravel()
    if not len(numbers):
        raise ParameterError("ref must be what kopen returned, or a port's number, but it was empty.")
    return int(numbers[0])


def _device(number: int) -> str:
    """Return the name of a real serial port: 0 is COM1 or /dev/ttyS0, as in the Matlab KiKS."""
    import os

    return f"COM{number + 1}" if os.name == "nt" else f"/dev/ttyS{number}"
