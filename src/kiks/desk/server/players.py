"""Programs elsewhere that drive robots of a desk: the host's end of `ports/joining.py`."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict

from starlette.websockets import WebSocket, WebSocketDisconnect

from kiks.desk.server.access import ABORT
from kiks.desk.server.desk import Desk
from kiks.desk.server.token import Token
from kiks.errors import KiksError
from kiks.ports.joining import Welcome
from kiks.ports.messages import RECEIVE_SIZE
from kiks.ports.programs import Programs
from kiks.ports.resources import opening
from kiks.ports.socket_participant import SocketParticipant
from kiks.version import __version__

REASON_BYTES_MAX = 120
"""Longest reason for which a WebSocket closes (RFC 6455, 5.5: 125 bytes with the code)."""

LEFT = 1000
"""Code with which a program that leaves by itself closes its WebSocket (RFC 6455, 7.4.1); any other one is lost."""

BACK_S = 0.5
"""Time after which another program may take a robot [s of real time], so that one that comes and goes costs little."""

CLOSE_S = 2.0
"""Longest wait for a program that does not take the message that its connection ends [s]."""

ENDED, REFUSED = 1001, 1008
"""Codes with which a host closes it: it goes away, or a program violates a policy."""


class Players:
    """Lets programs elsewhere take robots of a desk.

    Args:
        desk: The desk.
        robots: Numbers of the robots.
        say: Called with a line of text about each program that comes or goes.

    Attributes:
        robots: The robots by their tokens.
    """

    def __init__(self, desk: Desk, robots: range, say: Callable[[str], None]) -> None:
        self.robots = {Token(): robot for robot in robots}
        self._desk, self._say = desk, say
        self._has_paused = False
        self._coming: set[int] = set()
        self._next_s = dict.fromkeys(robots, 0.0)

    def pause(self) -> None:
        """Pause the world until a program comes, as all have left; the caller holds the lock of the world."""
        self._desk.present.pause()
        self._has_paused = True

    async def serve(self, web: WebSocket, key: Token) -> None:
        """Carry the messages of a program until it leaves, or the world lets go of it."""
        robot = self.robots[key]
        await web.accept()
        if robot in self._coming:
            await _close(web, REFUSED, f"Another program comes for robot {robot} at this moment. Try again.")
            return
        self._coming.add(robot)
        try:
            await asyncio.sleep(max(self._next_s[robot] - time.monotonic(), 0))
        finally:
            self._coming.discard(robot)
            self._next_s[robot] = time.monotonic() + BACK_S
        try:
            with opening("a program elsewhere"):
                here, there = socket.socketpair()
        except KiksError as error:
            await _close(web, REFUSED, str(error))
            return
        with here:
            here.setblocking(False)
            await self._play(web, robot, here, there)

    async def _play(self, web: WebSocket, robot: int, here: socket.socket, there: socket.socket) -> None:
        """Let a program drive a robot at the other end of a pair of sockets."""
        programs = self._desk.programs
        try:
            player, start = await asyncio.to_thread(programs.let_in, there, robot, f"the program of robot {robot}")
        except KiksError as error:
            there.close()
            await _close(web, REFUSED, str(error))
            return
        self._go_on(robot, web)
        welcome = Welcome(
            __version__, robot, *start[:3], tuple(start.offered), start.seed, start.pulse_mm, start.addresses
        )
        has_left = False
        try:
            with suppress(WebSocketDisconnect):
                await web.send_text(json.dumps(asdict(welcome)))
                has_left = await _relay(web, here)
        finally:
            await self._part(web, programs, player, has_left=has_left)

    def _go_on(self, robot: int, web: WebSocket) -> None:
        where = web.client.host if web.client is not None else "elsewhere"
        self._say(f"Robot {robot} has a program, at {where}.")
        if self._has_paused:
            self._has_paused = False
            self._desk.present.gate.go_on()

    async def _part(self, web: WebSocket, programs: Programs, player: SocketParticipant, *, has_left: bool) -> None:
        """Say how a program has ended; a lost one stops its robot."""
        if player.farewell:
            how = f"was disconnected: {player.farewell}"
        elif has_left:
            how = "has ended."
        else:
            await asyncio.to_thread(programs.lose, player)
            how = "was lost. Its robot stands; the program may come back."
        self._say(f"The program of robot {player.robot} {how}")
        await _close(web, ENDED, player.farewell)


async def _relay(web: WebSocket, connection: socket.socket) -> bool:
    """Carry bytes both ways until one end closes; return whether the program has left by itself."""
    loop = asyncio.get_running_loop()

    async def from_program() -> bool:
        while True:
            message = await web.receive()
            if message["type"] == "websocket.disconnect":
                return bool(message.get("code") == LEFT)
            await loop.sock_sendall(connection, message.get("bytes") or b"")

    async def to_program() -> bool:
        while data := await loop.sock_recv(connection, RECEIVE_SIZE):
            await web.send_bytes(data)
        return False

    tasks = [asyncio.create_task(from_program()), asyncio.create_task(to_program())]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        return any(not task.exception() and task.result() for task in done)
    finally:
        for task in tasks:
            task.cancel()
            with suppress(asyncio.CancelledError, OSError, WebSocketDisconnect):
                await task


async def _close(web: WebSocket, code: int, reason: str) -> None:
    """Close a WebSocket that may be closed already."""
    text = reason.encode()[:REASON_BYTES_MAX].decode(errors="ignore")
    try:
        with suppress(RuntimeError, WebSocketDisconnect):
            await asyncio.wait_for(web.close(code, text), CLOSE_S)
    except TimeoutError:
        web.scope["state"][ABORT]()
