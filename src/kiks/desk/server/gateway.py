"""The gateway: what there is to be seen goes to the browsers, what their hands do comes back.

Flow control: a browser has at most `IN_FLIGHT` frames that it has not acknowledged. The newest frame wins; none queues.
So a slow browser, or a page that sleeps, gets fewer frames, and costs neither memory nor anybody else's time.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from kiks.desk.server.desk import Desk
from kiks.desk.server.frames import arena_picture, describe_scene, describe_shapes, pack_frame
from kiks.errors import KiksError, ParameterError
from kiks.sim.simulation import Simulation

FRAME_S = 0.04
"""Time between two frames [s]."""

DRAG_FRAME_S = 0.015
"""The same while somebody moves something [s]."""

SHAPES_FRAMES = 10
"""After how many frames it is looked whether turrets have changed their looks."""

IN_FLIGHT = 3
"""Most frames on their way to one browser."""

NUMBER_MAX = 1e6
"""Largest number of a message, a place in millimetres or an angle in radians."""

TEXTS = 16
"""Most other messages that wait for one browser: who is that far behind is parted from, and comes back."""


class Viewer:
    """One browser.

    Attributes:
        name: Whose hand it is.
        in_flight: Frames that it has not acknowledged.
        scene: Number of the scene that it has been told of.
        shapes: What it has been told of turrets' looks.
        newest: The frame that it gets next.
        texts: Messages that it gets before that.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.in_flight = 0
        self.scene = -1
        self.shapes: dict[str, Any] = {}
        self.newest: bytes | None = None
        self.texts: list[str] = []
        self._news = asyncio.Event()

    @property
    def is_ready(self) -> bool:
        """Whether it can use another frame."""
        return self.in_flight < IN_FLIGHT

    def show(self, frame: bytes) -> None:
        """Let this be what it sees next."""
        self.newest = frame
        self._news.set()

    def tell(self, message: dict[str, Any]) -> None:
        """Send it a message."""
        self.texts.append(json.dumps(message))
        self._news.set()

    async def send_all(self, socket: WebSocket) -> None:
        """Send what there is, for ever."""
        while len(self.texts) <= TEXTS:
            await self._news.wait()
            self._news.clear()
            while self.texts:
                await socket.send_text(self.texts.pop(0))
            if self.newest is not None and self.is_ready:
                frame, self.newest = self.newest, None
                self.in_flight += 1
                await socket.send_bytes(frame)


class Gateway:
    """Serves the browsers of a desk.

    Args:
        desk: The desk.
        number: Its number in this process.
    """

    def __init__(self, desk: Desk, number: int) -> None:
        self._number = number
        self._is_closed = False
        self._desk = desk
        self._viewers: set[Viewer] = set()
        self._count = 0
        self._wake = asyncio.Event()
        self._has_moved = False
        self._seen: tuple[Any, ...] = ()
        self._scene: dict[str, Any] = {}
        self._picture: tuple[Any, bytes] = (None, b"")
        self._shapes: dict[str, Any] = {}
        self._frame_count = 0

    # ---- out ----

    async def run(self) -> None:
        """Take a picture of the world again and again and show it to all who can use one, until it is closed."""
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while not self._is_closed:
            due_s = max(due_s + FRAME_S, loop.time())
            alarm = loop.call_at(due_s, self._wake.set)
            await self._wake.wait()
            alarm.cancel()
            if self._has_moved:
                await asyncio.sleep(DRAG_FRAME_S)
            self._has_moved = False
            self._wake.clear()
            if any(viewer.is_ready for viewer in self._viewers):
                self._show(await self._desk.do(self._look))

    def _look(self, sim: Simulation) -> bytes:
        desk = self._desk
        sim.sync()
        seen = (sim, sim.arena, desk.scene, len(sim.lamps), *sim.world.state.bodies["number"][0].tolist())
        turrets = sum(len(wire.firmware.fitted) for wire in sim.wires)
        if (*seen, turrets) != self._seen:
            self._seen = (*seen, turrets)
            self._scene = describe_scene(sim, self._scene.get("scene", 0) + 1, desk.names())
            self._scene["arena"]["picture"] = f"/desk/{self._number}/arena/{self._scene['scene']}.png"
            if self._picture[0] is not sim.arena:
                self._picture = sim.arena, arena_picture(sim.arena)
            self._shapes = describe_shapes(sim)
        self._frame_count += 1
        if self._frame_count % SHAPES_FRAMES == 0 and (shapes := describe_shapes(sim)) != self._shapes:
            self._shapes = shapes
        desk.meter.note(sim.now_ns, is_paused=desk.gate.is_paused)
        return pack_frame(
            sim,
            scene=self._scene["scene"],
            is_paused=desk.gate.is_paused,
            is_driven=desk.programs.drive,
            speed_now=desk.meter.momentary,
            speed_average=desk.meter.average,
            is_held=desk.hands.holds,
        )

    def _show(self, frame: bytes) -> None:
        number = self._scene["scene"]
        for viewer in self._viewers:
            if viewer.scene != number:
                viewer.scene = number
                viewer.tell(self._scene)
            if viewer.shapes is not self._shapes:
                viewer.shapes = self._shapes
                viewer.tell(self._shapes)
            if viewer.is_ready:
                viewer.show(frame)

    def close(self) -> None:
        """Tell the browsers that there is nothing more to see."""
        self._is_closed = True
        for viewer in self._viewers:
            viewer.tell({"kind": "gone"})

    def picture(self) -> bytes:
        """Return the walls of the arena, a PNG."""
        return self._picture[1]

    # ---- in ----

    async def serve(self, socket: WebSocket) -> None:
        """Serve a browser until it goes."""
        await socket.accept()
        self._count += 1
        viewer = Viewer(f"browser {self._count}")
        self._viewers.add(viewer)
        sending = asyncio.create_task(viewer.send_all(socket))
        hearing = asyncio.create_task(self._hear(viewer, socket))
        try:
            await asyncio.wait([sending, hearing], return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._viewers.discard(viewer)
            for task in (sending, hearing):
                task.cancel()
            await asyncio.gather(sending, hearing, return_exceptions=True)
            await self._desk.drop(viewer.name)
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await socket.close()

    async def _hear(self, viewer: Viewer, socket: WebSocket) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                text = await socket.receive_text()
                try:
                    await self._obey(viewer, text)
                except KiksError as error:
                    viewer.tell({"kind": "error", "text": str(error)})

    async def _obey(self, viewer: Viewer, text: str) -> None:
        """Do what a message says.

        Raises:
            ParameterError: If it says nothing that can be done.
        """
        message = _parse(text)
        kind = message["kind"]
        if kind == "ack":
            count = message.get("count")
            shown_count = count if isinstance(count, int) and 1 <= count <= IN_FLIGHT else 1
            viewer.in_flight = max(viewer.in_flight - shown_count, 0)
            self._desk.is_seen.set()
            return
        desk, name = self._desk, viewer.name
        if kind == "grab":
            what, index = message.get("what"), message.get("index", -1)
            await desk.grab(
                name,
                what[:80] if isinstance(what, str) else "",
                index if isinstance(index, int) and index < NUMBER_MAX else -1,
            )
        elif kind == "move":
            x_mm, y_mm = _number(message, "x_mm"), _number(message, "y_mm")
            await desk.do(lambda sim: desk.hands.move(name, x_mm, y_mm))
        elif kind == "turn":
            heading_rad = _number(message, "heading_rad")
            await desk.do(lambda sim: desk.hands.turn(name, heading_rad))
        elif kind == "drop":
            await desk.drop(name)
        else:
            raise ParameterError(
                f"a message must be one of ack, grab, move, turn and drop, but it was {kind[:80]!r}. Load the page "
                "anew."
            )
        self._has_moved = True
        self._wake.set()


def _parse(text: str) -> dict[str, Any]:
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        message = None
    if not isinstance(message, dict) or not isinstance(message.get("kind"), str):
        raise ParameterError(
            f"a message must be a JSON object with a kind, but it was {text[:80]!r}. Load the page anew."
        )
    return message


def _number(message: dict[str, Any], name: str) -> float:
    value = message.get(name)
    if not isinstance(value, int | float) or not abs(value) <= NUMBER_MAX:
        raise ParameterError(
            f"{name} must be a number of at most {NUMBER_MAX:g}, but it was {repr(value)[:80]}. Load the page anew."
        )
    return float(value)
