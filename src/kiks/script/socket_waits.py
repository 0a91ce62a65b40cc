"""Sockets with both ends in the program: reading and writing them waits in simulated time. Others are refused.

Those onto robots are in `robot_sockets.py`. What comes from the outside comes in real time, and would make a run that
cannot be repeated.
"""

from __future__ import annotations

import _socket
import ipaddress
import select
import socket
import weakref
from contextlib import suppress
from typing import Any

from kiks.script.file_waits import Files
from kiks.script.patching import for_program
from kiks.script.refusals import refuse_network
from kiks.script.robot_sockets import RobotSockets
from kiks.script.thread_scheduler import Scheduler

EVENTS = frozenset(
    f"socket.{name}" for name in ("bind", "connect", "sendto", "sendmsg", "getaddrinfo", "gethostbyname")
)
"""Audit events of calls that may reach the outside (docs.python.org/3/library/audit_events.html)."""

_READS = ("recv", "recv_into", "recvfrom", "recvfrom_into", "recvmsg", "recvmsg_into", "_accept")
_NAMES = ("bind", "connect", "connect_ex", "sendto", "sendmsg")
"""Methods that give a socket an address."""
_methods = dict(vars(_socket.socket))

# Sockets of the program that have an address of their own.
_own: weakref.WeakSet[Any] = weakref.WeakSet()
# Addresses of such sockets, which may be closed before it is asked who has sent from there.
_addresses: set[Any] = set()


def is_inside(event: str, arguments: tuple[Any, ...]) -> bool:
    """Return whether a call, told by an audit event, reaches the program itself alone."""
    if event in ("socket.getaddrinfo", "socket.gethostbyname"):
        return _is_here(arguments[0])
    where, address = arguments[0], arguments[1]
    _own.add(where)
    return event == "socket.bind" or address is None or _owner_of(address) is not None


def _is_here(host: Any) -> bool:
    """Return whether the address of a host is known without asking a name server."""
    name = host.decode(errors="replace") if isinstance(host, bytes) else host
    if name in (None, "", "localhost", socket.gethostname()):
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _owner_of(address: Any) -> Any:
    """Return the program's socket with an address; None if there is none."""
    for each in _own:
        try:
            own = each.getsockname()
        except OSError:
            continue
        if not own:
            continue
        if own == address:
            return each
        if isinstance(own, tuple) and isinstance(address, tuple) and own[1] == address[1]:
            # The program may name this computer in several ways.
            host = "127.0.0.1" if address[0] == "localhost" else address[0]
            if own[0] in (host, "0.0.0.0", "::") and _is_here(host) and ipaddress.ip_address(host).is_loopback:
                return each
    return None


def replacements(scheduler: Scheduler, files: Files, robots: RobotSockets) -> dict[str, dict[str, Any]]:
    """Return the replacements for methods of sockets.

    Args:
        scheduler: The program's threads.
        files: The files that they wait for.
        robots: The program's sockets onto robots.
    """

    def wait(sock: Any, event: int) -> None:
        timeout_s = sock.gettimeout()
        # Of a closed one, its method says so.
        if sock.fileno() >= 0 and not files.wait_for(sock.fileno(), event, timeout_s) and timeout_s != 0:
            raise TimeoutError("timed out")

    def reading(name: str) -> Any:
        real = _methods[name]

        def call(sock: Any, *args: Any, **kwargs: Any) -> Any:
            wait(sock, select.POLLIN)
            return real(sock, *args, **kwargs)

        return call

    def sendall(sock: Any, data: Any, flags: int = 0, /) -> None:
        left = memoryview(data).cast("B")
        while left:
            wait(sock, select.POLLOUT)
            left = left[_methods["send"](sock, left, flags | socket.MSG_DONTWAIT) :]

    def send(sock: Any, data: Any, flags: int = 0, /) -> int:
        size = memoryview(data).nbytes
        if size and sock.gettimeout() is None:
            # It returns when all has been taken, for which others may have to read.
            sendall(sock, data, flags)
            return size
        wait(sock, select.POLLOUT)
        return int(_methods["send"](sock, data, flags))

    def naming(name: str) -> Any:
        real = _methods[name]

        def call(sock: Any, *args: Any) -> Any:
            if name.startswith("send"):
                wait(sock, select.POLLOUT)
            else:
                # TCP would keep characters back for some real time, until earlier ones are acknowledged. What a socket
                # accepts inherits this.
                with suppress(OSError):
                    _methods["setsockopt"](sock, socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            try:
                return real(sock, *args)
            finally:
                if sock.fileno() >= 0:
                    files.note_inside(sock.fileno())
                    _addresses.add(sock.getsockname())

        return call

    def accept(sock: Any) -> Any:
        wait(sock, select.POLLIN)
        descriptor, address = _methods["_accept"](sock)
        if address and address not in _addresses and _owner_of(address) is None:
            refuse_network(scheduler, "another program has connected to it")
        files.note_inside(descriptor)
        return descriptor, address

    def socketpair(*args: Any) -> Any:
        pair = _socket.socketpair(*args)
        files.note_inside(*(each.fileno() for each in pair))
        return pair

    def getaddrinfo(host: Any, port: Any, *args: Any, **kwargs: Any) -> Any:
        if robots.is_at(host, port) and not _is_here(host):
            # A robot is known by the name of its host.
            return [(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP, "", (host, int(port)))]
        return _socket.getaddrinfo(host, port, *args, **kwargs)

    own = {name: reading(name) for name in _READS} | {name: naming(name) for name in _NAMES}
    own |= {"send": send, "sendall": sendall, "_accept": accept}
    methods = robots.methods(own, lambda address: _owner_of(address) is not None)
    return {
        "_socket": {"socketpair": socketpair, "getaddrinfo": getaddrinfo},
        "_socket.socket": {name: for_program(scheduler, method, _methods[name]) for name, method in methods.items()},
    }
