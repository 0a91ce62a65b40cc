"""The engine for browsers: which kernels it has, how records lie in its memory, and the file that pages carry.

`make engine` writes the file. The kernels are those of this computer, compiled for browsers
(`kiks.engine.webassembly`): a scene, the loop of a batch and all that a page shows of a world.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from kiks.batch import callbacks, loop
from kiks.batch.kernel_args import Worlds
from kiks.batch.loop_timing import Timing
from kiks.control import observed_measures
from kiks.control.actuators import ACTUATORS
from kiks.control.controllers import linear
from kiks.control.senses import SENSES
from kiks.control.turret_parts import TurretPart
from kiks.engine import code_cache, scene, step, wall_tables, webassembly
from kiks.engine.parameters import PARAMETERS
from kiks.engine.physics import contact
from kiks.engine.sensing import (
    ambient,
    camera,
    explain,
    floor_spots,
    frame_parts,
    lamplight,
    observe,
    proximity,
)
from kiks.engine.state import BODY, ROBOT
from kiks.model.robot import RobotSpec

# isort: split
import llvmlite
import numba
from numba import types

ENGINE = Path(scene.__file__).with_name("engine.wasm")
"""The file."""

VEHICLE = linear()
"""The controller that each page can go on with: a Braitenberg vehicle."""

VEHICLE_PARAMETERS = 18
"""The number of its parameters."""

PARTS: dict[str, TurretPart] = {f"sense_{name}": sense for name, sense in SENSES.items()} | {
    f"actuator_{order.name}": order for orders in ACTUATORS.values() for order in orders
}
"""The senses and actuators that come with KiKS, by the names of their functions in the engine."""

_types: Any = types
_typeof: Any = numba.typeof

_WHOLE, _NUMBER, _IS = _types.int64, _types.float64, _types.boolean


def _array(element: Any, dimensions: int) -> Any:
    return _types.Array(element, dimensions, "C")


def _numbers(dimensions: int) -> Any:
    return _array(_NUMBER, dimensions)


def _integers(dimensions: int) -> Any:
    return _array(_WHOLE, dimensions)


def functions() -> dict[str, tuple[Any, tuple[Any, ...]]]:
    """Return what the engine exports: functions with the types of their arguments, by name."""
    record = _typeof(np.zeros(1, scene.SCENE))
    now = record, _WHOLE, _WHOLE  # ticks and time
    of_robot = record, _WHOLE, _WHOLE, _WHOLE
    read = *of_robot, _IS, _numbers(1)
    shown = [_typeof(np.zeros(1, each)) for each in (frame_parts.SHOWN_ROBOT, frame_parts.SHOWN_CAMERA)]
    words = _array(_types.float32, 2)
    parts = _array(_types.uint32, 1), shown[0], words, words, shown[1], _array(_types.uint16, 3)
    raster = _array(_types.uint8, 2)
    of_sensor = record, *(_WHOLE,) * 4
    return {
        "advance": (step.advance, now),
        "enter_worlds": (scene.enter_worlds, (record, _integers(1))),
        "fill_distances": (
            wall_tables.fill_distances,
            (raster, _NUMBER, _array(_types.float32, 2), _array(_types.float32, 2), _array(_types.int16, 2)),
        ),
        "fill_faces": (wall_tables.fill_faces, (_array(_types.int16, 2), _NUMBER, _array(_types.int32, 2))),
        "fill_plains": (floor_spots.fill_plains, (raster, _NUMBER, _array(_types.int16, 2))),
        "clearance_of_disc": (contact.clearance_of_disc, (_array(_types.float32, 2), *(_NUMBER,) * 5)),
        "write_frame": (frame_parts.write_frame, (*now, *parts)),
        "light_floor": (
            lamplight.light_floor,
            (raster, _NUMBER, _numbers(2), _numbers(1), _NUMBER, _NUMBER, _array(_types.float32, 2)),
        ),
        "read_all": (observe.read_all, (*now, _numbers(2), _numbers(2))),
        "read_proximity": (proximity.read_proximity, read),
        "read_ambient": (ambient.read_ambient, read),
        "take_image": (camera.take_image, read),
        "explain_proximity": (explain.explain_proximity, (*of_sensor, _types.Tuple((_numbers(2), _integers(1))))),
        "explain_ambient": (explain.explain_ambient, (*of_sensor, _types.Tuple((_numbers(2), _integers(2))))),
        "look_at": (
            observed_measures.look_at,
            (
                *of_sensor,
                _types.Tuple((_numbers(1), _integers(1))),
                _types.Tuple((_numbers(2), _numbers(1), _numbers(2))),
            ),
        ),
        "roll_out": (loop.roll_out, _loop_types(record)),
        "decide": (callbacks.decider(VEHICLE, VEHICLE_PARAMETERS), callbacks.DECIDER),
        **{name: (part.kernel, part.argument_types) for name, part in PARTS.items()},
    }


def _loop_types(record: Any) -> tuple[Any, ...]:
    """Return the types of the arguments of `kiks.batch.loop.roll_out`."""
    worlds = Worlds(
        line=Timing().line(RobotSpec.load("khepera")),
        **{name: np.zeros((0,) * dimensions, element) for name, (element, dimensions) in LOOP_ARRAYS.items()},
    )
    called = _types.Tuple((_integers(2), _integers(2), _WHOLE))
    return record, _typeof(worlds), _WHOLE, _integers(1), _types.UniTuple(_WHOLE, 3), called


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
    about = {
        "layouts": {name: _layout(record) for name, record in layouts.items()},
        "loop": [(name, np.dtype(LOOP_ARRAYS[name][0]).str[1:], LOOP_ARRAYS[name][1]) for name in Worlds._fields[1:]],
        "sources": sources(),
        "compilers": compilers(),
    }
    return webassembly.module_of(functions(), about, [scene.MEETING])


def _layout(record: Any) -> dict[str, Any]:
    """Return the size of a record, and the offset, the element and the shape of each field."""
    fields = {
        name: [offset, (kind.subdtype or (kind,))[0].str[1:], list(kind.shape)]
        for name, (kind, offset, *_) in record.fields.items()
    }
    return {"size": record.itemsize, "fields": fields}


def compilers() -> dict[str, str]:
    """Return the versions of what makes the engine: others may make other bytes of the same sources."""
    return {"numba": numba.__version__, "llvmlite": llvmlite.__version__}


def sources() -> str:
    """Return a digest of the sources that the engine is made from: another one needs another file."""
    modules = {function.py_func.__module__ for function, _ in functions().values()} | {VEHICLE.function.__module__}
    digests = [code_cache.digest_of(module) for module in [*sorted(modules), webassembly.__name__, __name__]]
    return hashlib.sha256(" ".join(digests).encode() + webassembly.HELPERS.read_bytes()).hexdigest()[:16]
