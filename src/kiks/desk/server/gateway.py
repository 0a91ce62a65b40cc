"""The gateway: sends frames to the browsers of a desk and receives drags from them.

Flow control: a browser has at most `IN_FLIGHT` unacknowledged frames. Frames do not queue; the newest one replaces the
one that waits. So a slow browser or a sleeping page gets fewer frames, and costs no memory and no time of the others.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Callable
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from kiks.desk.server.access import KEY
from kiks.desk.server.desk import Desk
from kiks.desk.server.live_editing import Editing
from kiks.desk.server.marks import Mark, thinned
from kiks.errors import KiksError, ParameterError
from kiks.export.frames import arena_picture, describe_scene, describe_shapes, pack_frame, scene_key
from kiks.export.looks import robot_colours
from kiks.model.arena import Arena
from kiks.model.checks import SECONDS_MAX
from kiks.sim.judge import POINTS, RESULT
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s, s_from_ns

FRAME_S = 0.04
"""Frame period [s]."""

DRAG_FRAME_S = 0.015
"""Frame period during a drag [s]."""

SHAPES_FRAMES = 10
"""Number of frames between two checks of the turrets' shapes."""

POLL_S = 1.0
"""Period at which the past is read [s]."""

IN_FLIGHT = 3
"""Maximum number of unacknowledged frames of one browser."""

NUMBER_MAX = 1e6
"""Largest number in a message: a coordinate [mm] or an angle [rad]."""

TEXTS = 16
"""Maximum number of text messages that wait for one browser; beyond it the gateway closes the connection."""


class Viewer:
    """The connection to one browser.

    Attributes:
        name: Owner of the browser's hand.
        in_flight: Number of unacknowledged frames.
        sent: The last scene, shapes, time bar and board that were sent, by their kinds.
        newest: The next frame to send.
        pulls: The newest message of each kind that moves what the browser holds, to be done before the next frame.
        texts: Messages to send before that frame.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.in_flight = 0
        self.sent: dict[str, dict[str, Any]] = {}
        self.newest: bytes | None = None
        self.pulls: dict[str, Callable[[Simulation], None]] = {}
        self.texts: list[str] = []
        self._wake = asyncio.Event()

    @property
    def is_ready(self) -> bool:
        """Whether the browser may get another frame."""
        return self.in_flight < IN_FLIGHT

    def show(self, frame: bytes) -> None:
        """Make this the next frame."""
        self.newest = frame
        self._wake.set()

    def tell(self, message: dict[str, Any]) -> None:
        """Queue a text message."""
        self.texts.append(json.dumps(message))
        self._wake.set()

    async def send_all(self, socket: WebSocket) -> None:
        """Send messages and frames until too many messages wait."""
        while len(self.texts) <= TEXTS:
            await self._wake.wait()
            self._wake.clear()
            while self.texts:
                await socket.send_text(self.texts.pop(0))
            if self.newest is not None and self.is_ready:
                frame, self.newest = self.newest, None
                self.in_flight += 1
                await socket.send_bytes(frame)


class Gateway:
    """Serves the browsers of a desk.

    Attributes:
        desk: The desk.
        number: Its number in this process.
        editing: Edits its world, for all browsers.
    """

    def __init__(self, desk: Desk, number: int) -> None:
        self.desk = desk
        self.number = number
        self.editing = Editing(desk)
        self._is_closed = False
        self._viewers: set[Viewer] = set()
        self._count = 0
        self._wake = asyncio.Event()
        self._has_moved = False
        self._student_count = 0
        self._left_s: float | None = None
        self._seen: tuple[Any, ...] = ()
        self._seeking: set[asyncio.Task[None]] = set()
        # The scene, its shapes, the time bar and the board, by their kinds.
        self._news: dict[str, dict[str, Any]] = {}
        self._scene_number = 0
        self._arena: Arena | None = None
        self._picture: tuple[Arena | None, bytes] = (None, b"")
        self._bar_source: tuple[list[Mark], dict[str, Any]] | None = None
        self._frame_count = 0

    @property
    def away_s(self) -> float | None:
        """For how long its student has had no page open [s]: 0 while there is one, None before the first."""
        if self._student_count:
            return 0.0
        return None if self._left_s is None else time.monotonic() - self._left_s

    # ---- sending ----

    async def run(self) -> None:
        """Send frames to all browsers that are ready, until the gateway is closed."""
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        polling = asyncio.create_task(self._poll())
        while not self._is_closed:
            due_s = max(due_s + FRAME_S, loop.time())
            alarm = loop.call_at(due_s, self._wake.set)
            await self._wake.wait()
            alarm.cancel()
            if self._has_moved:
                await asyncio.sleep(DRAG_FRAME_S)
            self._has_moved = False
            self._wake.clear()
            # A task for each browser would wake this thread up more often, and stop the world's for that.
            for viewer in tuple(self._viewers):
                await self._pull(viewer)
            if any(viewer.is_ready for viewer in self._viewers):
                self._show(await self.desk.do(self._look))
        polling.cancel()

    async def _poll(self) -> None:
        """Read what has happened, and let the hall show its next game, about once a second."""
        while True:
            await self.desk.looking.poll()
            if self.desk.hall is not None:
                await self.desk.hall.poll(self.desk)
            await asyncio.sleep(POLL_S)

    def _look(self, sim: Simulation) -> bytes:
        desk = self.desk
        sim.sync()
        if (seen := (desk.scene, *scene_key(sim))) != self._seen:
            self._seen = seen
            self._scene_number += 1
            scene = describe_scene(sim, self._scene_number, desk.names())
            scene["arena"]["picture"] = f"{self.number}/arena/{self._scene_number}.png"
            looks = {
                "secret": desk.secret,
                "is_room": desk.rights.is_for_others,
                "has_old_coordinates": desk.has_old_coordinates,
            }
            self._news |= {"scene": {**scene, **looks}, "shapes": describe_shapes(sim)}
            self._arena = sim.arena
        self._frame_count += 1
        if self._frame_count % SHAPES_FRAMES == 0 and (shapes := describe_shapes(sim)) != self._news["shapes"]:
            self._news["shapes"] = shapes
        desk.shown.meter.note(sim.now_ns, is_paused=desk.is_paused)
        self._describe_bar()
        self._describe_board(sim)
        return pack_frame(
            sim,
            scene=self._scene_number,
            is_paused=desk.is_paused,
            is_driven=desk.programs.drive and desk.past is None,
            speed_now=desk.shown.meter.momentary,
            speed_average=desk.shown.meter.average,
            is_held=desk.shown.hands.holds,
        )

    def _describe_bar(self) -> None:
        """Describe the time bar, if it has changed: browsers know from frames where it stands."""
        looking = self.desk.looking
        past, span = looking.past, looking.span
        state: dict[str, Any] = {
            "kind": "bar",
            "begin_s": None if span is None else s_from_ns(span.begin_ns),
            "end_s": None if span is None or past is None else s_from_ns(span.end_ns),
            "is_past": past is not None,
            "has_present": looking.has_present,
        }
        if (source := (looking.marks, state)) != self._bar_source:
            self._bar_source = source
            self._news["bar"] = {**state, "marks": [(*mark[:2], mark.text) for mark in thinned(looking.marks, span)]}

    def _describe_board(self, sim: Simulation) -> None:
        """Describe the score, by robots first; it is that of the time which is shown."""
        score = {what: round(value, 3) if isinstance(value, float) else value for what, value in sim.score.items()}
        sides = dict(enumerate(self.desk.sides(), 1)) if score else {}
        entries: list[dict[str, Any]] = [
            {"name": sides.get(robot, f"robot {robot}"), "value": score[robot], "colours": robot_colours(robot - 1)}
            for robot in sorted(what for what in score if isinstance(what, int))
        ]
        entries += [{"name": what, "value": score[what], "colours": None} for what in score if isinstance(what, str)]
        project = self.desk.project
        goal = None
        if project.goal is not None:
            # What the judge has written stands beside the goal.
            judged = {each["name"]: each["value"] for each in entries if each["name"] in (POINTS, RESULT)}
            entries = [each for each in entries if each["name"] not in judged]
            goal = {"text": project.goal.text or "Goal", "points": judged.get(POINTS), "result": judged.get(RESULT)}
        hall = None if self.desk.hall is None else self.desk.hall.describe()
        self._news["board"] = {"kind": "board", "score": entries, "goal": goal, "end_s": project.seconds, "hall": hall}

    def _show(self, frame: bytes) -> None:
        for viewer in self._viewers:
            for kind, message in self._news.items():
                if viewer.sent.get(kind) != message:
                    viewer.sent[kind] = message
                    viewer.tell(message)
            if viewer.is_ready:
                viewer.show(frame)

    def close(self) -> None:
        """Tell the browsers that the desk is closed."""
        self._is_closed = True
        for viewer in self._viewers:
            viewer.tell({"kind": "gone"})

    def picture(self) -> bytes:
        """Return the walls of the arena as a PNG; made when a browser asks for it, so that no world waits for it."""
        arena = self._arena
        if arena is not None and self._picture[0] is not arena:
            self._picture = arena, arena_picture(arena)
        return self._picture[1]

    # ---- receiving ----

    async def serve(self, socket: WebSocket) -> None:
        """Serve a browser until it closes the connection."""
        await socket.accept()
        self._count += 1
        viewer = Viewer(f"browser {self._count}")
        self._viewers.add(viewer)
        is_students = socket.scope[KEY].desk is not None
        self._student_count += is_students
        sending = asyncio.create_task(viewer.send_all(socket))
        receiving = asyncio.create_task(self._receive(viewer, socket))
        try:
            await asyncio.wait([sending, receiving], return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._viewers.discard(viewer)
            self._student_count -= is_students
            self._left_s = time.monotonic() if is_students else self._left_s
            for task in (sending, receiving):
                task.cancel()
            await asyncio.gather(sending, receiving, return_exceptions=True)
            await self.desk.drop(viewer.name)
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await socket.close()

    async def _receive(self, viewer: Viewer, socket: WebSocket) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                text = await socket.receive_text()
                try:
                    await self._execute(viewer, text)
                except KiksError as error:
                    viewer.tell({"kind": "error", "text": str(error)})

    async def _execute(self, viewer: Viewer, text: str) -> None:
        """Execute a message."""
        message = _parse(text)
        kind = message["kind"]
        if kind == "ack":
            count = message.get("count")
            shown_count = count if isinstance(count, int) and 1 <= count <= IN_FLIGHT else 1
            viewer.in_flight = max(viewer.in_flight - shown_count, 0)
            self.desk.is_seen.set()
            return
        desk, name = self.desk, viewer.name
        if kind == "seek":
            self._seek(viewer, ns_from_s(_number(message, "time_s", SECONDS_MAX)))
            return
        if kind == "grab":
            await self._pull(viewer)
            await desk.grab(name, message.get("what", ""), message.get("index", -1))
        elif kind == "move":
            x_mm, y_mm = _number(message, "x_mm"), _number(message, "y_mm")
            viewer.pulls[kind] = lambda _: desk.shown.hands.move(name, x_mm, y_mm)
        elif kind == "turn":
            heading_rad = _number(message, "heading_rad")
            viewer.pulls[kind] = lambda _: desk.shown.hands.turn(name, heading_rad)
        elif kind == "drop":
            await self._pull(viewer)
            await desk.drop(name)
        else:
            raise ParameterError(
                f"a message must be one of ack, grab, move, turn, drop and seek, but it was {kind[:80]!r}. Reload the "
                "page."
            )
        self._has_moved = True
        self._wake.set()

    async def _pull(self, viewer: Viewer) -> None:
        """Move what a browser holds to where its newest messages say."""
        pulls, viewer.pulls = viewer.pulls, {}
        for pull in pulls.values():
            try:
                await self.desk.do(pull)
            except KiksError as error:
                viewer.tell({"kind": "error", "text": str(error)})

    def _seek(self, viewer: Viewer, time_ns: int) -> None:
        """Show the past at a time [ns], while the browser's next messages are received: the last time counts."""

        async def seek() -> None:
            try:
                await self.desk.looking.look_at(time_ns)
            except KiksError as error:
                viewer.tell({"kind": "error", "text": str(error)})
            self._wake.set()

        task = asyncio.create_task(seek())
        self._seeking.add(task)
        task.add_done_callback(self._seeking.discard)


def _parse(text: str) -> dict[str, Any]:
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        message = None
    if not isinstance(message, dict) or not isinstance(message.get("kind"), str):
        raise ParameterError(f"a message must be a JSON object with a kind, but it was {text[:80]!r}. Reload the page.")
    return message


def _number(message: dict[str, Any], name: str, most: float = NUMBER_MAX) -> float:
    value = message.get(name)
    if not isinstance(value, int | float) or not abs(value) <= most:
        raise ParameterError(
            f"{name} must be a number of at most {most:g}, but it was {repr(value)[:80]}. Reload the page."
        )
    return float(value)
