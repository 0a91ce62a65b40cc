"""A controller for the engine of a page: what the loop of a batch knows of it, and its code for browsers.

Its code is made by a process of its own, which compiles for browsers and could run none of it
(`kiks.engine.webassembly`).
"""

from __future__ import annotations

import base64
import pickle
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from kiks.batch.callbacks import DECIDER, decider
from kiks.batch.loop_timing import Timing
from kiks.control.actuators import order_rows_of
from kiks.control.controller import Controller
from kiks.control.robot_controllers import RobotControllers
from kiks.control.senses import conversions_of, reading_count, rows_of, sense_of
from kiks.control.turret_parts import TurretPart
from kiks.engine.webassembly import compile_for_browsers, module_of, section_of
from kiks.errors import ParameterError
from kiks.export.browser_engine import ENGINE, PARTS, VEHICLE
from kiks.firmware.robot_kind import robot_kind
from kiks.model.robot import SENSOR_COUNT, RobotSpec

EXPLORER = (
    *(0.45, 0.45),
    *(0.3, -0.3, 0.6, -0.6, 0.5, -0.9),  # a wall on the left turns it to the right
    *(-0.7, 0.4, -0.6, 0.6, -0.3, 0.3),
    *(0.1, 0.1, 0.1, 0.1),
)
"""Parameters with which a Braitenberg vehicle drives around and keeps off walls: a bias of each wheel, then the weights
of each sensor for both. It drives 35 mm/s and touches something once in 20 to 90 s."""


def describe_controller(
    controller: Controller, parameters: Sequence[float], spec: RobotSpec, timing: Timing, title: str
) -> dict[str, Any]:
    """Return what `web/go_on.js` needs to drive robots.

    Args:
        controller: The controller.
        parameters: Its parameters.
        spec: The kind of all robots.
        timing: Timing of the control loop.
        title: What people read.

    Returns:
        Values of `kiks.batch.kernel_args.Worlds` for one robot by their names, where functions stand by the names of
        their exports; the names of the parameters; the module that exports what the engine does not.
    """
    kind, driving = robot_kind(spec.kind), RobotControllers(controller, list(parameters), 1, 1)
    scales, orders_of_sensors = conversions_of(driving.senses, kind)
    exports = {part: name for name, part in PARTS.items()}
    own = {f"part_{number}": part for number, part in enumerate(driving.parts) if part not in exports}
    exports |= {part: name for name, part in own.items()}
    senses = [exports[sense_of(each)] for each in driving.senses]
    is_known = controller == VEHICLE and not own
    module = b"" if is_known else _module(controller, len(parameters), tuple(own.items()))
    return {
        "title": title,
        "parameters": driving.parameters[0, 0].tolist(),
        "labels": parameter_names(controller, len(parameters)),
        "module": base64.b64encode(module).decode(),
        "line": list(timing.line(spec)),
        "speed_scale": kind.speed_scale,
        "senses": [[name, *row[1:]] for name, row in zip(senses, rows_of(driving.senses, kind).tolist(), strict=True)],
        "scales": scales.tolist(),
        "sensor_orders": orders_of_sensors.tolist(),
        "orders": [
            [exports[part], *row[1:]]
            for part, row in zip(driving.orders, order_rows_of(driving.parts).tolist(), strict=True)
        ],
        "sensor_count": reading_count(driving.senses),
        "memory_count": driving.memory_count,
    }


def parameter_names(controller: Controller, count: int) -> list[str]:
    """Return what people read beside each parameter of a controller.

    Example:
        >>> parameter_names(VEHICLE, 18)[:4]
        ['left', 'right', 'left, sensor 0', 'right, sensor 0']
    """
    wheels = "left", "right"
    if controller == VEHICLE and count == 2 * (SENSOR_COUNT + 1):
        return [*wheels, *(f"{wheel}, sensor {sensor}" for sensor in range(SENSOR_COUNT) for wheel in wheels)]
    return [f"parameter {number}" for number in range(1, count + 1)]


@lru_cache(64)
def _module(controller: Controller, parameter_count: int, parts: tuple[tuple[str, TurretPart], ...]) -> bytes:
    """Return a module that exports `decide`, which the loop of a batch calls, and parts by their names."""
    # Both share one memory: the data of the controller are behind those of the engine.
    begin = section_of(ENGINE.read_bytes())["end"]
    given = pickle.dumps((sys.path, controller, parameter_count, dict(parts), begin))
    made = subprocess.run([sys.executable, "-m", __name__], input=given, capture_output=True, check=False)
    if made.returncode:
        reason = made.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise ParameterError(f"the controller {controller.name!r} must be one that browsers can run, but: {reason}")
    return made.stdout


def _make(controller: Controller, parameter_count: int, parts: Mapping[str, TurretPart], begin: int) -> bytes:
    functions = {name: (part.kernel, part.argument_types) for name, part in parts.items()}
    return module_of({"decide": (decider(controller, parameter_count), DECIDER), **functions}, {}, begin=begin)


if __name__ == "__main__":
    compile_for_browsers()
    # What a controller's file prints as it is imported is no part of the module.
    out, sys.stdout = sys.stdout.buffer, sys.stderr
    sys.path[:], *arguments = pickle.loads(sys.stdin.buffer.read())
    out.write(_make(*arguments))
    out.flush()  # Python does so at its end for what is in its place
