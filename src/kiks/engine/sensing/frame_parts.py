"""What browsers see of a world at an instant, in the bytes in which frames hold it (`kiks.export.frames`).

Need: a desk gets frames from its server, and a page makes them of its own run. So this kernel writes all of a frame
but its head, and `desk/web/frame.js` reads the same bytes from either.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, inlined
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.physics.motor import clamp
from kiks.engine.scene import open_scene
from kiks.engine.sensing.observe import NOTHING, find_places, gaze_linked, read_robots
from kiks.engine.state import MODE_POSITION, MODE_SPEED, PIXEL_COUNT
from kiks.model.robot import SENSOR_COUNT

TOUCHING = 1
"""Flag of a robot; the caller of `write_frame` knows the others."""

GRIPPED, LIFTED = 1.0, 2.0
"""State of a ball or cylinder in a gripper."""

NO_HIT = 65535
"""Length of a ray that hits nothing."""

RAY_UNIT_MM = 0.01
"""Unit of all other lengths of rays [mm]."""

SHOWN_ROBOT = np.dtype(
    [
        ("pose", "f4", (3,)),  # x_mm, y_mm, heading_rad
        ("measured_speed", "f4", (2,)),  # left, right, in the unit of the motor
        ("commanded_speed", "f4", (2,)),  # NaN for a motor on PWM
        ("flags", "u4"),
        ("arm", "f4"),
        ("jaws", "f4"),
        ("contact_count", "u4"),
        ("encoders", "i4", (2,)),  # left, right [pulses]
        ("distances_mm", "f4", (3,)),  # driven forwards, driven backwards, from the start
        ("proximity", "f4", (SENSOR_COUNT,)),
        ("ambient", "f4", (SENSOR_COUNT,)),
    ]
)

SHOWN_CAMERA = np.dtype([("robot", "u2"), ("light", "u2"), ("pixels", "u1", (PIXEL_COUNT,))])

BODY_WORDS, LAMP_WORDS = 3, 4


@entry
def write_frame(
    scene: Any,
    tick_count: Any,
    time_ns: Any,
    flags: Any,
    robots: Any,
    bodies: Any,
    lamps: Any,
    cameras: Any,
    lengths: Any,
) -> Any:
    """Write what a frame says of the robots, bodies, lamps, cameras and rays of the first world.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        tick_count: Ticks done.
        time_ns: The present time.
        flags: Flags of robots beside `TOUCHING`, uint32 [robot].
        robots: Records of `SHOWN_ROBOT`, shape [robot].
        bodies: x [mm], y [mm] and the state of balls and cylinders, float32 [body, 3].
        lamps: x [mm], y [mm], power [W] and 1 for on or 0 for off, float32 [lamp, 4].
        cameras: Records of `SHOWN_CAMERA`, whose `robot` the caller has written, shape [camera].
        lengths: Of all rays [0.01 mm] or `NO_HIT`, uint16 [robot, 8, 7].
    """
    scene = open_scene(scene[0])
    count = robots.shape[0]
    poses, places = np.empty((count, 3)), np.empty((bodies.shape[0], 2))
    proximity, ambient = np.empty((count, SENSOR_COUNT)), np.empty((count, SENSOR_COUNT))
    rays, met = np.empty((count, SENSOR_COUNT, 3, RAY_COUNT)), np.empty((count, SENSOR_COUNT, RAY_COUNT), np.int64)
    find_places(scene, tick_count, time_ns, poses, places)
    read_robots(scene, tick_count, time_ns, proximity, ambient)
    gaze_linked(scene, tick_count, time_ns, 0, rays, met)
    for k in range(count):
        _write_robot(scene.robots[0, k], scene.kinds[scene.robots[0, k].kind], poses[k], flags[k], robots[k])
        for sensor in range(SENSOR_COUNT):
            robots[k].proximity[sensor] = proximity[k, sensor]
            robots[k].ambient[sensor] = ambient[k, sensor]
            for ray in range(RAY_COUNT):
                steps = min(max(0.0, np.rint(rays[k, sensor, 0, ray] / RAY_UNIT_MM)), NO_HIT - 1.0)
                lengths[k, sensor, ray] = NO_HIT if met[k, sensor, ray] == NOTHING else np.int64(steps)
    for k in range(bodies.shape[0]):
        body = scene.bodies[0, k]
        bodies[k, 0], bodies[k, 1] = places[k, 0], places[k, 1]
        bodies[k, 2] = LIFTED if body.is_lifted != 0 else GRIPPED if body.holder != 0 else 0.0
    for k in range(lamps.shape[0]):
        for part in range(LAMP_WORDS):
            lamps[k, part] = scene.lamps[0, k, part]
    for k in range(cameras.shape[0]):
        robot = scene.robots[0, cameras[k].robot]
        cameras[k].light = robot.camera_light
        for pixel in range(PIXEL_COUNT):
            cameras[k].pixels[pixel] = robot.camera_pixels[pixel]


@inlined
def _write_robot(robot: Any, parameters: Any, pose: Any, flags: Any, shown: Any) -> Any:
    """Write what the record of a robot says."""
    for part in range(3):
        shown.pose[part] = pose[part]
    # A stepper has at once the speed that was set.
    limit = parameters.steps_per_s_max
    for wheel in range(2):
        mode, wanted = robot.motor_mode[wheel], 1.0 * robot.speed_setpoint[wheel]
        planned = robot.trajectory_speed[wheel] if mode == MODE_POSITION else np.nan
        shown.measured_speed[wheel] = clamp(wanted, limit) if limit > 0.0 else 1.0 * robot.measured_speed[wheel]
        shown.commanded_speed[wheel] = wanted if mode == MODE_SPEED else planned
        # The robot's own counters wrap at 32 bits, too.
        shown.encoders[wheel] = robot.pulse_count[wheel] + robot.counter_offset[wheel]
    shown.flags = flags | np.uint32(TOUCHING if robot.is_touching != 0 else 0)
    shown.arm, shown.jaws = robot.arm, robot.jaws
    shown.contact_count = robot.contact_count
    shown.distances_mm[0], shown.distances_mm[1] = robot.forwards_mm, robot.backwards_mm
    x_mm, y_mm = robot.x_mm - robot.start_x_mm, robot.y_mm - robot.start_y_mm
    shown.distances_mm[2] = math.sqrt(x_mm * x_mm + y_mm * y_mm)
