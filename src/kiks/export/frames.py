"""The data for browsers: binary frames of the state, the scene with all constant data, and a picture of the walls.

A frame is little endian: `HEAD`, and the arrays of `kiks.engine.sensing.frame_parts.write_frame`, one after the other:
robots, balls and cylinders, lamps, cameras, and the lengths of all rays. `web/frame.js` parses it.

No function changes the world. The caller holds the simulation's lock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from kiks.engine.parameters import AHEAD, RAY_COUNT
from kiks.engine.sensing.frame_parts import BODY_WORDS, LAMP_WORDS, SHOWN_CAMERA, SHOWN_ROBOT, write_frame
from kiks.engine.state import BALL
from kiks.export.light import light_scale
from kiks.export.looks import (
    HALO_MM,
    LED_COLOURS,
    LED_MM,
    lit_leds,
    robot_colours,
    robot_looks,
    robot_shapes,
)
from kiks.firmware.gripper import Gripper
from kiks.firmware.k213 import K213
from kiks.firmware.robot_kind import robot_kind
from kiks.firmware.turret import Shape
from kiks.model.arena import Arena
from kiks.model.picture import encode_picture
from kiks.model.robot import SENSOR_COUNT, RobotSpec
from kiks.sim.colours import body_colour
from kiks.sim.explanation import RESPONSES
from kiks.sim.simulation import Simulation

VERSION, KIND = 2, 1
"""Of frames."""

PAUSED, PROGRAM_DRIVES = 1, 2
"""Flags of a frame."""

HELD, LINE_IN_USE, LEDS = 8, 16, 1 << 16
"""Flags of a robot beside `TOUCHING`; the last is that of its first LED, and those of the others follow it."""

HEAD = np.dtype(
    [
        ("version", "u1"),
        ("kind", "u1"),
        ("flags", "<u2"),
        ("scene", "<u4"),
        ("time_s", "<f8"),
        ("speed_now", "<f4"),
        ("speed_average", "<f4"),
        ("robot_count", "<u2"),
        ("body_count", "<u2"),
        ("lamp_count", "<u2"),
        ("camera_count", "<u2"),
    ]
)


def pack_frame(
    sim: Simulation,
    *,
    scene: int,
    is_paused: bool = False,
    is_driven: bool = False,
    speed_now: float = 0.0,
    speed_average: float = 0.0,
    is_held: Callable[[str, int], bool] | None = None,
) -> bytes:
    """Return a frame of the present state.

    Args:
        sim: The world.
        scene: Number of the scene that the frame belongs to.
        is_paused: Whether time is paused.
        is_driven: Whether programs move the world.
        speed_now: Momentary speed [simulated seconds per real second].
        speed_average: Average speed since the start [simulated seconds per real second].
        is_held: Returns for "robot" and an index whether a hand holds it; if left out, no hand holds a robot.
    """
    sim.sync()
    world = sim.world
    robots: Any = np.empty(sim.robot_count, SHOWN_ROBOT)
    bodies = np.empty((world.state.bodies.shape[1], BODY_WORDS), np.float32)
    lamps = np.empty((len(world.lamps), LAMP_WORDS), np.float32)
    cameras: Any = np.empty(len(with_camera := robots_with_camera(sim)), SHOWN_CAMERA)
    cameras["robot"] = with_camera
    lengths = np.empty((sim.robot_count, SENSOR_COUNT, RAY_COUNT), np.uint16)
    bits = lit_leds(sim.specs, world.state.robots[0]) * np.uint32(LEDS)
    for index, wire in enumerate(sim.wires):
        if wire.holder is not None:
            bits[index] |= LINE_IN_USE
        if is_held is not None and is_held("robot", index):
            bits[index] |= HELD
    now = world.state.tick_count, world.now_ns
    write_frame(world.scene, *now, bits, robots, bodies, lamps, cameras, lengths)
    # A speed may be infinite or NaN; then 0 is shown.
    speeds = (speed if math.isfinite(speed) else 0.0 for speed in (speed_now, speed_average))
    counts = (len(part) for part in (robots, bodies, lamps, cameras))
    flags = PAUSED * is_paused + PROGRAM_DRIVES * is_driven
    head = np.array((VERSION, KIND, flags, scene, sim.time_s, *speeds, *counts), HEAD)
    return b"".join(part.tobytes() for part in (head, robots, bodies, lamps, cameras, lengths))


def robots_with_camera(sim: Simulation) -> list[int]:
    """Return the indices of robots with a camera."""
    return [
        index for index, wire in enumerate(sim.wires) if any(isinstance(each, K213) for each in wire.firmware.fitted)
    ]


def scene_key(sim: Simulation) -> tuple[Any, ...]:
    """Return what changes when a scene message no longer holds: the world, walls, robots, turrets, lamps or bodies.

    Of bodies their sizes and looks count, too.
    """
    turret_count = sum(len(wire.firmware.fitted) for wire in sim.wires)
    counts = sim.robot_count, turret_count, len(sim.world.lamps)
    return sim, sim.arena, *counts, *sim.world.state.bodies[["number", "radius_mm", "brightness"]][0].tolist()


def describe_scene(sim: Simulation, scene: int, names: Sequence[str] | None = None) -> dict[str, Any]:
    """Return the message to browsers with all data that frames leave out; robots without names have numbers.

    Positions of sensors, directions of rays and shapes are in the robot's frame, x ahead and y to the left.
    """
    looks = {(spec.kind, spec.body): spec for spec in sim.specs}
    return {
        "kind": "scene",
        "scene": scene,
        "arena": describe_arena(sim.arena),
        "light": light_scale(next(iter(sim.specs), None))._asdict(),
        "looks": [_describe_looks(spec) for spec in looks.values()],
        "responses": {name: RESPONSES[name] for name in dict.fromkeys(spec.proximity.response for spec in sim.specs)},
        "robots": [
            {"look": list(looks).index((spec.kind, spec.body))}
            | _describe_robot(sim, index, str(index + 1) if names is None else names[index])
            for index, spec in enumerate(sim.specs)
        ],
        "bodies": [
            {
                "number": int(body["number"]),
                "what": "ball" if body["what"] == BALL else "cylinder",
                "radius_mm": float(body["radius_mm"]),
                "colour": body_colour(body),
            }
            for body in sim.bodies()
        ],
    }


def describe_arena(arena: Arena) -> dict[str, Any]:
    """Return what the message about a scene says of its arena."""
    return {
        "name": arena.name,
        "width_mm": float(arena.width_mm),
        "height_mm": float(arena.height_mm),
        "mm_per_cell": float(arena.mm_per_cell),
        "has_floor": arena.shades is not None,
    }


def _describe_robot(sim: Simulation, index: int, name: str) -> dict[str, Any]:
    spec, turrets = sim.specs[index], sim.turrets(index + 1)
    kind = robot_kind(spec.kind)
    parameters = sim.world.kinds[int(sim.world.state.robots["kind"][0, index])]
    # More than 0.001 mm and 1e-5 rad would only make the message longer.
    angles_rad = np.arctan2(parameters["ray_sin"], parameters["ray_cos"])[:, :RAY_COUNT].round(5).tolist()
    x_mm, y_mm = (parameters[name].round(3).tolist() for name in ("ray_x_mm", "ray_y_mm"))
    return {
        "name": name,
        "kind": spec.name,
        "colours": robot_colours(index),
        "reach_mm": float(parameters["reach_mm"]),
        "response": spec.proximity.response,
        "counts_max": kind.counts_max,
        "speed_unit": spec.motor.speed_unit,
        "speed_scale": kind.speed_scale,
        "speed_max": kind.speed_max,
        "sensor_order": list(kind.sensor_order),
        "scales": {name: kind.scales.get(name, 1.0) for name in ("proximity", "ambient")},
        "sensors": [
            {
                "name": name,
                "x_mm": x_mm[sensor],
                "y_mm": y_mm[sensor],
                "angle_rad": angles_rad[sensor][AHEAD],
                "rays_rad": angles_rad[sensor],
            }
            for sensor, name in enumerate(kind.sensor_names)
        ],
        "turrets": [turret.name for turret in turrets],
        "has_gripper": any(isinstance(turret, Gripper) for turret in turrets),
        "shapes": _shapes(sim, index),
    }


def _describe_looks(spec: RobotSpec) -> dict[str, Any]:
    looks = robot_looks(spec)
    return {
        "radius_mm": spec.body.radius_mm,
        "wheel_base_mm": spec.body.wheel_base_mm,
        "white_stripes_rad": np.round(spec.body.white_stripes_rad, 5).tolist(),
        "wheel_mm": looks.wheel_mm,
        "low_mm": looks.low_mm,
        "high_mm": looks.high_mm,
        "parts": [_shape(shape) for shape in robot_shapes(spec)],
        "slabs": [_shape(each.shape) | {"low_mm": each.low_mm, "high_mm": each.high_mm} for each in looks.slabs],
        "leds": [
            {
                "name": led.name,
                "x_mm": led.ahead_mm,
                "y_mm": led.left_mm,
                "z_mm": led.height_mm,
                "radius_mm": LED_MM,
                "halo_mm": HALO_MM,
                **LED_COLOURS[led.colour],
            }
            for led in looks.leds
        ],
    }


def describe_shapes(sim: Simulation) -> dict[str, Any]:
    """Return the message to browsers with the present shapes of turrets."""
    return {"kind": "shapes", "robots": [_shapes(sim, index) for index in range(sim.robot_count)]}


def _shapes(sim: Simulation, index: int) -> list[dict[str, Any]]:
    """Return the shapes of a robot's turrets; frames contain those of a gripper."""
    return [
        _shape(shape)
        for turret in sim.turrets(index + 1)
        if not isinstance(turret, Gripper)
        for shape in turret.shapes()
    ]


def _shape(shape: Shape) -> dict[str, Any]:
    return {"points": [list(point) for point in shape.points], "colour": shape.colour, "radius_mm": shape.radius_mm}


def arena_picture(arena: Arena) -> bytes:
    """Return the walls of an arena as a PNG with one pixel per cell, its grey the brightness; 0 is floor.

    With a floor that is not white, that is the red of the pixels, and their green the brightness of the floor.
    """
    raster = arena.brightness
    if arena.shades is not None:
        raster = np.stack([raster, arena.shades, arena.shades], axis=-1)
    return encode_picture(raster, compress_level=3)  # large uniform areas compress well even so
