"""A program's sockets onto robots: by Bluetooth, and by TCP at a robot's address.

A socket that connects gets the descriptor of a port (`port_file.py`) in the place of its own. So threads, `select` and
event loops wait for it as for a serial port. Replies come whole, as in packets, and the line keeps its speed.
"""

from __future__ import annotations

import _socket
import errno
import os
import socket
import weakref
from collections.abc import Callable, Mapping
from typing import Any, cast

from kiks.errors import KiksError, shown
from kiks.script.file_waits import Files
from kiks.script.port_file import PortFile
from kiks.script.shared_line import SharedLine
from kiks.script.thread_scheduler import Scheduler
from kiks.sim.port import VirtualPort, WriteTimeoutError
from kiks.sim.read_completion import REPLY_END, Read

ROBOT_PORT = 1000
"""The TCP port at which robots in a wireless network listen."""

CONSTANTS: dict[str, Any] = {
    "AF_BLUETOOTH": 31,
    "BTPROTO_RFCOMM": 3,
    "BDADDR_ANY": "00:00:00:00:00:00",
    "BDADDR_LOCAL": "00:00:00:FF:FF:FF",
}
"""Names of Linux (bluetooth.h) that `socket` has only where Python was built with them."""

_RFCOMM = CONSTANTS["AF_BLUETOOTH"], socket.SOCK_STREAM, CONSTANTS["BTPROTO_RFCOMM"]
_INTERNET = socket.AF_INET, socket.AF_INET6
# Plain numbers, because an enum costs as much as all else here.
_PEEK, _DO_NOT_WAIT, _WAIT_FOR_ALL = map(int, (socket.MSG_PEEK, socket.MSG_DONTWAIT, socket.MSG_WAITALL))
_methods = dict(vars(_socket.socket))

Method = Callable[..., Any]


def _of_twin(name: str) -> Method:
    """Return a method about a socket's options."""
    return lambda file, _sock, *args: _methods[name](file.twin, *args)


class SocketFile(PortFile):
    """The descriptor of a socket that is connected to a robot, and the socket's methods.

    Args:
        scheduler: The program's threads.
        line: The line of its robot.
        port: The robot's port.

    Attributes:
        address: Where it is connected to.
        twin: Another socket with the descriptor that the program's had, for its options.
        is_connecting: Whether the program has yet to see that it is connected.
    """

    address: Any
    twin: Any
    is_connecting = False

    # The system keeps less in a socket than in a terminal, if it comes in small pieces.
    most_characters = 64

    def __init__(self, scheduler: Scheduler, line: SharedLine, port: VirtualPort) -> None:
        super().__init__(scheduler, line, port)
        self._is_shut = self._is_mute = False
        # What the program has only looked at.
        self._ahead = b""

    def _open(self) -> tuple[int, int]:
        # Not every sandbox has terminals.
        here, there = _socket.socketpair()
        return here.detach(), there.detach()

    def _readable(self, arrived: int) -> tuple[int, Read]:
        line = self.line
        if self._ahead or self._is_shut:
            arrived = max(arrived, 1)
        elif not (arrived and line.wait_for([Read(line.robot, None, REPLY_END)], line.now_ns)[0]):
            return 0, Read(line.robot, None, REPLY_END)
        return arrived, Read(line.robot, arrived + 1)

    def read(self, length: int, descriptor: int) -> bytes:
        """Read as `os.read` does."""
        return self._receive(length, None if os.get_blocking(descriptor) else 0.0)

    def close(self) -> None:
        """Close the descriptor."""
        super().close()
        self.twin.close()

    def _ask(self, timeout_s: float | None, question: Callable[[VirtualPort], Any]) -> Any:
        """Return the answer of the robot's port to a question.

        Raises:
            TimeoutError: If it takes too long.
            ConnectionResetError: If it fails.
        """
        port: VirtualPort = self.port
        try:
            if timeout_s != port.timeout:
                port.timeout = port.write_timeout = timeout_s
            return question(port)
        except WriteTimeoutError:
            raise TimeoutError("timed out") from None
        except KiksError as error:
            raise ConnectionResetError(errno.ECONNRESET, str(error)) from None

    def _receive(self, size: int, timeout_s: float | None, flags: int = 0) -> bytes:
        data, self._ahead = self._ahead[:size], self._ahead[size:]
        if (left := size - len(data)) and not self._is_shut:
            is_whole, timeout_s = flags & _WAIT_FOR_ALL, 0.0 if data else timeout_s
            data += self._ask(timeout_s, lambda port: port.read(left) if is_whole else port.receive(left))
            # Nothing at all is the end of the connection.
            if not data and not self._is_shut:
                if timeout_s == 0:
                    raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
                raise TimeoutError("timed out")
        if flags & _PEEK:
            self._ahead = data + self._ahead
        return data

    # ---- what sockets have; each gets the program's socket ----

    def recv(self, sock: Any, size: int, flags: int = 0, /) -> bytes:
        """See `socket.recv`."""
        if size < 0:
            raise ValueError("negative buffersize in recv")
        return self._receive(size, 0.0 if flags & _DO_NOT_WAIT else sock.gettimeout(), flags)

    def recvfrom(self, sock: Any, size: int, flags: int = 0, /) -> tuple[bytes, None]:
        """See `socket.recvfrom`."""
        return self.recv(sock, size, flags), None

    def recv_into(self, sock: Any, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
        """See `socket.recv_into`."""
        with memoryview(buffer).cast("B") as view:
            data = self.recv(sock, nbytes or len(view), flags)
            view[: len(data)] = data
        return len(data)

    def send(self, sock: Any, data: Any, _flags: int = 0, /) -> int:
        """See `socket.send`."""
        characters = memoryview(data).tobytes()
        if self._is_mute:
            raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
        return int(self._ask(sock.gettimeout(), lambda port: port.write(characters)))

    def sendall(self, sock: Any, data: Any, flags: int = 0, /) -> None:
        """See `socket.sendall`."""
        if self.send(sock, data, flags) < memoryview(data).nbytes:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    def sendmsg(self, sock: Any, buffers: Any, *_: Any) -> int:
        """See `socket.sendmsg`."""
        return self.send(sock, b"".join(buffers))

    def connect(self, _sock: Any, _address: Any, /) -> None:
        """See `socket.connect`: the first one after one that did not wait succeeds."""
        if not self.is_connecting:
            raise OSError(errno.EISCONN, os.strerror(errno.EISCONN))
        self.is_connecting = False

    def getpeername(self, _sock: Any, /) -> Any:
        """See `socket.getpeername`."""
        return self.address

    def shutdown(self, _sock: Any, how: int, /) -> None:
        """See `socket.shutdown`: what reads gets the end of the connection, and what sends an error."""
        self._is_mute |= how != socket.SHUT_RD
        if how != socket.SHUT_WR:
            self._is_shut = True
            self.port.cancel_read()

    setsockopt, getsockopt, getsockname = map(_of_twin, ("setsockopt", "getsockopt", "getsockname"))


_METHODS = (
    *("recv", "recvfrom", "recv_into", "send", "sendall", "sendmsg", "connect"),
    *("getpeername", "shutdown", "setsockopt", "getsockopt", "getsockname"),
)


class RobotSockets:
    """The sockets of a program that lead to robots.

    Args:
        scheduler: The program's threads.
        files: Where they get their descriptors.
        open_port: Returns the port behind a name.
        addresses: Addresses of robots, such as `192.168.1.2:23`, besides those at `ROBOT_PORT`.
    """

    def __init__(
        self, scheduler: Scheduler, files: Files, open_port: Callable[[str], VirtualPort], addresses: Mapping[str, str]
    ) -> None:
        self._scheduler, self._files, self._open_port, self._addresses = scheduler, files, open_port, addresses

    def is_at(self, host: Any, port: Any) -> bool:
        """Return whether a robot is at a TCP port of a host."""
        return str(port) == str(ROBOT_PORT) or f"{host}:{port}" in self._addresses

    def methods(self, others: Mapping[str, Method], is_own: Callable[[Any], bool]) -> dict[str, Method]:
        """Return methods for all sockets.

        Args:
            others: Methods of sockets that do not lead to robots; the real ones where there is none.
            is_own: Returns whether a socket of the program has an address.
        """
        real = _methods | dict(others)

        def connecting(sock: Any, address: Any, /) -> None:
            name = self._name(sock, address)
            if name is None or is_own(address):
                real["connect"](sock, address)
            else:
                self._connect(sock, address, name)

        connect = self._either("connect", connecting)

        def connect_ex(sock: Any, address: Any, /) -> int:
            if self._at(sock) is None and (self._name(sock, address) is None or is_own(address)):
                return int(real["connect_ex"](sock, address))
            try:
                connect(sock, address)
            except OSError as error:
                return error.errno or 0
            return 0

        def create(sock: Any, family: int = -1, type: int = -1, proto: int = -1, fileno: int | None = None) -> None:
            if fileno is None and (family, type, proto) == _RFCOMM:
                # It needs no radio, which this computer may lack.
                fileno = _socket.socket(socket.AF_UNIX).detach()
            _methods["__init__"](sock, family, type, proto, fileno)

        def close(sock: Any, /) -> None:
            file = self._at(sock)
            _methods["close"](sock)
            if file is not None:
                self._let_go(file)

        own: dict[str, Method] = {"connect": connect, "connect_ex": connect_ex, "__init__": create, "close": close}
        return {**others, **{name: self._either(name, real[name]) for name in _METHODS}, **own}

    def _either(self, name: str, other: Method) -> Method:
        """Return a method that does one thing for sockets onto robots, another for all others."""

        def call(sock: Any, *args: Any, **kwargs: Any) -> Any:
            file = self._at(sock)
            return other(sock, *args, **kwargs) if file is None else getattr(file, name)(sock, *args, **kwargs)

        return call

    def _at(self, sock: Any) -> SocketFile | None:
        file = self._files.port_at(sock.fileno())
        return file if isinstance(file, SocketFile) else None

    def _name(self, sock: Any, address: Any) -> str | None:
        """Return by which name a robot is found at an address; None if there is none."""
        if sock.fileno() < 0 or sock.type != socket.SOCK_STREAM or not isinstance(address, tuple) or len(address) < 2:
            return None
        host, port = address[:2]
        if sock.family == CONSTANTS["AF_BLUETOOTH"]:
            return host if host in self._addresses else str(host).upper()
        return f"{host}:{port}" if sock.family in _INTERNET and self.is_at(host, port) else None

    def _connect(self, sock: Any, address: Any, name: str) -> None:
        try:
            port = self._open_port(name)
            port.claim(f"the program that connected to {shown(name)}")
        except KiksError as error:
            raise ConnectionRefusedError(errno.ECONNREFUSED, str(error)) from None
        port.reset_input_buffer()
        twin = _socket.socket(sock.family, sock.type, sock.proto, os.dup(sock.fileno()))
        file = self._files.add(cast(SharedLine, port.line), port, SocketFile)
        file.address, file.twin = address, twin
        os.dup2(file.descriptor, sock.fileno(), inheritable=False)
        os.set_blocking(sock.fileno(), sock.gettimeout() is None)
        # A socket that is only dropped is closed, too.
        weakref.finalize(sock, self._let_go, file).atexit = False
        if sock.gettimeout() == 0:
            file.is_connecting = True
            raise BlockingIOError(errno.EINPROGRESS, os.strerror(errno.EINPROGRESS))

    def _let_go(self, file: SocketFile) -> None:
        """Hang up, once."""
        if file.port.is_open and self._scheduler.is_here:
            self._files.remove(file.descriptor)
            file.port.close()
