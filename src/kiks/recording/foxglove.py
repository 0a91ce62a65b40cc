"""What Foxglove shows of a recording: its own messages for walls, robots, poses and text (https://docs.foxglove.dev).

KiKS does not read them: they are made of the same looks that it writes for itself.
"""

from __future__ import annotations

import base64
import json
import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from kiks.engine.state import BODY
from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec
from kiks.recording.mcap_file import Topic
from kiks.recording.motion import KEPT_BYTES, Looks
from kiks.units import NS_PER_S, TICK_NS

PERIOD_TICKS = 50
"""Ticks between two sets of poses: two a second. Foxglove draws robots between them, too."""

MESSAGE_TICKS = 200
"""Ticks of whose poses one message tells: a message costs more than what is in it."""

CELLS_MAX = 200
"""Most cells of the walls' picture in each direction."""

HEIGHT_M = 0.03
"""Height of a robot in the picture [m]."""


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _list(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


_NUMBER, _WHOLE, _TEXT, _YES_NO = ({"type": kind} for kind in ("number", "integer", "string", "boolean"))
_TIME = _object(sec=_WHOLE, nsec=_WHOLE)
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_VECTOR, orientation=_TURN)
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_BYTES = {"type": "string", "contentEncoding": "base64"}


def _topic(name: str, schema: str, /, **properties: Any) -> Topic:
    return Topic(
        name, "json", f"foxglove.{schema}", json.dumps({"title": f"foxglove.{schema}", **_object(**properties)})
    )


WALLS = _topic(
    "/walls",
    "Grid",
    timestamp=_TIME,
    frame_id=_TEXT,
    pose=_POSE,
    column_count=_WHOLE,
    cell_size=_object(x=_NUMBER, y=_NUMBER),
    row_stride=_WHOLE,
    cell_stride=_WHOLE,
    fields=_list(_object(name=_TEXT, offset=_WHOLE, type=_WHOLE)),
    data=_BYTES,
)
SCENE = _topic(
    "/scene",
    "SceneUpdate",
    deletions=_list(_object(timestamp=_TIME, type=_WHOLE, id=_TEXT)),
    entities=_list(
        _object(
            timestamp=_TIME,
            frame_id=_TEXT,
            id=_TEXT,
            lifetime=_TIME,
            frame_locked=_YES_NO,
            cylinders=_list(_object(pose=_POSE, size=_VECTOR, bottom_scale=_NUMBER, top_scale=_NUMBER, color=_COLOUR)),
            arrows=_list(
                _object(
                    pose=_POSE,
                    shaft_length=_NUMBER,
                    shaft_diameter=_NUMBER,
                    head_length=_NUMBER,
                    head_diameter=_NUMBER,
                    color=_COLOUR,
                )
            ),
        )
    ),
)
POSES = _topic(
    "/tf",
    "FrameTransforms",
    transforms=_list(
        _object(timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_TURN)
    ),
)
TEXT = _topic("/log", "Log", timestamp=_TIME, level=_WHOLE, message=_TEXT, name=_TEXT, file=_TEXT, line=_WHOLE)

TOPICS = (WALLS, SCENE, POSES, TEXT)

_POSE_BYTES = struct.Struct("<ddd")  # with which a robot's record begins

_LEVEL_INFO, _TYPE_UINT8 = 2, 1
_STILL = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def _time(time_ns: int) -> dict[str, int]:
    return {"sec": time_ns // NS_PER_S, "nsec": time_ns % NS_PER_S}


def walls(arena: Arena, time_ns: int) -> bytes:
    """Return the walls as a grid of brightness: 0 for the floor."""
    step = max(-(-max(arena.brightness.shape) // CELLS_MAX), 1)
    rows, columns = (-(-length // step) for length in arena.brightness.shape)
    padded = np.zeros((rows * step, columns * step), np.uint8)
    padded[: arena.brightness.shape[0], : arena.brightness.shape[1]] = arena.brightness
    cells = padded.reshape(rows, step, columns, step).max(axis=(1, 3))
    cell_m = arena.mm_per_cell * step / 1000
    return json.dumps(
        {
            "timestamp": _time(time_ns),
            "frame_id": "arena",
            "pose": _STILL,
            "column_count": columns,
            "cell_size": {"x": cell_m, "y": cell_m},
            "row_stride": columns,
            "cell_stride": 1,
            "fields": [{"name": "brightness", "offset": 0, "type": _TYPE_UINT8}],
            "data": base64.b64encode(np.ascontiguousarray(cells).tobytes()).decode(),
        }
    ).encode()


def scene(specs: Sequence[RobotSpec], bodies: np.ndarray[Any, np.dtype[np.void]], time_ns: int) -> bytes:
    """Return robots, balls and cylinders, each in a frame of its own that `poses` moves."""
    entities = []
    for number, spec in enumerate(specs, 1):
        radius_m = spec.body.radius_mm / 1000
        arrow = {
            "pose": {**_STILL, "position": {"x": 0.0, "y": 0.0, "z": HEIGHT_M}},
            "shaft_length": radius_m * 0.6,
            "shaft_diameter": 0.004,
            "head_length": radius_m * 0.4,
            "head_diameter": 0.012,
            "color": {"r": 1.0, "g": 0.6, "b": 0.1, "a": 1.0},
        }
        entities.append(_disc(f"robot {number}", radius_m, 0.25, time_ns) | {"arrows": [arrow]})
    for body in bodies:
        entities.append(_disc(f"body {body['number']}", float(body["radius_mm"]) / 1000, 0.9, time_ns))
    return json.dumps(
        {"deletions": [{"timestamp": _time(time_ns), "type": 1, "id": ""}], "entities": entities}
    ).encode()


def _disc(name: str, radius_m: float, grey: float, time_ns: int) -> dict[str, Any]:
    disc = {
        "pose": {**_STILL, "position": {"x": 0.0, "y": 0.0, "z": HEIGHT_M / 2}},
        "size": {"x": 2 * radius_m, "y": 2 * radius_m, "z": HEIGHT_M},
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": {"r": grey, "g": grey, "b": grey, "a": 1.0},
    }
    return {
        "timestamp": _time(time_ns),
        "frame_id": name,
        "id": name,
        "lifetime": _time(0),
        "frame_locked": True,
        "cylinders": [disc],
    }


def poses(looks: Sequence[Looks]) -> list[tuple[Topic, int, bytes]]:
    """Return messages with poses."""
    messages: dict[int, list[str]] = {}
    due_tick = 0
    for each, (look, tick_count) in ((some, look) for some in looks for look in enumerate(some.ticks)):
        if tick_count < due_tick:
            continue
        due_tick = tick_count + PERIOD_TICKS
        transforms = messages.setdefault(tick_count - tick_count % MESSAGE_TICKS, [])
        time_ns = tick_count * TICK_NS
        stamp = f'{{"timestamp":{{"sec":{time_ns // NS_PER_S},"nsec":{time_ns % NS_PER_S}}},"parent_frame_id":"arena",'
        for number in range(1, each.robot_count + 1):
            place = (look * each.robot_count + number - 1) * KEPT_BYTES
            x_mm, y_mm, heading_rad = _POSE_BYTES.unpack_from(each.robots, place)
            half_rad = heading_rad / 2
            transforms.append(
                f'{stamp}"child_frame_id":"robot {number}",'
                f'"translation":{{"x":{x_mm / 1000:.5f},"y":{y_mm / 1000:.5f},"z":0}},'
                f'"rotation":{{"x":0,"y":0,"z":{math.sin(half_rad):.5f},"w":{math.cos(half_rad):.5f}}}}}'
            )
        if each.body_count:
            place = look * each.body_count * BODY.itemsize
            bodies: Any = np.frombuffer(each.bodies, BODY, each.body_count, place)
            rows = zip(bodies["number"].tolist(), bodies["x_mm"].tolist(), bodies["y_mm"].tolist(), strict=True)
            transforms += [
                f'{stamp}"child_frame_id":"body {number}",'
                f'"translation":{{"x":{x_mm / 1000:.5f},"y":{y_mm / 1000:.5f},"z":0}},'
                '"rotation":{"x":0,"y":0,"z":0,"w":1}}'
                for number, x_mm, y_mm in rows
            ]
    return [
        (POSES, ticks * TICK_NS, f'{{"transforms":[{",".join(transforms)}]}}'.encode())
        for ticks, transforms in messages.items()
    ]


def text(name: str, message: str, time_ns: int) -> bytes:
    """Return a line of a program's output, or a person's note."""
    values = {
        "timestamp": _time(time_ns),
        "level": _LEVEL_INFO,
        "message": message,
        "name": name,
        "file": "",
        "line": 0,
    }
    return json.dumps(values).encode()
