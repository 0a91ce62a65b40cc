"""Writes a recording for Foxglove: walls, robots, poses and texts as its own messages (https://docs.foxglove.dev)."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable, Iterator
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np

from kiks.export.looks import Colour, body_colour, robot_colour
from kiks.model.arena import Arena
from kiks.recording.events import EventReader
from kiks.recording.mcap_file import McapFile, Topic
from kiks.recording.moments import Moment, moments
from kiks.recording.recording import Recording
from kiks.units import NS_PER_S, ns_from_s

PERIOD_NS = NS_PER_S // 10
"""Simulated time between two poses [ns]. Foxglove draws robots between them, too."""

CHUNK_MESSAGES = 1000
"""Messages that are written as one chunk."""

CELLS_MAX = 200
"""Most cells of the walls' picture in each direction."""

HEIGHT_M = 0.03
"""Height of a robot in the picture [m]."""

Message = tuple[Topic, int, bytes]
"""Topic, time [ns] and data."""


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
_FIELD = _object(name=_TEXT, offset=_WHOLE, type=_WHOLE)
_DISC = _object(pose=_POSE, size=_VECTOR, bottom_scale=_NUMBER, top_scale=_NUMBER, color=_COLOUR)
_ARROW = _object(
    pose=_POSE, shaft_length=_NUMBER, shaft_diameter=_NUMBER, head_length=_NUMBER, head_diameter=_NUMBER, color=_COLOUR
)
_ENTITY = _object(
    timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_TIME, frame_locked=_YES_NO, cylinders=_list(_DISC),
    arrows=_list(_ARROW),
)  # fmt: skip
_TRANSFORM = _object(timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_TURN)


def _topic(name: str, schema: str, /, **properties: Any) -> Topic:
    title = f"foxglove.{schema}"
    return Topic(name, "json", title, json.dumps({"title": title, **_object(**properties)}))


WALLS = _topic(
    "/walls", "Grid", timestamp=_TIME, frame_id=_TEXT, pose=_POSE, column_count=_WHOLE,
    cell_size=_object(x=_NUMBER, y=_NUMBER), row_stride=_WHOLE, cell_stride=_WHOLE, fields=_list(_FIELD), data=_BYTES,
)  # fmt: skip
SCENE = _topic(
    "/scene",
    "SceneUpdate",
    deletions=_list(_object(timestamp=_TIME, type=_WHOLE, id=_TEXT)),
    entities=_list(_ENTITY),
)
POSES = _topic("/tf", "FrameTransforms", transforms=_list(_TRANSFORM))
TEXT = _topic("/log", "Log", timestamp=_TIME, level=_WHOLE, message=_TEXT, name=_TEXT, file=_TEXT, line=_WHOLE)

TOPICS = (WALLS, SCENE, POSES, TEXT)

_LEVEL_INFO, _TYPE_UINT8, _ALL = 2, 1, 1
_STILL = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def save_foxglove(
    recording: Recording, path: str | Path, *, on_progress: Callable[[float], None] = lambda share: None
) -> None:
    """Write a recording as an MCAP file that Foxglove shows.

    Args:
        recording: The recording.
        path: The file, which ends in .mcap.
        on_progress: Called now and then with the share that is done.
    """
    begin_ns, end_ns = recording.log.begin_ns, recording.log.end_ns
    file, chunk = McapFile(path, TOPICS), []
    try:
        for message in merge(_of_moments(recording), _of_events(recording), key=lambda message: message[1]):
            chunk.append(message)
            if len(chunk) == CHUNK_MESSAGES:
                file.write(chunk)
                on_progress((message[1] - begin_ns) / max(end_ns - begin_ns, 1))
                chunk = []
        file.write(chunk)
    finally:
        file.close()


def _of_moments(recording: Recording) -> Iterator[Message]:
    arena, drawn = None, None
    times_ns = range(recording.log.begin_ns, recording.log.end_ns + 1, PERIOD_NS)
    for moment in moments(recording.log, times_ns):
        if moment.saved.arena is not arena:
            arena = moment.saved.arena
            yield WALLS, moment.time_ns, _walls(arena, moment.time_ns)
        things = moment.saved.specs, moment.bodies["number"].tolist()
        if things != drawn:
            drawn = things
            yield SCENE, moment.time_ns, _scene(moment)
        yield POSES, moment.time_ns, _poses(moment)


def _of_events(recording: Recording) -> Iterator[Message]:
    for event in EventReader(recording.log).read():
        if event.kind in ("output", "bookmark"):
            name, time_ns = (f"robot {event.robot}" if event.robot else "bookmark"), ns_from_s(event.time_s)
            line = {"level": _LEVEL_INFO, "message": event.text, "name": name, "file": "", "line": 0}
            yield TEXT, time_ns, json.dumps({"timestamp": _time(time_ns), **line}).encode()


def _time(time_ns: int) -> dict[str, int]:
    return {"sec": time_ns // NS_PER_S, "nsec": time_ns % NS_PER_S}


def _walls(arena: Arena, time_ns: int) -> bytes:
    """Return the walls as a grid of brightness: 0 for the floor."""
    step = max(-(-max(arena.brightness.shape) // CELLS_MAX), 1)
    rows, columns = (-(-length // step) for length in arena.brightness.shape)
    padded = np.zeros((rows * step, columns * step), np.uint8)
    padded[: arena.brightness.shape[0], : arena.brightness.shape[1]] = arena.brightness
    cells = padded.reshape(rows, step, columns, step).max(axis=(1, 3))
    cell_m = arena.mm_per_cell * step / 1000
    values = {
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
    return json.dumps(values).encode()


def _scene(moment: Moment) -> bytes:
    """Return robots, balls and cylinders, each in a frame of its own that `_poses` moves."""
    entities = []
    for number, spec in enumerate(moment.saved.specs, 1):
        radius_m = spec.body.radius_mm / 1000
        arrow = {
            "pose": {**_STILL, "position": {"x": 0.0, "y": 0.0, "z": HEIGHT_M}},
            "shaft_length": radius_m * 0.6,
            "shaft_diameter": 0.004,
            "head_length": radius_m * 0.4,
            "head_diameter": 0.012,
            "color": dict.fromkeys("rgba", 1.0),
        }
        entities.append(
            _disc(f"robot {number}", radius_m, robot_colour(number - 1), moment.time_ns) | {"arrows": [arrow]}
        )
    for body in moment.bodies:
        entities.append(
            _disc(f"body {body['number']}", float(body["radius_mm"]) / 1000, body_colour(body), moment.time_ns)
        )
    deletion = {"timestamp": _time(moment.time_ns), "type": _ALL, "id": ""}
    return json.dumps({"deletions": [deletion], "entities": entities}).encode()


def _disc(name: str, radius_m: float, colour: Colour, time_ns: int) -> dict[str, Any]:
    disc = {
        "pose": {**_STILL, "position": {"x": 0.0, "y": 0.0, "z": HEIGHT_M / 2}},
        "size": {"x": 2 * radius_m, "y": 2 * radius_m, "z": HEIGHT_M},
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": {**dict(zip("rgb", (part / 255 for part in colour), strict=True)), "a": 1.0},
    }
    entity = {"timestamp": _time(time_ns), "frame_id": name, "id": name, "lifetime": _time(0)}
    return {**entity, "frame_locked": True, "cylinders": [disc]}


def _poses(moment: Moment) -> bytes:
    things = [(f"robot {number}", *pose) for number, pose in enumerate(moment.poses.tolist(), 1)]
    things += [(f"body {body['number']}", float(body["x_mm"]), float(body["y_mm"]), 0.0) for body in moment.bodies]
    transforms = [
        {
            "timestamp": _time(moment.time_ns),
            "parent_frame_id": "arena",
            "child_frame_id": name,
            "translation": {"x": round(x_mm / 1000, 5), "y": round(y_mm / 1000, 5), "z": 0},
            "rotation": {"x": 0, "y": 0, "z": math.sin(heading_rad / 2), "w": math.cos(heading_rad / 2)},
        }
        for name, x_mm, y_mm, heading_rad in things
    ]
    return json.dumps({"transforms": transforms}).encode()
