"""What a program imports as `bluetooth` under `kiks run`: robots as PyBluez would find them, by Bluetooth.

It runs under that name, as part of the program, so that its waits are the program's.
"""

from __future__ import annotations

import errno
import os
import socket
import sys
import time
from collections.abc import Callable
from typing import Any

__all__ = [
    *("HCI", "L2CAP", "PORT_ANY", "RFCOMM", "SCO", "SERIAL_PORT_CLASS", "SERIAL_PORT_PROFILE"),
    *("BluetoothError", "BluetoothSocket", "bluez", "btcommon"),
    *("discover_devices", "find_service", "is_valid_address", "lookup_name"),
]

HCI, RFCOMM, L2CAP, SCO, PORT_ANY = 1, 3, 0, 2, 0
SERIAL_PORT_CLASS, SERIAL_PORT_PROFILE = "1101", ("1101", 0x0100)

_SERIAL_PORTS = (SERIAL_PORT_CLASS, "00001101-0000-1000-8000-00805F9B34FB")
"""The number of the service in both its forms (Bluetooth Assigned Numbers)."""

CHANNEL = 1
"""The channel of RFCOMM at which robots have their line."""

DEVICE_CLASS = 0x1F00
"""The class of a device that says nothing of itself."""

ROUND_S = 1.28
"""Time of a round of a search for devices [s] (Bluetooth Core Specification, "Inquiry_Length")."""

nearby: dict[str, str] = {}
"""The names of the robots by address; KiKS fills it."""


class BluetoothError(OSError):
    """An error of a Bluetooth socket."""


class BluetoothSocket(socket.socket):
    """A socket that speaks RFCOMM to a robot; see PyBluez."""

    def __init__(self, proto: int = RFCOMM) -> None:
        if proto != RFCOMM:
            raise BluetoothError(errno.EPROTONOSUPPORT, os.strerror(errno.EPROTONOSUPPORT))
        super().__init__(socket.AF_BLUETOOTH, socket.SOCK_STREAM, socket.BTPROTO_RFCOMM)


def _in_its_words(name: str) -> Callable[..., Any]:
    """Return a method of sockets whose errors are of PyBluez."""
    method = getattr(socket.socket, name)

    def call(self: BluetoothSocket, *args: Any) -> Any:
        if args and isinstance(args[0], str):
            args = args[0].encode(), *args[1:]  # PyBluez sends texts, too
        try:
            return method(self, *args)
        except OSError as error:
            wrong = BluetoothError(*error.args)
            wrong.__context__, wrong.__suppress_context__ = error.__context__, True
        raise wrong

    return call


for _name in (
    *("accept", "bind", "connect", "getpeername", "getsockname", "listen"),
    *("recv", "recv_into", "send", "sendall", "shutdown"),
):
    setattr(BluetoothSocket, _name, _in_its_words(_name))


def is_valid_address(address: str) -> bool:
    """Return whether a text is an address of Bluetooth."""
    parts = address.split(":")
    return len(parts) == 6 and all(len(part) == 2 and set(part) <= set("0123456789abcdefABCDEF") for part in parts)


def discover_devices(
    duration: int = 8, flush_cache: bool = True, lookup_names: bool = False, lookup_class: bool = False, **_: Any
) -> list[Any]:
    """Return the addresses of the robots, with their names or classes if they are asked for."""
    time.sleep(duration * ROUND_S)
    found = [(address, name) for address, name in nearby.items() if is_valid_address(address)]
    if not (lookup_names or lookup_class):
        return [address for address, _ in found]
    return [(address, *[name][: int(lookup_names)], *[DEVICE_CLASS][: int(lookup_class)]) for address, name in found]


def lookup_name(address: str, timeout: float = 10) -> str | None:
    """Return the name of the robot at an address; None if there is none."""
    if not is_valid_address(address):
        raise BluetoothError(errno.EINVAL, f"{address} is not a valid Bluetooth address")
    return nearby.get(address, nearby.get(address.upper()))


def find_service(name: str | None = None, uuid: str | None = None, address: str | None = None) -> list[dict[str, Any]]:
    """Return the lines of all robots, or of the one at an address: services with the names of robots."""
    places = [address] if address else discover_devices()
    if uuid is not None and uuid.upper() not in _SERIAL_PORTS:
        return []
    said = {"protocol": "RFCOMM", "port": CHANNEL, "service-classes": [SERIAL_PORT_CLASS], "service-id": None}
    said |= {"profiles": [SERIAL_PORT_PROFILE], "description": "", "provider": ""}
    names = [(place, lookup_name(place)) for place in places]
    return [said | {"host": place, "name": each} for place, each in names if each and name in (None, each)]


# The parts of PyBluez that programs import by name.
btcommon = bluez = sys.modules[f"{__name__}.btcommon"] = sys.modules[f"{__name__}.bluez"] = sys.modules[__name__]
