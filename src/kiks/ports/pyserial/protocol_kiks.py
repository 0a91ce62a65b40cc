"""pyserial's plug-in for `serial.serial_for_url("kiks://1")`: a `Serial` object like any other."""

from __future__ import annotations

from typing import Any

# pyserial imports this module when a program opens such a name, so pyserial is loaded already.
from serial import PortNotOpenError, SerialBase, SerialException  # noqa: TID253

from kiks.errors import KiksError, shown
from kiks.ports import url
from kiks.sim.port import VirtualPort


class Serial(SerialBase):  # type: ignore[misc, unused-ignore]
    """A serial port with a simulated robot at its other end."""

    _sim_port: VirtualPort | None = None

    def find(self, name: str) -> VirtualPort:
        """Return the simulated port behind a name; `kiks run` overrides this with its own mapping."""
        return url.find_port(name)

    def _take(self, port: VirtualPort) -> None:
        """Take a port exclusively for this program."""
        port.claim(f"the program that opened {shown(self.port)}")

    def _give_back(self, port: VirtualPort) -> None:
        """Release a port."""
        port.close()

    def open(self) -> None:
        """Open the port.

        Raises:
            SerialException: If the port does not exist, or another program has it open.
        """
        if self.port is None:
            raise SerialException(
                "a port must have a name before it is opened, but it has none. Set .port to 'kiks://1'."
            )
        if self.is_open:
            raise SerialException(f"port {self.port!r} must be closed before it is opened, but it is open.")
        try:
            self._sim_port = self.find(str(self.port))
            self._take(self._sim_port)
        except KiksError as error:
            raise SerialException(str(error)) from None
        self.is_open = True
        try:
            self._reconfigure_port()
        except ValueError:
            self.close()
            raise

    def close(self) -> None:
        """Hang up. The robot drives on."""
        if self.is_open and self._sim_port is not None:
            self._give_back(self._sim_port)
        self.is_open = False
        self._sim_port = None

    def _reconfigure_port(self, *_: Any, **__: Any) -> None:
        # The real robot ignores stop bits, parity and flow control, too (khepera-protocol.md 2.1).
        if self._sim_port is None:
            return
        self._sim_port.timeout = self.timeout
        try:
            self._sim_port.baudrate = self.baudrate
        except KiksError as error:
            raise ValueError(str(error)) from None

    @property
    def _open_port(self) -> VirtualPort:
        if self._sim_port is None:
            raise PortNotOpenError
        return self._sim_port

    @property
    def in_waiting(self) -> int:
        """Characters that have arrived and were not read."""
        return self._open_port.in_waiting

    @property
    def out_waiting(self) -> int:
        """Characters in the output buffer: none, as if the driver took all at once."""
        return 0

    def read(self, size: int = 1) -> bytes:
        """Read `size` characters, fewer if the timeout is over first."""
        return self._ask(lambda port: port.read(size))

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Read up to and including a terminator."""
        return self._ask(lambda port: port.read_until(expected, size))

    def readline(self, size: int | None = -1, /) -> bytes:
        """Read a line with its end."""
        return self._ask(lambda port: port.readline(size))

    def _ask(self, question: Any) -> bytes:
        try:
            answer: bytes = question(self._open_port)
        except KiksError as error:
            raise SerialException(str(error)) from None
        return answer

    def write(self, b: Any, /) -> int:
        """Write bytes; text must be encoded first, as for any serial port."""
        return self._open_port.write(b)

    def flush(self) -> None:
        """Wait until all characters have been sent."""
        self._open_port.flush()

    def reset_input_buffer(self) -> None:
        """Drop characters that have arrived."""
        self._open_port.reset_input_buffer()

    def reset_output_buffer(self) -> None:
        """Do nothing: written characters are on the line."""
        self._open_port.reset_output_buffer()

    # A Khepera has no control lines and needs none (khepera-protocol.md 2.1).

    def _update_break_state(self) -> None: ...

    def _update_rts_state(self) -> None: ...

    def _update_dtr_state(self) -> None: ...

    @property
    def cts(self) -> bool:
        """Always ready."""
        return True

    @property
    def dsr(self) -> bool:
        """Always ready."""
        return True

    @property
    def ri(self) -> bool:
        """Never: no modem rings."""
        return False

    @property
    def cd(self) -> bool:
        """Held active by the interface box."""
        return True
