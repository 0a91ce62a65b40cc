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
from mcap.writer import CompressionType, Writer

from kiks.errors import ParameterError
from kiks.export.looks import Colour, body_colour, robot_colour
from kiks.export.sheet import coarse_cells
from kiks.model.arena import Arena
from kiks.model.atomic_files import ending_of, writing
from kiks.recording.events import EventReader
from kiks.recording.mcap_file import ENDING
from kiks.recording.moments import Moment, moments
from kiks.recording.recording import Recording
from kiks.units import NS_PER_S, ns_from_s
from kiks.version import __version__

PERIOD_NS = NS_PER_S // 10
"""Simulated time between two poses [ns]. Foxglove draws robots between them, too."""

PROGRESS_MESSAGES = 1000
"""Messages between two reports of the progress."""

CELLS_MAX = 200
"""Most cells of the walls' picture in each direction."""

HEIGHT_M = 0.03
"""Height of a robot in the picture [m]."""

Message = tuple[str, str, int, dict[str, Any]]
"""Topic, schema, time [ns] and values."""

_LEVEL_INFO, _TYPE_UINT8, _ALL = 2, 1, 1
_STILL = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def save_foxglove(
    recording: Recording, path: str | Path, *, on_progress: Callable[[float], None] = lambda share: None
) -> None:
    """Write a recording as an MCAP file that Foxglove shows."""
    ending_of(path, "a recording for Foxglove", (ENDING,))
    if (source := getattr(recording.log.reader, "path", None)) and Path(path).exists() and source.samefile(path):
        raise ParameterError(
            f"a recording for Foxglove must be another file than its recording, but {str(path)!r} is that. Choose "
            "another name."
        )
    begin_ns, end_ns = recording.log.begin_ns, recording.log.end_ns
    channels: dict[str, int] = {}
    with writing(path, "a recording for Foxglove") as beside:
        writer = Writer(beside.file, compression=CompressionType.LZ4)
        writer.start(library=f"kiks {__version__}")
        messages = merge(_of_moments(recording), _of_events(recording), key=lambda message: message[2])
        for count, (topic, schema, time_ns, values) in enumerate(messages):
            if topic not in channels:
                text = json.dumps({"title": f"foxglove.{schema}", **_schema_of(values)})
                number = writer.register_schema(f"foxglove.{schema}", "jsonschema", text.encode())
                channels[topic] = writer.register_channel(topic, "json", number)
            writer.add_message(channels[topic], time_ns, json.dumps(values).encode(), time_ns)
            if count % PROGRESS_MESSAGES == 0:
                on_progress((time_ns - begin_ns) / max(end_ns - begin_ns, 1))
        writer.finish()  # type: ignore[no-untyped-call]


def _schema_of(value: Any) -> dict[str, Any]:
    """Return the JSON schema of the messages that have the form of an example.

    Example:
        >>> _schema_of({"x": 1.5, "names": ["a"]})["properties"]
        {'x': {'type': 'number'}, 'names': {'type': 'array', 'items': {'type': 'string'}}}
    """
    if isinstance(value, dict):
        return {"type": "object", "properties": {name: _schema_of(each) for name, each in value.items()}}
    if isinstance(value, list):
        return {"type": "array", "items": _schema_of(value[0]) if value else {"type": "object"}}
    if isinstance(value, Base64):
        return {"type": "string", "contentEncoding": "base64"}
    return {"type": {bool: "boolean", int: "integer", float: "number", str: "string"}[type(value)]}


class Base64(str):
    """Bytes as text."""


def _of_moments(recording: Recording) -> Iterator[Message]:
    arena, drawn = None, None
    times_ns = range(recording.log.begin_ns, recording.log.end_ns + 1, PERIOD_NS)
    for moment in moments(recording.log, times_ns):
        if moment.saved.arena is not arena:
            arena = moment.saved.arena
            yield "/walls", "Grid", moment.time_ns, _walls(arena, moment.time_ns)
        things = moment.saved.specs, moment.bodies["number"].tolist()
        if things != drawn:
            drawn = things
            yield "/scene", "SceneUpdate", moment.time_ns, _scene(moment)
        yield "/tf", "FrameTransforms", moment.time_ns, _poses(moment)


def _of_events(recording: Recording) -> Iterator[Message]:
    for event in EventReader(recording.log).notes():
        if event.kind in ("output", "bookmark"):
            name, time_ns = (f"robot {event.robot}" if event.robot else "bookmark"), ns_from_s(event.time_s)
            line = {"level": _LEVEL_INFO, "message": event.text, "name": name, "file": "", "line": 0}
            yield "/log", "Log", time_ns, {"timestamp": _time(time_ns), **line}


def _time(time_ns: int) -> dict[str, int]:
    return {"sec": time_ns // NS_PER_S, "nsec": time_ns % NS_PER_S}


def _walls(arena: Arena, time_ns: int) -> dict[str, Any]:
    """Return the walls as a grid of brightness: 0 for the floor."""
    cells, cell_mm = coarse_cells(arena.brightness, arena.mm_per_cell, CELLS_MAX)
    columns, cell_m = cells.shape[1], cell_mm / 1000
    return {
        "timestamp": _time(time_ns),
        "frame_id": "arena",
        "pose": _STILL,
        "column_count": columns,
        "cell_size": {"x": cell_m, "y": cell_m},
        "row_stride": columns,
        "cell_stride": 1,
        "fields": [{"name": "brightness", "offset": 0, "type": _TYPE_UINT8}],
        "data": Base64(base64.b64encode(np.ascontiguousarray(cells).tobytes()).decode()),
    }


def _scene(moment: Moment) -> dict[str, Any]:
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
        disc = _disc(f"robot {number}", radius_m, robot_colour(number - 1), moment.time_ns)
        entities.append(disc | {"arrows": [arrow]})
    for body in moment.bodies:
        name, radius_m = f"body {body['number']}", float(body["radius_mm"]) / 1000
        entities.append(_disc(name, radius_m, body_colour(body), moment.time_ns))
    return {"deletions": [{"timestamp": _time(moment.time_ns), "type": _ALL, "id": ""}], "entities": entities}


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


def _poses(moment: Moment) -> dict[str, Any]:
    things = [(f"robot {number}", *pose) for number, pose in enumerate(moment.poses.tolist(), 1)]
    things += [(f"body {body['number']}", float(body["x_mm"]), float(body["y_mm"]), 0.0) for body in moment.bodies]
    transforms = [
        {
            "timestamp": _time(moment.time_ns),
            "parent_frame_id": "arena",
            "child_frame_id": name,
            "translation": {"x": round(x_mm / 1000, 5), "y": round(y_mm / 1000, 5), "z": 0.0},
            "rotation": {"x": 0.0, "y": 0.0, "z": math.sin(heading_rad / 2), "w": math.cos(heading_rad / 2)},
        }
        for name, x_mm, y_mm, heading_rad in things
    ]
    return {"transforms": transforms}
