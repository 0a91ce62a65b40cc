"""A robot of a world on another computer: `kiks://HOST:PORT/1?token=TOKEN` (the command `kiks host`).

A program elsewhere is one of the programs that share a world. Its messages are those of a process of `kiks run`, over a
WebSocket of the desk's server.
"""

from __future__ import annotations

import json
import re
import socket
import threading
import weakref
from contextlib import ExitStack, suppress
from typing import Annotated, Any, NamedTuple
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field

from kiks.clock.program_clock import ProgramClock
from kiks.errors import LinkError, ParameterError, shown
from kiks.model.checks import ROBOTS_MAX
from kiks.model.data_file import Number, Switch, Text, Whole, check, record
from kiks.model.limits import MESSAGE_BYTES_MAX
from kiks.model.settings import ThinkingPolicy
from kiks.ports.link import RemoteLine, SocketLink
from kiks.ports.messages import (
    ANSWER_BYTES_MAX,
    RECEIVE_SIZE,
    REQUEST_BYTES_MAX,
    Answer,
    Asked,
    Inbox,
    MessageError,
    Request,
    Start,
    Verb,
    checked_request,
    packed,
)
from kiks.sim.port import VirtualPort
from kiks.units import NS_PER_S
from kiks.version import __version__

PATH = "/robot"
"""Path of the WebSocket on the desk's server."""

OPEN_S = 10.0
"""Longest wait for a host [s of real time]."""

_ROBOT = re.compile(r"/(?P<robot>[0-9]{1,4})/?\?token=(?P<token>[A-Za-z0-9_-]+)")


def _check_printable(text: str) -> str:
    if not text.isprintable():
        raise ParameterError(f"must be printable, but it was {shown(text)}")
    return text


Printable = Annotated[Text, AfterValidator(_check_printable)]


@record
class Welcome:
    """What a host tells a program that takes a robot; other attributes are those of `Start`.

    Attributes:
        version: The version of KiKS there.
        robot: Number of the robot.
    """

    version: Text
    robot: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)]
    is_late: Switch
    end_ns: Annotated[Whole, Field(ge=0, lt=1 << 64)]
    thinking: ThinkingPolicy
    offered: Annotated[tuple[Printable, ...], Field(max_length=ROBOTS_MAX)]
    seed: Text
    pulse_mm: Annotated[Number, Field(gt=0, le=1000)]
    addresses: Annotated[dict[Printable, Printable], Field(max_length=2 * ROBOTS_MAX)]

    @property
    def start(self) -> Start:
        """What the program gets at its start."""
        return Start(
            *(self.is_late, self.end_ns, self.thinking, list(self.offered), self.seed),
            pulse_mm=self.pulse_mm,
            addresses=self.addresses,
        )


class Address(NamedTuple):
    """The address of a robot of a host.

    Attributes:
        place: Host and TCP port.
        token: The token of the robot.
        robot: Number of the robot; 0: the one of the token.
    """

    place: str
    token: str
    robot: int = 0

    @staticmethod
    def parse(url: str) -> Address:
        """Return the address in `kiks://HOST:PORT/1?token=TOKEN`.

        Example:
            >>> Address.parse("kiks://127.0.0.1:8123/2?token=abc")
            Address(place='127.0.0.1:8123', token='abc', robot=2)
        """
        try:
            parts = urlsplit(url)
            has_place = parts.scheme == "kiks" and bool(parts.hostname and parts.port)
        except ValueError:  # a bracket that is not closed, or a port that is no number
            has_place = False
        if not (has_place and (found := _ROBOT.fullmatch(f"{parts.path}?{parts.query}"))):
            raise LinkError(
                "a robot on another computer must be named as kiks host prints it, kiks://HOST:PORT/1?token=TOKEN, but "
                f"it was {shown(url.partition('?')[0])}. Copy the whole address, in quotes."
            )
        return Address(parts.netloc, found["token"], int(found["robot"]))


class HostSocket:
    """The WebSocket to a host, with the methods of a socket that a `SocketLink` needs.

    Args:
        address: The address of the robot.

    Attributes:
        robot: Number of the robot.
        start: What the program has to know of the world.

    Raises:
        LinkError: If there is no host, or it does not let the program in.
    """

    def __init__(self, address: Address) -> None:
        # Imported here: few programs need it.
        from websockets.exceptions import InvalidStatus, WebSocketException
        from websockets.sync.client import connect

        self.place = address.place
        self._has_left = False
        self._failures = (OSError, WebSocketException)
        self._open = ExitStack()
        host = f"the host of robots at {shown(address.place)}"
        try:
            connection = connect(
                f"ws://{address.place}{PATH}",
                additional_headers={"Authorization": f"Bearer {address.token}"},
                compression=None,
                proxy=None,
                open_timeout=OPEN_S,
                max_size=MESSAGE_BYTES_MAX,
            )
            self._socket: Any = self._open.enter_context(connection)
            first = self._socket.recv(OPEN_S)
        except InvalidStatus as refusal:
            raise LinkError(
                f"{host} must know the token, but it does not let this program in ({refusal.response.status_code}). "
                "Take the address that kiks host prints there now."
            ) from None
        except self._failures as error:
            with suppress(*self._failures):
                self._open.close()
            raise LinkError(
                f"{host} must let the program in, but it does not: {self._why(error)} Is kiks host running there, with "
                "--host for other computers?"
            ) from None
        try:
            welcome = self._welcomed(first, address)
        except LinkError:
            self.close()
            raise
        self.robot, self.start = welcome.robot, welcome.start

    def _welcomed(self, first: object, address: Address) -> Welcome:
        try:
            fields = json.loads(first) if isinstance(first, str) else None
        except (ValueError, RecursionError):
            fields = None
        version = fields.get("version") if isinstance(fields, dict) else None
        # Before anything else is read: messages of another version may mean something else.
        if version != __version__:
            raise LinkError(
                f"both computers must have the same KiKS, but {shown(address.place)} has {shown(version)}, and this is "
                f"{__version__}. Install the same one."
            )
        welcome = check(Welcome, fields, f"the host at {shown(address.place)}", error=LinkError)
        # The file would be one of this computer, by a name that a stranger chose.
        if welcome.thinking.startswith("replay"):
            raise LinkError("a host must tell the program's thinking time, but it asks for a file of this computer.")
        if address.robot not in (0, welcome.robot):
            raise LinkError(
                f"the token must be that of robot {address.robot}, but it is that of robot {welcome.robot}. Copy the "
                "whole address that kiks host prints."
            )
        return welcome

    def strange(self) -> LinkError:
        """Close the connection to a host that does not answer as KiKS does; return the error."""
        self.close()
        return LinkError(f"the host at {shown(self.place)} must answer as KiKS does, but it does not. Is it kiks host?")

    def sendall(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            OSError: If the connection is closed.
        """
        try:
            self._socket.send(data)
        except self._failures as error:
            raise OSError(self._why(error)) from None

    def recv(self, _size: int = 0) -> bytes:
        """Return the next bytes; none if the connection is closed."""
        try:
            data = self._socket.recv()
            return data if isinstance(data, bytes) else b""
        except self._failures:
            return b""

    @property
    def farewell(self) -> str:
        """Why the host has closed the connection, as a sentence; empty if this end has."""
        if self._has_left:
            return ""
        reason = self._socket.protocol.close_reason
        return shown(reason)[1:-1] if reason else "The connection was lost."

    def close(self) -> None:
        """Close the connection; the host learns that the program has left by itself."""
        # If the host has closed it before, the reason is the host's.
        self._has_left = self._has_left or self._socket.protocol.close_rcvd is None
        with suppress(*self._failures):
            self._open.close()

    def _why(self, error: BaseException) -> str:
        closed = getattr(getattr(self, "_socket", None), "protocol", None)
        if closed is not None and closed.close_reason:
            return self.farewell
        return f"{shown(getattr(error, 'strerror', None) or str(error))[1:-1].rstrip('.')}."


class HostLink(SocketLink):
    """The link of a program in this process to a world on another computer.

    Args:
        host: The connection to the host.
    """

    slice_ns = NS_PER_S

    def __init__(self, host: HostSocket) -> None:
        super().__init__(host, is_late=host.start.is_late, end_ns=host.start.end_ns)
        self._host = host
        self._asked = Asked()
        self.make_answer = self._asked.answer

    def _transmit(self, request: Request) -> None:
        self._asked.note(request)
        super()._transmit(request)

    def _wait(self, ticket: int) -> Answer:
        try:
            return super()._wait(ticket)
        except MessageError:
            raise self._host.strange() from None

    def end(self) -> None:
        """Tell that the connection has ended.

        Raises:
            LinkError: Always.
        """
        raise LinkError(
            f"the host at {shown(self._host.place)} must be there, but has gone: {self._host.farewell} Open the port "
            "again: the program then goes on from there."
        )

    def close(self) -> None:
        """Leave the world; earlier requests are still done."""
        with suppress(LinkError):
            self.send(Verb.REACHED)
        self._host.close()


class HostedPort(VirtualPort):
    """The port of a robot on another computer. The program takes part in that world until it closes the port.

    Args:
        url: The address of the robot.

    Attributes:
        robot: Number of the robot.
    """

    def __init__(self, url: str) -> None:
        host = HostSocket(Address.parse(url))
        self._place, link = host.place, HostLink(host)
        super().__init__(RemoteLine(link, host.robot), ProgramClock(host.start.thinking))
        self.robot = host.robot
        # At the end of the process, too: a connection that only breaks off counts as lost.
        self._leave = weakref.finalize(self, link.close)

    def claim(self, holder: str) -> None:
        """Reserve the line; the name of the holder has no token."""
        super().claim("a program elsewhere")

    def close(self) -> None:
        """Close the port and leave the world. The robot drives on."""
        with suppress(LinkError):
            super().close()
        self._leave()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: robot {self.robot} at {self._place}{'' if self.is_open else ', closed'}>"


def relay(host: HostSocket, connection: socket.socket) -> None:
    """Carry the messages of a program at the end of a socket, until it or the host ends.

    Raises:
        LinkError: If the host does not answer as KiKS does; the program, which trusts its socket, gets none of that.
    """
    asked, requests, answers = Asked(), Inbox(REQUEST_BYTES_MAX), Inbox(ANSWER_BYTES_MAX)

    def to_host() -> None:
        with suppress(OSError, MessageError):
            while data := connection.recv(RECEIVE_SIZE):
                for fields in requests.take(data):
                    asked.note(checked_request(fields))
                host.sendall(data)
        host.close()

    threading.Thread(target=to_host, name="kiks relay", daemon=True).start()
    try:
        while data := host.recv():
            connection.sendall(b"".join(packed(asked.answer(fields)) for fields in answers.take(data)))
    except MessageError:
        raise host.strange() from None
    except OSError:
        pass  # the program has ended
    finally:
        with suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)
