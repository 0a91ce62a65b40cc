"""What a program finds in `serial`: every port is a simulated robot's, whatever name it is given."""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence
from typing import Any

from kiks.ports import url as urls
from kiks.script.file_waits import Files
from kiks.script.shared_line import SharedLine
from kiks.sim.port import VirtualPort

USB_ADAPTER = (0x0403, 0x6001)
"""Vendor and product of the most common adapter from USB to a serial line, FTDI's FT232: programs look for it."""


def replacements(
    open_port: Callable[[str], VirtualPort], ports: Files, names: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Return what stands in for names of `serial`, `glob` and `os`, by module.

    Args:
        open_port: Returns the port behind a name.
        ports: Where ports get their file descriptors.
        names: Port names that a program finds when it looks for ports, one a robot.
    """
    import serial
    import serial.tools.list_ports
    from serial.tools import list_ports_common

    from kiks.ports.pyserial import protocol_kiks

    # The ports that the program has open, by line.
    holders: dict[int, list[Serial]] = {}

    class Serial(protocol_kiks.Serial):
        """The port that a program gets when it opens a serial port."""

        _descriptor: int | None = None

        def find(self, name: str) -> VirtualPort:
            return open_port(name)

        def _take(self, port: VirtualPort) -> None:
            others = holders.setdefault(id(port.line), [])
            if self.exclusive and any(other.exclusive for other in others):
                raise serial.SerialException(
                    errno.EWOULDBLOCK, f"Could not exclusively lock port {self.port}: it is open already"
                )
            # As with a real port, a program may open a port twice; the first read gets the characters.
            if not others:
                super()._take(port)
            others.append(self)

        def _give_back(self, port: VirtualPort) -> None:
            others = holders[id(port.line)]
            others.remove(self)
            if not others:
                super()._give_back(port)

        def _ask(self, question: Any) -> bytes:
            answer = super()._ask(question)
            if not self.is_open:  # another thread has closed it meanwhile
                raise serial.PortNotOpenError
            return answer

        def fileno(self) -> int:
            if self._descriptor is None:
                line = self._open_port.line
                if not isinstance(line, SharedLine):
                    return super().fileno()
                self._descriptor = ports.add(line, self)
            return self._descriptor

        @property
        def fd(self) -> int | None:
            return self.fileno() if self.is_open else None

        def close(self) -> None:
            if self._descriptor is not None:
                ports.remove(self._descriptor)
                self._descriptor = None
            super().close()

        def cancel_read(self) -> None:
            line = self._open_port.line
            if isinstance(line, SharedLine):
                line.cancel_read()

        def cancel_write(self) -> None:
            """Do nothing: written characters are on the line."""

        def nonblocking(self) -> None:
            """Do nothing: reads do not block after `select`."""

    def serial_for_url(url: str, *args: Any, do_not_open: bool = False, **settings: Any) -> Serial:
        port = Serial(None, *args, **settings)
        port.port = url
        if not do_not_open:
            port.open()
        return port

    def comports(include_links: bool = False, _hide_subsystems: Any = None) -> list[Any]:
        found = []
        for number, name in enumerate(names, 1):
            info = list_ports_common.ListPortInfo(name)
            info.description = f"USB Serial Port (simulated Khepera {number})"
            info.vid, info.pid = USB_ADAPTER
            info.serial_number, info.location = f"KIKS{number:04}", f"1-{number}"
            info.manufacturer, info.product = "KiKS", f"Simulated Khepera {number}"
            info.hwid = info.usb_info()
            found.append(info)
        return found

    return {
        "serial": {"Serial": Serial, "serial_for_url": serial_for_url},
        "serial.tools.list_ports": {"comports": comports},
        # `kiks.Khepera` and `kiks.kopen` find their ports by this function.
        urls.__name__: {"find_port": open_port},
    }
