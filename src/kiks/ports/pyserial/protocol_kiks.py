"""pyserial's plug-in for `serial.serial_for_url("kiks://1")`: a `Serial` object like any other."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from typing import Any, TypeVar, cast

# pyserial imports this module when a program opens such a name, so pyserial is loaded already.
import serial  # noqa: TID253
from serial import PortNotOpenError, SerialBase, SerialException, SerialTimeoutException  # noqa: TID253
from serial.serialutil import to_bytes  # type: ignore[attr-defined, unused-ignore]  # noqa: TID253

from kiks.errors import KiksError, shown
from kiks.ports import url
from kiks.sim.port import VirtualPort, WriteTimeoutError

VTIME_MAX = 255
"""Longest `inter_byte_timeout` that a terminal's driver takes [0.1 s]."""

Result = TypeVar("Result")


class RobotPort:
    """The methods with which a class of pyserial has a simulated robot at its other end.

    They replace those that use the operating system. `kiks run` puts them into pyserial's classes while a program runs
    (`script/serial_ports.py`), so they are functions without `super`.

    Attributes:
        sim_port: The simulated port; None while it is closed.
    """

    # Of pyserial's base class.
    is_open: bool
    fd: Any
    _port: str | None
    _baudrate: int
    _timeout: float | None
    _write_timeout: float | None
    _inter_byte_timeout: float | None
    _rs485_mode: Any
    _exclusive: bool | None

    sim_port: Any = None
    _line_baudrate: int | None = None

    def open(self) -> None:
        """Open the port.

        Raises:
            SerialException: If the port does not exist, or another program has it open.
        """
        if self._port is None:
            raise SerialException("Port must be configured before it can be used.")
        if self.is_open:
            raise SerialException("Port is already open.")
        try:
            port = url.find_port(str(self._port))
            port.claim(f"the program that opened {shown(self._port)}")
        except KiksError as error:
            raise SerialException(str(error)) from None
        self.sim_port, self._line_baudrate = port, None
        # The descriptor that pyserial's own `close` finds if the program leaves the port open.
        vars(self)["fd"] = None
        try:
            self._reconfigure_port()
        except Exception:
            self.close()
            raise
        port.reset_input_buffer()
        self.is_open = True

    def close(self) -> None:
        """Hang up. The robot drives on."""
        port, self.sim_port, self.is_open = self.sim_port, None, False
        if port is not None:
            port.close()

    def _reconfigure_port(self, force_update: bool = False) -> None:
        # The real robot ignores stop bits, parity and flow control, too (khepera-protocol.md 2.1).
        port = self.sim_port
        if port is None:
            raise SerialException("Can only operate on a valid file descriptor")
        vtime = int((self._inter_byte_timeout or 0) * 10)
        if vtime > VTIME_MAX:
            raise ValueError(f"Invalid vtime: {vtime!r}")
        if self._rs485_mode is not None:
            # As the driver of the usual adapter from USB answers.
            raise ValueError("Failed to set RS485 mode: [Errno 25] Inappropriate ioctl for device")
        try:
            port.timeout, port.write_timeout = self._timeout, self._write_timeout
            if self._baudrate != self._line_baudrate:
                port.baudrate = self._line_baudrate = self._baudrate
        except KiksError as error:
            raise ValueError(str(error)) from None

    # ---- characters ----

    def _ask(self, question: Callable[[VirtualPort], Result]) -> Result:
        """Return the answer of the simulated port to a question.

        Raises:
            PortNotOpenError: If it is not open.
            SerialException: If the question fails.
            TypeError: If another thread closes the port meanwhile: pyserial's methods then use a descriptor of None.
        """
        port = self.sim_port
        if port is None:
            raise PortNotOpenError
        try:
            return question(port)
        except WriteTimeoutError:
            raise SerialTimeoutException("Write timeout") from None
        except KiksError as error:
            if self.sim_port is not port:
                raise TypeError("'NoneType' object cannot be interpreted as an integer") from None
            raise SerialException(str(error)) from None

    def read(self, size: int = 1) -> bytes:
        """Read `size` characters, fewer if the timeout is over first."""
        return self._ask(lambda port: port.read(size))

    # Whoever overrides `read` sees each character, as with pyserial.

    def readline(self, size: int | None = -1, /) -> bytes:
        """Read up to the end of a line, or to a character that does not come within the timeout."""
        if getattr(self.read, "__func__", None) is not RobotPort.read:
            return io.RawIOBase.readline(cast(Any, self), size)
        return self._ask(lambda port: port.readline(size))

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Read up to a terminator, or to the first character after the timeout."""
        if getattr(self.read, "__func__", None) is not RobotPort.read or not isinstance(expected, bytes | bytearray):
            return SerialBase.read_until(cast(Any, self), expected, size)
        return self._ask(lambda port: port.read_until(expected, size))

    def write(self, data: Any, /) -> int:
        """Write bytes; text must be encoded first, as for any serial port."""
        return self._ask(lambda port: port.write(to_bytes(data)))

    def flush(self) -> None:
        """Wait until all characters have been sent."""
        self._ask(lambda port: port.flush())

    def reset_input_buffer(self) -> None:
        """Drop characters that have arrived."""
        self._ask(lambda port: port.reset_input_buffer())

    def reset_output_buffer(self) -> None:
        """Drop nothing: what was written is on its way to the robot."""
        self._ask(lambda port: port.reset_output_buffer())

    def cancel_read(self) -> None:
        """End the read of another thread, or the next one, at once."""
        if self.sim_port is not None:
            self.sim_port.cancel_read()

    def cancel_write(self) -> None:
        """End the write of another thread, or the next one, instead of waiting for room."""
        if self.sim_port is not None:
            self.sim_port.cancel_write()

    # ---- what pyserial asks of the descriptor, without a look at whether the port is open ----

    def _ask_descriptor(self, question: Callable[[VirtualPort], Result]) -> Result:
        """Return the answer of the simulated port to a question.

        Raises:
            AttributeError: If it has never been open.
            TypeError: If it is closed.
        """
        port = self.sim_port
        if port is None:
            _ = self.fd
            raise TypeError("argument must be an int, or have a fileno() method.")
        return question(port)

    @property
    def in_waiting(self) -> int:
        """Characters that have arrived and were not read."""
        return self._ask_descriptor(lambda port: port.in_waiting)

    @property
    def out_waiting(self) -> int:
        """Characters that have not been sent yet."""
        return self._ask_descriptor(lambda port: port.out_waiting)

    def set_low_latency_mode(self, low_latency_settings: bool) -> None:
        """Do nothing: the line has no other latency than its characters'."""
        self._ask_descriptor(lambda _: None)

    def fileno(self) -> int:
        """Return the descriptor, which a port has under `kiks run`."""
        return self._ask(lambda _: io.RawIOBase.fileno(cast(Any, self)))

    def nonblocking(self) -> None:
        """Warn as pyserial does: reads do not block after `select`."""
        warnings.warn("nonblocking() has no effect, already nonblocking", DeprecationWarning, stacklevel=2)

    # ---- lines and flow control: a Khepera has none and needs none (khepera-protocol.md 2.1) ----

    def set_input_flow_control(self, enable: bool = True) -> None:
        """Do nothing."""
        self._ask(lambda _: None)

    set_output_flow_control = set_input_flow_control

    def send_break(self, duration: float = 0.25) -> None:
        """Let the time of a break pass, in the tenths of a second that Linux makes of pyserial's quarters."""
        self._ask(lambda port: port.sleep(-(-int(duration / 0.25) // 100) / 10 or 0.25))

    def _update_break_state(self) -> None: ...

    _update_rts_state = _update_dtr_state = _update_break_state

    cts = dsr = cd = property(lambda self: self._ask(lambda _: True))
    """Always ready, and held active by the interface box."""

    ri = property(lambda self: self._ask(lambda _: False))
    """Never: no modem rings."""


class Serial(RobotPort, serial.Serial):  # type: ignore[misc, unused-ignore]
    """A serial port with a simulated robot at its other end."""
