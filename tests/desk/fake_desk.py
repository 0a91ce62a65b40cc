"""A desk without a simulation: a page with the arena view, and a feed that obeys hands.

It runs as a program, because NiceGUI keeps one application a process; it prints its address when it listens.

`/received` tells what browsers sent, `/ask/WHAT` makes it do something: see `ask`.
"""

from __future__ import annotations

import asyncio
import io
import json
import math
import struct
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import uvicorn
from fastapi import FastAPI, Response, WebSocket, WebSocketDisconnect
from nicegui import ui
from PIL import Image

from kiks.desk.panels.arena_view import ArenaView, Pick, Stroke, Tool
from kiks.export.looks import robot_hue, robot_shapes
from kiks.model.robot import RobotSpec

WIDTH_MM, HEIGHT_MM = 900, 600
REACH_MM = 60.0
SENSOR_DEG = (66.4, 39.3, 14.1, -18.1, -41.2, -63.2, -161.7, 166.9)
LED_0, TOUCHING = 2, 1


def sensor(degrees: float) -> dict[str, Any]:
    angle = math.radians(degrees)
    rays = [angle + math.radians(20 * k - 60) for k in range(7)]
    return {"x_mm": 26.5 * math.cos(angle), "y_mm": 26.5 * math.sin(angle), "angle_rad": angle, "rays_rad": rays}


def arena() -> np.ndarray:
    """Return a raster with white and black walls, and greys between."""
    cells = np.zeros((HEIGHT_MM, WIDTH_MM), np.uint8)
    cells[:12], cells[-12:], cells[:, :12], cells[:, -12:] = 255, 255, 255, 255
    for k, brightness in enumerate((1, 60, 120, 180, 255)):
        cells[380:430, 90 + 90 * k : 140 + 90 * k] = brightness
    row, column = np.mgrid[:HEIGHT_MM, :WIDTH_MM]
    cells[(row - 180) ** 2 + (column - 620) ** 2 < 60**2] = 90
    cells[150:165, 200:420] = 220
    return cells


class World:
    """What moves: it goes where hands put it, and robots drive when they are told to."""

    def __init__(self, robot_count: int) -> None:
        self.scene, self.time_s, self.cells = 1, 0.0, arena()
        self.secret, self.is_closed = 0, False
        self.held: dict[int, tuple[str, int]] = {}
        self.reset(robot_count)

    def reset(self, robot_count: int) -> None:
        """Put everything where it begins, and let it stand."""
        self.is_driving = self.is_closed = False
        columns = max(2, math.ceil(math.sqrt(1.5 * robot_count)))
        places = [(150 + 600 * (k % columns) / (columns - 1), 90 + 95 * (k // columns)) for k in range(robot_count)]
        self.robots = [[x, y, 0.7 * k] for k, (x, y) in enumerate(places)]
        self.bodies, self.lamps = [[420.0, 320.0], [500.0, 320.0]], [[700.0, 500.0, 1.0, 1.0], [80.0, 300.0, 1.0, 0.0]]

    def obey(self, hand: int, message: dict[str, Any]) -> None:
        kind = message["kind"]
        if kind == "grab":
            self.held[hand] = message["what"], message["index"]
        elif kind == "drop":
            self.held.pop(hand, None)
        elif hand in self.held:
            what, index = self.held[hand]
            thing = {"robot": self.robots, "body": self.bodies, "lamp": self.lamps}[what][index]
            if kind == "move":
                thing[:2] = message["x_mm"], message["y_mm"]
            else:
                thing[2] = message["heading_rad"]

    def drive(self, time_s: float) -> None:
        self.time_s += time_s
        held = {index for what, index in self.held.values() if what == "robot"}
        for k, robot in enumerate(self.robots):
            if self.is_driving and k not in held:
                robot[2] += (0.3 + 0.05 * k) * time_s
                robot[0] += 40 * time_s * math.cos(robot[2])
                robot[1] += 40 * time_s * math.sin(robot[2])

    def scene_message(self) -> str:
        robots = []
        body = RobotSpec.load("khepera").body
        for k in range(len(self.robots)):
            is_special = k < 2
            shapes = [{"points": [[-10, -12], [14, -12], [14, 12], [-10, 12]], "colour": "#303030", "radius_mm": 0}]
            shapes.append({"points": [[16, 0]], "colour": "#5080c0", "radius_mm": 5})
            striped = replace(body, stripe_count=2) if k == 1 else body
            parts = [asdict(part) for part in robot_shapes(striped)]
            robots.append(
                {
                    "name": str(k + 1), "kind": "Khepera", "radius_mm": 27.5, "wheel_base_mm": 53, "reach_mm": REACH_MM,
                    "hue": robot_hue(k), "parts": parts,
                    "white_stripes_rad": [[0.8, 2.4], [3.9, 5.5]] if k == 1 else [],
                    "sensors": [sensor(degrees) for degrees in SENSOR_DEG], "has_gripper": k == 1,
                    "turrets": ["K213 vision"] if is_special else [], "shapes": shapes if k == 0 else [],
                }
            )  # fmt: skip
        bodies = [
            {"number": 1, "what": "ball", "radius_mm": 20, "colour": [245, 130, 40]},
            {"number": 2, "what": "cylinder", "radius_mm": 14, "colour": [176, 122, 70]},
        ]
        sizes = {
            "width_mm": WIDTH_MM,
            "height_mm": HEIGHT_MM,
            "mm_per_cell": 1,
            "picture": f"/desk/arena/{self.scene}.png",
        }
        return json.dumps(
            {
                "kind": "scene",
                "scene": self.scene,
                "secret": self.secret,
                "arena": {"name": "Test", **sizes},
                "robots": robots,
                "bodies": bodies,
            }
        )

    def frame(self) -> bytes:
        count = len(self.robots)
        counts = count, len(self.bodies), len(self.lamps), 1
        parts = [struct.pack("<BBHIdff4H", 1, 1, 0, self.scene, self.time_s, 1.0, 1.0, *counts)]
        lengths = np.array([self.rays(*robot) for robot in self.robots])
        for k, robot in enumerate(self.robots):
            near = lengths[k].reshape(8, 7)[:, 3]
            readings = [max(0.0, 1023 * (1 - length / REACH_MM)) for length in near]
            flags = (LED_0 if k % 3 == 0 else 0) | (TOUCHING if near.min() < 4 else 0)
            words = struct.pack("<7fI2fI2i3f", *robot, 10, 10, 10, 10, flags, 230, 120, 0, 5, 6, 1, 2, 3)
            parts.append(words + struct.pack("<16f", *readings, *[450.0] * 8))
        parts += [struct.pack("<3f", *body, 0) for body in self.bodies]
        parts += [struct.pack("<4f", *lamp) for lamp in self.lamps]
        parts.append(
            struct.pack("<HH", 0, 100) + bytes(int(128 + 100 * math.sin(k / 6 + self.time_s)) for k in range(64))
        )
        parts.append(np.where(lengths < REACH_MM, lengths * 100, 65535).astype("<u2").tobytes())
        return b"".join(parts)

    def rays(self, x_mm: float, y_mm: float, heading_rad: float) -> np.ndarray:
        """Return the lengths of a robot's rays by walking along them, millimetre by millimetre."""
        spots = np.array([(s["x_mm"], s["y_mm"], a) for s in map(sensor, SENSOR_DEG) for a in s["rays_rad"]])
        x = x_mm + spots[:, 0] * math.cos(heading_rad) - spots[:, 1] * math.sin(heading_rad)
        y = y_mm + spots[:, 0] * math.sin(heading_rad) + spots[:, 1] * math.cos(heading_rad)
        way = np.arange(0.0, REACH_MM + 1)
        columns = (x[:, None] + way * np.cos(spots[:, 2:] + heading_rad)).astype(int).clip(0, WIDTH_MM - 1)
        rows = (HEIGHT_MM - 1 - (y[:, None] + way * np.sin(spots[:, 2:] + heading_rad)).astype(int)).clip(
            0, HEIGHT_MM - 1
        )
        is_wall = self.cells[rows, columns] > 0
        return np.where(is_wall.any(axis=1), is_wall.argmax(axis=1), REACH_MM).astype(float)


def make_app(robot_count: int) -> FastAPI:
    app, world = FastAPI(), World(robot_count)
    received: list[dict[str, Any]] = []
    sockets: dict[WebSocket, int] = {}
    views: list[ArenaView] = []

    @app.get("/received")
    def tell_received() -> list[dict[str, Any]]:
        return received

    @app.get("/ask/{what}")
    async def ask(what: str) -> str:
        if what == "drive":
            world.is_driving = True
        elif what == "reset":
            world.reset(len(world.robots))
        elif what in ("cut", "close", "replace"):
            world.is_closed = what == "close"
            world.secret += what == "replace"
            for socket in list(sockets):
                await socket.close()
        elif what == "scene":
            world.scene += 1
            world.robots.append([450.0, 450.0, 0.0])
            for socket in list(sockets):
                await socket.send_text(world.scene_message())
        elif what == "fit":
            views[-1].fit()
        elif what == "select":
            views[-1].select("body", 1)
        return what

    @app.get("/desk/arena/{name}")
    def picture(name: str) -> Response:
        out = io.BytesIO()
        Image.fromarray(world.cells).save(out, "PNG")
        return Response(out.getvalue(), media_type="image/png")

    @app.websocket("/desk/feed")
    async def feed(socket: WebSocket) -> None:
        await socket.accept()
        if world.is_closed:
            return await socket.close()
        await socket.send_text(world.scene_message())
        sockets[socket] = 0
        sender = asyncio.create_task(send_frames(socket))
        try:
            while True:
                message = json.loads(await socket.receive_text())
                if message["kind"] == "ack":
                    sockets[socket] -= message["count"]
                    continue
                received.append(message)
                world.obey(id(socket), message)
                await socket.send_bytes(world.frame())
                sockets[socket] += 1
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            sender.cancel()
            sockets.pop(socket, None)
            world.held.pop(id(socket), None)

    async def send_frames(socket: WebSocket) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        while socket in sockets:
            world.drive(0.04 / max(1, len(sockets)))
            if sockets[socket] < 3:
                sockets[socket] += 1
                await socket.send_bytes(world.frame())
            due += 0.04
            await asyncio.sleep(max(0.0, due - loop.time()))

    @ui.page("/")
    def page(view: str = "top", tool: str = "hand", dark: bool = False, follow: int = -1) -> None:
        ui.dark_mode(dark)
        ui.query(".nicegui-content").classes("p-0")

        def pick(what: Pick) -> None:
            received.append({"kind": "pick", **vars(what)})

        def draw(stroke: Stroke) -> None:
            received.append({"kind": "draw", "what": stroke.kind, "points": stroke.points})

        with ui.element("div").style("width: 100vw; height: 100vh"):
            arena_view = ArenaView(view=view, on_pick=pick, on_draw=draw)  # type: ignore[arg-type]
        arena_view.set_show({"trails": True})
        arena_view.set_follow(follow)
        arena_view.set_tool(Tool(tool, brush_mm=10, snap_mm=10, label="wall"))  # type: ignore[arg-type]
        views.append(arena_view)

    ui.run_with(app)
    return app


class Announced(uvicorn.Server):
    """A server that prints its address when it listens."""

    async def startup(self, sockets: Any = None) -> None:
        await super().startup(sockets)
        host, port = self.servers[0].sockets[0].getsockname()
        print(f"http://{host}:{port}", flush=True)


if __name__ == "__main__":
    Announced(uvicorn.Config(make_app(robot_count=3), "127.0.0.1", 0, log_level="warning")).run()
