"""The data for browsers: binary frames of the state, the scene with all constant data, and a picture of the walls.

A frame is packed from arrays, without a loop over robots. It is little endian: `HEAD`, one `ROBOT` for each robot,
three numbers for each ball or cylinder, four for each lamp, one `CAMERA` for each camera, and the lengths of all rays;
`web/frame.js` parses it.

No function changes the world. The caller holds the simulation's lock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.parameters import AHEAD, RAY_COUNT
from kiks.engine.physics.motor import wheel_speeds
from kiks.engine.sensing.observe import NOTHING
from kiks.engine.state import BALL, MODE_POSITION, MODE_SPEED, PIXEL_COUNT
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

TOUCHING, HELD, LINE_IN_USE, LEDS = 1, 8, 16, 1 << 16
"""Flags of a robot; the last one is that of its first LED, and those of the others follow it."""

GRIPPED, LIFTED = 1.0, 2.0
"""State of a ball or cylinder in a gripper."""

NO_HIT = 65535
"""Length of a ray that hits nothing."""

RAY_UNIT_MM = 0.01
"""Unit of all other lengths of rays [mm]."""

PLACE_STEPS, HEADING_STEPS, WAY_STEPS, RAY_STEP = 64, 1024, 4, 32
"""Of coarse frames, steps in a millimetre of a place, in a radian of a heading and in a millimetre of a way driven, and
units of a step of a ray. They are too small to be seen, and powers of two, so most bytes stay the same."""

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

ROBOT = np.dtype(
    [
        ("pose", "<f4", (3,)),  # x_mm, y_mm, heading_rad
        ("measured_speed", "<f4", (2,)),  # left, right, in the unit of the motor
        ("commanded_speed", "<f4", (2,)),  # NaN for a motor on PWM
        ("flags", "<u4"),
        ("arm", "<f4"),
        ("jaws", "<f4"),
        ("contact_count", "<u4"),
        ("encoders", "<i4", (2,)),  # left, right [pulses]
        ("distances_mm", "<f4", (3,)),  # driven forwards, driven backwards, from the start
        ("proximity", "<f4", (SENSOR_COUNT,)),
        ("ambient", "<f4", (SENSOR_COUNT,)),
    ]
)

CAMERA = np.dtype([("robot", "<u2"), ("light", "<u2"), ("pixels", "u1", (PIXEL_COUNT,))])


def pack_frame(
    sim: Simulation,
    *,
    scene: int,
    is_paused: bool = False,
    is_driven: bool = False,
    speed_now: float = 0.0,
    speed_average: float = 0.0,
    is_held: Callable[[str, int], bool] | None = None,
    is_coarse: bool = False,
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
        is_coarse: Whether lengths and angles are rounded to what can be seen: many such frames together pack well.
    """
    seen = sim.look()
    records: Any = sim.world.state.robots[0]
    robots: Any = np.zeros(sim.robot_count, ROBOT)
    robots["pose"] = seen.poses
    robots["measured_speed"] = wheel_speeds(records, [spec.motor for spec in sim.specs])
    robots["commanded_speed"] = _commanded(records)
    robots["flags"] = (records["is_touching"] != 0) * TOUCHING | lit_leds(sim.specs, records) * LEDS
    for index, wire in enumerate(sim.wires):
        if wire.holder is not None:
            robots["flags"][index] |= LINE_IN_USE
        if is_held is not None and is_held("robot", index):
            robots["flags"][index] |= HELD
    robots["arm"], robots["jaws"] = records["arm"], records["jaws"]
    robots["contact_count"] = records["contact_count"]
    # The robot's own counters wrap at 32 bits, too.
    robots["encoders"] = (records["pulse_count"] + records["counter_offset"]).astype(np.int32)
    robots["distances_mm"] = sim.world.distances_mm()
    ray_step = 1
    if is_coarse:
        steps = np.array((PLACE_STEPS, PLACE_STEPS, HEADING_STEPS), "<f4")
        robots["pose"] = np.rint(robots["pose"] * steps) / steps
        robots["distances_mm"] = np.rint(robots["distances_mm"] * WAY_STEPS) / WAY_STEPS
        ray_step = RAY_STEP
    robots["proximity"], robots["ambient"] = seen.proximity, seen.ambient
    bodies, lamps, cameras = _pack_bodies(sim, seen.places), sim.world.lamps.astype("<f4"), _pack_cameras(sim)
    # A speed may be infinite or NaN; then 0 is shown.
    speeds = (speed if math.isfinite(speed) else 0.0 for speed in (speed_now, speed_average))
    counts = (len(part) for part in (robots, bodies, lamps, cameras))
    flags = PAUSED * is_paused + PROGRAM_DRIVES * is_driven
    head = np.array((VERSION, KIND, flags, scene, sim.time_s, *speeds, *counts), HEAD)
    lengths = np.minimum(np.maximum(ray_step * np.rint(seen.lengths_mm / (ray_step * RAY_UNIT_MM)), 0), NO_HIT - 1)
    lengths[seen.met == NOTHING] = NO_HIT
    return b"".join(part.tobytes() for part in (head, robots, bodies, lamps, cameras, lengths.astype("<u2")))


def _commanded(records: Any) -> NDArray[np.float64]:
    """Return the set points of the speeds, in the unit of each motor, [robot, 2]; NaN for a motor on PWM."""
    mode = records["motor_mode"]
    planned = np.where(mode == MODE_POSITION, records["trajectory_speed"], np.nan)
    speeds: NDArray[np.float64] = np.where(mode == MODE_SPEED, records["speed_setpoint"], planned)
    return speeds


def _pack_bodies(sim: Simulation, places: NDArray[np.float64]) -> NDArray[np.float32]:
    records: Any = sim.world.state.bodies[0]
    bodies = np.empty((len(records), 3), "<f4")
    bodies[:, :2] = places
    bodies[:, 2] = np.where(records["is_lifted"] != 0, LIFTED, np.where(records["holder"] != 0, GRIPPED, 0.0))
    return bodies


def _pack_cameras(sim: Simulation) -> NDArray[np.void]:
    robots = [
        index for index, wire in enumerate(sim.wires) if any(isinstance(each, K213) for each in wire.firmware.fitted)
    ]
    cameras: NDArray[np.void] = np.zeros(len(robots), CAMERA)
    records: Any = sim.world.state.robots[0, robots]
    cameras["robot"] = robots
    cameras["light"], cameras["pixels"] = records["camera_light"], records["camera_pixels"]
    return cameras


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
