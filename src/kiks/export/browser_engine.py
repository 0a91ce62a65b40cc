"""The engine for browsers: which kernels it has, how records lie in its memory, and the file that pages carry.

`make engine` writes the file. The kernels are those of this computer, compiled for browsers
(`kiks.engine.webassembly`): a scene, the loop of a batch and all that a page shows of a world.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from kiks.batch import loop
from kiks.batch.kernel_args import Worlds
from kiks.batch.loop_timing import Timing
from kiks.control import looks
from kiks.control.senses import ARGUMENTS as SENSE
from kiks.control.senses import SENSES
from kiks.engine import code_cache, scene, step, wall_tables, webassembly
from kiks.engine.parameters import PARAMETERS
from kiks.engine.physics import motor
from kiks.engine.sensing import ambient, camera, explain, floor_spots, frame_parts, observe, proximity
from kiks.engine.state import BODY, ROBOT
from kiks.model.robot import RobotSpec

# isort: split
import numba
from numba import types

ENGINE = Path(scene.__file__).with_name("engine.wasm")
"""The file."""

_types: Any = types
_typeof: Any = numba.typeof

_WHOLE, _NUMBER, _IS = _types.int64, _types.float64, _types.boolean


def _array(element: Any, dimensions: int) -> Any:
    return _types.Array(element, dimensions, "C")


def _numbers(dimensions: int) -> Any:
    return _array(_NUMBER, dimensions)


def _integers(dimensions: int) -> Any:
    return _array(_WHOLE, dimensions)


def _records(element: Any) -> Any:
    return numba.typeof(np.zeros(1, element))


def functions() -> dict[str, tuple[Any, tuple[Any, ...]]]:
    """Return what the engine exports: functions with the types of their arguments, by name."""
    record = _typeof(np.zeros(1, scene.SCENE))
    robots = _typeof(np.zeros((1, 1), ROBOT))
    now = record, _WHOLE, _WHOLE  # ticks and time
    of_robot = record, _WHOLE, _WHOLE, _WHOLE
    read = *of_robot, _IS, _numbers(1)
    of_sensor = record, *(_WHOLE,) * 4
    bytes_, small, narrow = (_array(each, 2) for each in (_types.uint8, _types.int16, _types.float32))
    shown = (
        _array(_types.uint32, 1),
        _records(frame_parts.SHOWN_ROBOT),
        narrow,
        narrow,
        _records(frame_parts.SHOWN_CAMERA),
        _array(_types.uint16, 3),
    )
    return {
        "advance": (step.advance, now),
        "enter_worlds": (scene.enter_worlds, (record, _integers(1))),
        "fill_distances": (wall_tables.fill_distances, (bytes_, _NUMBER, narrow, narrow, small)),
        "fill_faces": (wall_tables.fill_faces, (small, _NUMBER, _array(_types.int32, 2))),
        "fill_plains": (floor_spots.fill_plains, (bytes_, _NUMBER, small)),
        "write_frame": (frame_parts.write_frame, (*now, *shown)),
        "places_at": (observe.places_at, (*now, _numbers(2), _numbers(2))),
        "read_all": (observe.read_all, (*now, _numbers(2), _numbers(2))),
        "read_proximity": (proximity.read_proximity, read),
        "read_ambient": (ambient.read_ambient, read),
        "take_image": (camera.take_image, read),
        "gaze": (observe.gaze, (*of_robot, _numbers(4), _integers(3))),
        "explain_proximity": (explain.explain_proximity, (*of_sensor, _types.Tuple((_numbers(2), _integers(1))))),
        "explain_ambient": (explain.explain_ambient, (*of_sensor, _types.Tuple((_numbers(2), _integers(2))))),
        "look_at": (
            looks.look_at,
            (
                *of_sensor,
                _types.Tuple((_numbers(1), _integers(1))),
                _types.Tuple((_numbers(2), _numbers(1), _numbers(2))),
            ),
        ),
        "set_speed": (motor.set_speed, (robots, *(_WHOLE,) * 4)),
        "roll_out": (loop.roll_out, _loop_types(record)),
        **{f"sense_{name}": (sense.kernel, SENSE) for name, sense in SENSES.items()},
    }


def _loop_types(record: Any) -> tuple[Any, ...]:
    """Return the types of the arguments of `kiks.batch.loop.roll_out`."""
    worlds = Worlds(
        line=Timing().line(RobotSpec.load("khepera")),
        **{name: np.zeros((0,) * dimensions, element) for name, (element, dimensions) in LOOP_ARRAYS.items()},
    )
    callbacks = _types.Tuple((_integers(2), _integers(2), _WHOLE))
    return record, _typeof(worlds), _WHOLE, _integers(1), _types.UniTuple(_WHOLE, 3), callbacks


LOOP_ARRAYS: dict[str, tuple[type, int]] = {
    "senses": (np.int64, 2),
    "scales": (np.float64, 1),
    "sensor_orders": (np.int64, 2),
    "sense_counts": (np.int64, 1),
    "has_camera": (np.bool_, 1),
    "ticks": (np.int64, 1),
    "begins_ns": (np.int64, 1),
    "watched_ns": (np.int64, 1),
    "sensed_ns": (np.int64, 1),
    "steps": (np.int64, 1),
    "sensors": (np.float64, 3),
    "wheels": (np.float64, 3),
    "turns": (np.int64, 2),
    "memory": (np.float64, 3),
    "parameters": (np.float64, 3),
    "notes": (np.float64, 3),
    "orders": (np.int64, 2),
    "order_counts": (np.int64, 1),
    "sent": (np.float64, 3),
    "switch_ticks": (np.int64, 2),
    "switch_codes": (np.int64, 2),
    "switched": (np.int64, 1),
}
"""Elements and dimensions of the arrays in `kiks.batch.kernel_args.Worlds`."""


def build() -> bytes:
    """Return the engine; this process can run no kernel from then on."""
    webassembly.compile_for_browsers()
    layouts = {"ROBOT": ROBOT, "BODY": BODY, "PARAMETERS": PARAMETERS, "SCENE": scene.SCENE}
    about = {"layouts": {name: _layout(record) for name, record in layouts.items()}, "sources": sources()}
    return webassembly.module_of(functions(), about, [scene.MEETING])


def _layout(record: Any) -> dict[str, Any]:
    """Return the size of a record, and the offset, the element and the shape of each field."""
    fields = {
        name: [offset, (kind.subdtype or (kind,))[0].str[1:], list(kind.shape)]
        for name, (kind, offset, *_) in record.fields.items()
    }
    return {"size": record.itemsize, "fields": fields}


def sources() -> str:
    """Return a digest of the sources that the engine is made from: another one needs another file."""
    modules = sorted({function.py_func.__module__ for function, _ in functions().values()})
    digests = [code_cache.digest_of(module) for module in [*modules, webassembly.__name__, __name__]]
    return hashlib.sha256(" ".join(digests).encode()).hexdigest()[:16]
