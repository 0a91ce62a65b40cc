"""What a program finds in `serial`: every port is a simulated robot's, whatever name it is given.

pyserial's own classes stay, and get other methods while the program runs. So `loop://` is pyserial's, and `spy://`,
`alt://` and `hwgrep://` are pyserial's around a robot's port. A port at a pseudo-terminal of the program leads to what
the program does at the other end: it gets pyserial's methods back.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterator, MutableSet, Sequence
from contextlib import contextmanager
from typing import Any

from kiks.ports import url as urls
from kiks.script.file_waits import Files
from kiks.script.port_file import PortFile
from kiks.script.shared_line import SharedLine
from kiks.sim.port import Line, VirtualPort

ROBOT_CLASSES = (
    "serial.Serial",
    "serial.rfc2217.Serial",
    "serial.urlhandler.protocol_socket.Serial",
    "kiks.ports.pyserial.protocol_kiks.Serial",
)
"""The classes of pyserial whose ports are robots."""

USB_ADAPTER = (0x0403, 0x6001)
"""Vendor and product of the most common adapter from USB to a serial line, FTDI's FT232: programs look for it."""


@contextmanager
def left_open(ports: MutableSet[Any]) -> Iterator[None]:
    """Leave what a program has not closed to the end of its process: pyserial's own `close` does nothing later."""
    try:
        yield
    finally:
        for port in ports:
            # Nor does that of the next program, whose descriptors and lines are others.
            vars(port).update(is_open=False, sim_port=None, _descriptor=None)


def replacements(
    open_port: Callable[[str], VirtualPort], ports: Files, names: Sequence[str], opened: MutableSet[Any]
) -> dict[str, dict[str, Any]]:
    """Return what stands in for names of `serial`, by module.

    Args:
        open_port: Returns the port behind a name.
        ports: Where ports get their file descriptors.
        names: Port names that a program finds when it looks for ports, one a robot.
        opened: Gets the ports that it opens.
    """
    import serial.rfc2217
    import serial.tools.list_ports
    import serial.urlhandler.protocol_socket  # noqa: F401  (only what was imported can be replaced)

    from kiks.ports.pyserial.protocol_kiks import RobotPort

    return {
        **dict.fromkeys(ROBOT_CLASSES, _methods_of(RobotPort) | _port_methods(ports, opened)),
        "serial.PosixPollSerial": {"read": RobotPort.read},
        "serial.tools.list_ports": {"comports": lambda include_links=False, _hide_subsystems=None: _listed(names)},
        # `kiks.Khepera` and `kiks.kopen` find their ports by this function.
        urls.__name__: {"find_port": open_port},
    }


def _port_methods(ports: Files, opened: MutableSet[Any]) -> dict[str, Any]:
    """Return what a port in a program has besides the robot's methods."""
    import serial

    from kiks.ports.pyserial.protocol_kiks import RobotPort

    # A subclass of the program's has its own methods before these, and these before a robot's.
    real_port = type("Serial", (serial.Serial,), {"fd": None, **_methods_of(serial.Serial)})
    # The port that has locked each line with `exclusive`.
    lock_holders: dict[Line, Port] = {}

    class Port(RobotPort):
        """The methods that need the program's descriptors."""

        _descriptor: int | None = None

        def open(self) -> None:
            if self._port is not None and ports.terminals.has(self._port):
                # The program itself plays the device at the other end: pyserial is right there.
                kind: type = type(self)
                self.__class__ = real_port if kind is serial.Serial else type(kind.__name__, (kind, real_port), {})
                self.open()
                return
            RobotPort.open(self)
            opened.add(self)

        def _reconfigure_port(self, force_update: bool = False) -> None:
            if self._exclusive:
                line = self.sim_port.line
                if lock_holders.setdefault(line, self) is not self:
                    why = os.strerror(errno.EAGAIN)
                    raise serial.SerialException(
                        errno.EAGAIN, f"Could not exclusively lock port {self._port}: [Errno {errno.EAGAIN}] {why}"
                    )
            elif self._exclusive is not None:
                unlock(self)
            RobotPort._reconfigure_port(self)

        def close(self) -> None:
            descriptor, self._descriptor = self._descriptor, None
            if descriptor is not None:
                ports.remove(descriptor)
            unlock(self)
            RobotPort.close(self)

        def fileno(self) -> int:
            if self._descriptor is None:
                line = self._ask(lambda port: port.line)
                if not isinstance(line, SharedLine):
                    return RobotPort.fileno(self)
                self._descriptor = ports.add(line, self, PortFile).descriptor
            return self._descriptor

        @property
        def fd(self) -> int | None:
            if self.sim_port is None and "fd" not in vars(self):
                raise AttributeError(f"{type(self).__name__!r} object has no attribute 'fd'")
            return None if self.sim_port is None else self.fileno()

    def unlock(port: Port) -> None:
        for line in [line for line, holder in lock_holders.items() if holder is port]:
            del lock_holders[line]

    return _methods_of(Port)


def _methods_of(cls: type) -> dict[str, Any]:
    return {name: value for name, value in vars(cls).items() if not name.startswith(("__", "_abc"))}


def _listed(names: Sequence[str]) -> list[Any]:
    """Return what `comports` tells of the ports of robots."""
    from serial.tools.list_ports_common import ListPortInfo

    found = []
    for number, name in enumerate(names, 1):
        info = ListPortInfo(name)
        info.description = f"USB Serial Port (simulated Khepera {number})"
        info.vid, info.pid = USB_ADAPTER
        info.serial_number, info.location = f"KIKS{number:04}", f"1-{number}"
        info.manufacturer, info.product = "KiKS", f"Simulated Khepera {number}"
        info.hwid = info.usb_info()
        found.append(info)
    return found
