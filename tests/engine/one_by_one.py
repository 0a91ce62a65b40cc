"""The slow oracle of lanes: one robot, one sensor and one ray at a time, from the same formulas."""

import numpy as np

from kiks.engine.bunch import give_back, make_lanes, make_room, take
from kiks.engine.compiling import entry, kernel
from kiks.engine.numbers import sin_cos, stream_of
from kiks.engine.physics.contact import clearance_mm
from kiks.engine.physics.gripper import move_gripper
from kiks.engine.physics.motion import draw_slip, moment_of, move, note_contact, remember_pose
from kiks.engine.physics.motor import control_motors, latch_encoders, turn_motors
from kiks.engine.scene import open_scene
from kiks.engine.sensing.disc_rays import meet_discs, other_tracks, see_all
from kiks.engine.sensing.proximity import (
    STREAM_PROXIMITY,
    chances,
    jitter_of,
    on_body,
    quantize,
    sampled_pose,
    scatter,
    turned,
)
from kiks.engine.sensing.ray_packets import PACKET_SIZE, enter, met, step_all
from kiks.engine.sensing.responses import REFLECTION, respond
from kiks.engine.simd.lanes import LANES, load, store
from kiks.engine.simd.stack_arrays import stack_floats, stack_integers, stack_narrow
from kiks.engine.step import advance_bunch


@entry
def advance_alone(record, world, number, tick, tick_count):
    """Let time pass for a robot that meets nothing but walls."""
    scene = open_scene(record[0])
    robot = scene.robots[world, number]
    parameters = scene.kinds[robot.kind]
    for now in range(tick, tick + tick_count):
        remember_pose(robot)
        latch_encoders(robot)
        control_motors(robot, parameters)
        left, right = turn_motors(robot, parameters, 0), turn_motors(robot, parameters, 1)
        if robot.has_gripper != 0:
            move_gripper(robot, 0.0)
        slip_ratio = draw_slip(parameters, scene.seeds[world], number, now)
        room_mm = clearance_mm(scene.ground, robot.x_mm, robot.y_mm)
        note_contact(robot, move(scene.ground, robot, parameters, left, right, room_mm, slip_ratio))


@entry
def advance_each(record, ticks, until):
    """Let time pass in bunches of eight worlds, in each from a tick of its own to another."""
    scene = open_scene(record[0])
    for first in range(0, ticks.shape[0], LANES):
        worlds, end = np.arange(first, min(first + LANES, ticks.shape[0])), first + LANES
        advance_eight(scene, worlds, ticks[first:end], until[first:end], make_lanes(LANES), make_room(scene, LANES))


@kernel
def advance_eight(scene, worlds, ticks, until, lanes, room):
    """Let time pass in eight worlds."""
    bunch = take(scene, worlds, ticks, lanes, room)
    advance_bunch(scene, bunch, until)
    give_back(scene, bunch)


@entry
def read_one_by_one(record, world, robot, tick, time_ns, out):
    """Read the proximity sensors one by one: all rays to their ends, and each ray past each disc of the world."""
    scene = open_scene(record[0])
    walls, state = scene.walls, scene.robots[world, robot]
    parameters = scene.kinds[state.kind]
    per_cell = 1.0 / walls.cell_mm
    tracks, disc_count, seen = other_tracks(scene, world, robot)
    packet, origin, under_way = stack_narrow(PACKET_SIZE), stack_integers(1), stack_integers(1)
    lengths, cosines, shades = stack_floats(LANES), stack_floats(LANES), stack_floats(LANES)
    rays_x, rays_y = stack_floats(LANES), stack_floats(LANES)
    for sensor in range(out.shape[0]):
        slot = parameters.slot_ns[sensor], parameters.round_ns
        turn, instant_ns, x, y, heading = sampled_pose(state, tick, 1.0 * time_ns, *slot, True)
        sine, cosine = sin_cos(heading)
        x, y = on_body(x, y, sine, cosine, parameters.ray_x_mm[sensor], parameters.ray_y_mm[sensor])
        column, row = x * per_cell + walls.pad, y * per_cell + walls.pad
        along, across = turned(parameters.ray_cos[sensor], parameters.ray_sin[sensor], sine, cosine)
        enter(walls, packet, origin, 0, column, row, along, across, parameters.reach_mm * per_cell)
        step_all(walls, packet, origin, under_way, 1)
        to_wall, squarely, brightness = met(walls, parameters.response == REFLECTION, packet, origin, 0)
        store(lengths, to_wall)
        store(cosines, squarely)
        store(shades, brightness)
        store(rays_x, along)
        store(rays_y, across)
        see_all(walls, tracks, disc_count, moment_of(tick, instant_ns), seen)
        for ray in range(LANES):
            ray_hit = column, row, rays_x[ray], rays_y[ray], lengths[ray], 1.0, 0.0
            length, at, shade = meet_discs(seen, disc_count, *ray_hit)
            if shade > 0.0:
                lengths[ray], cosines[ray], shades[ray] = length, at, shade
        sight = load(lengths) * walls.cell_mm, load(cosines), load(shades)
        count = parameters.baseline_counts[sensor] + respond(scene.networks, parameters, sensor, *sight)
        sign, size, chance = chances(stream_of(scene.seeds[world], 0, robot, STREAM_PROXIMITY), turn, sensor)
        noisy = scatter(parameters, count, sign, size) + jitter_of(parameters, chance)
        out[sensor] = quantize(parameters, noisy, parameters.maximum_counts)
