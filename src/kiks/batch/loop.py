"""The control loop of a batch, for a bunch of worlds at once: sense, decide, act, measure, wait.

The instants of a loop are those of a program on serial lines (`kiks.batch.loop_timing`). At each instant
the batch does what a `kiks.Simulation` does: first the ticks that have begun, then the reading or the command.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.batch.callbacks import call_decider, call_measure
from kiks.batch.loop_timing import LENGTHS, acts_at, answer_length, digits_of, order_length, short_answer_length
from kiks.control.actuators import call_actuator, whole_value
from kiks.control.controller import whole_speed
from kiks.control.measure import moment_of
from kiks.control.senses import IN_PACKETS, call_sense
from kiks.control.turret_parts import view_of
from kiks.engine.bunch import give_back, make_lanes, make_room, robot_in, show_robot, show_tracks, take, take_robot
from kiks.engine.compiling import entry, inlined, kernel, spliced
from kiks.engine.physics.motor import command_speed
from kiks.engine.scene import open_scene
from kiks.engine.sensing.camera import take_image_in
from kiks.engine.sensing.proximity import READERS, make_readers, sense_proximity
from kiks.engine.simd.lanes import LANES
from kiks.engine.simd.stack_arrays import stack_booleans, stack_floats, stack_integers
from kiks.engine.state import PIXEL_COUNT
from kiks.engine.step import advance_bunch
from kiks.firmware.k213 import PERIODS_NS
from kiks.model.robot import SENSOR_COUNT
from kiks.units import NS_PER_S, TICK_NS

_READINGS = READERS * SENSOR_COUNT  # the size of a stack array must be a constant
_PICTURE_NS = PERIODS_NS[0]  # cameras have the reading period of the power-on


@spliced
def sense(scene: Any, worlds: Any, bunch: Any, is_on: Any, times_ns: Any, readers: Any, counts: Any) -> Any:
    """Read the senses of all robots, and note when the last reply has arrived.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        worlds: What the loop knows of all worlds (`kiks.batch.kernel_args.Worlds`).
        bunch: The worlds that are stepped together (`kiks.engine.bunch`).
        is_on: Their mask, bool [W].
        times_ns: Buffer for the time of each world [ns], int64 [W].
        readers: Buffer for the robots that are read together (`kiks.engine.sensing.proximity.Readers`).
        counts: Buffer for their readings, float64 [`READERS`, 8].
    """
    line, numbers = worlds.line, bunch.worlds
    for k in range(numbers.shape[0]):
        times_ns[k] = worlds.begins_ns[numbers[k]]
        if is_on[k]:
            worlds.sensed_ns[numbers[k]] = times_ns[k]
    first = 0
    for place in range(worlds.senses.shape[0]):
        address, size, ask_length = worlds.senses[place, 0], worlds.senses[place, 1], worlds.senses[place, 2]
        needs_all = worlds.senses[place, 6] != 0
        for k in range(numbers.shape[0]):
            if is_on[k]:
                times_ns[k] = acts_at(line, worlds.sensed_ns[numbers[k]], ask_length)
        # Without a line, all senses are read at one instant, and see the same tracks.
        has_moved = pass_to(scene, worlds, bunch, times_ns)
        if place == 0 or has_moved:
            show_tracks(scene, bunch)
        count = 0
        for k in range(numbers.shape[0]):
            for robot in range(worlds.sensors.shape[1] if is_on[k] else 0):
                if place >= worlds.sense_counts[robot]:
                    continue
                if address != IN_PACKETS:
                    if needs_all:
                        show_robot(scene, bunch, k, robot)
                    ticks, time_ns = bunch.ticks[k], times_ns[k]
                    read_sense(scene, worlds, place, numbers[k], robot, ticks, time_ns, first)
                    continue
                readers.worlds[count], readers.robots[count] = numbers[k], robot
                readers.ticks[count], readers.times_ns[count] = bunch.ticks[k], times_ns[k]
                count += 1
                if count == READERS:
                    read_proximity(scene, worlds, place, first, readers, count, counts)
                    count = 0
        read_proximity(scene, worlds, place, first, readers, count, counts)
        first += size


@inlined
def read_proximity(scene: Any, worlds: Any, place: Any, first: Any, readers: Any, count: Any, counts: Any) -> Any:
    """Read the proximity sensors of some robots, and note when their replies have arrived.

    Args:
        scene: The scene.
        worlds: What the loop knows of all worlds.
        place: Place of this sense among all.
        first: Place of its first reading among the sensors of a robot.
        readers: Which robots, and when (`kiks.engine.sensing.proximity.Readers`).
        count: Their number.
        counts: Buffer for readings, float64 [`READERS`, 8].
    """
    if count > 0:
        sense_proximity(scene, readers, count, True, counts)
    for k in range(count):
        readings = worlds.sensors[readers.worlds[k], readers.robots[k], first : first + SENSOR_COUNT]
        for sensor in range(SENSOR_COUNT):
            readings[sensor] = counts[k, worlds.sensor_orders[place, sensor]] * worlds.scales[place]
        length = short_answer_length(worlds.senses[place, 3], counts[k])
        note_reply(worlds, readers.worlds[k], readers.times_ns[k], length)


@kernel
def read_sense(
    scene: Any, worlds: Any, place: Any, world: Any, robot: Any, tick_count: Any, time_ns: Any, first: Any
) -> Any:
    """Read another sense of a robot at a time; arguments as for `read_proximity`."""
    row = worlds.senses[place]
    readings = worlds.sensors[world, robot, first : first + row[1]]
    call_sense(row[0], (view_of(scene, world, robot, tick_count, time_ns, True, row[4], row[5]), readings))
    note_reply(worlds, world, time_ns, answer_length(row[3], readings))
    convert(readings, worlds.scales[place], worlds.sensor_orders[place])


@kernel
def convert(readings: Any, scale: Any, order: Any) -> Any:
    """Make readings of a robot what controllers see."""
    for k in range(readings.shape[0]):
        readings[k] *= scale
    # Only sensors around the robot have another order; there are as many on each kind.
    if readings.shape[0] == SENSOR_COUNT:
        replied = stack_floats(SENSOR_COUNT)
        for k in range(SENSOR_COUNT):
            replied[k] = readings[k]
        for k in range(SENSOR_COUNT):
            readings[k] = replied[order[k]]


@inlined
def note_reply(worlds: Any, world: Any, time_ns: Any, length: Any) -> Any:
    """Note when the reply has arrived to a command that acted at a time, of so many characters."""
    heard_ns = time_ns + length * worlds.line.character_ns
    worlds.sensed_ns[world] = max(worlds.sensed_ns[world], heard_ns)


@kernel
def take_pictures(scene: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    """Let the cameras of a bunch take the last pictures that are due before the time of each world.

    It does what `kiks.sim.cameras.Cameras.sync` does for one world.
    """
    instants_ns, greys = stack_integers(LANES)[: times_ns.shape[0]], stack_floats(PIXEL_COUNT)
    for robot in range(worlds.has_camera.shape[0]):
        if worlds.has_camera[robot]:
            for k in range(times_ns.shape[0]):
                instants_ns[k] = times_ns[k] - times_ns[k] % _PICTURE_NS
                if instants_ns[k] <= scene.robots[bunch.worlds[k], robot].camera_taken_ns:
                    instants_ns[k] = bunch.ticks[k] * TICK_NS
            tick_to(scene, bunch, instants_ns)
            show_tracks(scene, bunch)
            for k in range(times_ns.shape[0]):
                state, instant_ns = scene.robots[bunch.worlds[k], robot], times_ns[k] - times_ns[k] % _PICTURE_NS
                if instant_ns > state.camera_taken_ns:
                    is_noisy = scene.kinds[state.kind].is_noisy != 0
                    given = bunch.worlds[k], robot, bunch.ticks[k], instant_ns, is_noisy
                    state.camera_light = take_image_in(scene, *given, greys)
                    state.camera_taken_ns = instant_ns
                    for p in range(PIXEL_COUNT):
                        state.camera_pixels[p] = np.uint8(min(max(0.0, np.rint(greys[p])), 255.0))


@kernel
def pass_to(scene: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    """Let time pass in each world of a bunch: do the ticks that have begun, and take the pictures that are due.

    Returns:
        Whether ticks were done after the last picture.
    """
    if worlds.has_camera.any():
        take_pictures(scene, worlds, bunch, times_ns)
    has_moved = tick_to(scene, bunch, times_ns)
    if worlds.switch_ticks.shape[1] > 0:
        switch_lamps(scene, worlds, bunch)
    return has_moved


@kernel
def switch_lamps(scene: Any, worlds: Any, bunch: Any) -> Any:
    """Switch the lamps that are due after the ticks of each world of a bunch, as `kiks.sim.world.World` does."""
    for k in range(bunch.worlds.shape[0]):
        world = bunch.worlds[k]
        number = worlds.switched[world]
        while number < worlds.switch_ticks.shape[1] and worlds.switch_ticks[world, number] <= bunch.ticks[k]:
            code = worlds.switch_codes[world, number]
            scene.lamps[world, code // 2, 3] = code % 2
            number += 1
        worlds.switched[world] = number


@kernel
def tick_to(scene: Any, bunch: Any, times_ns: Any) -> Any:
    """Do the ticks that have begun before the time of each world of a bunch; return whether there were any."""
    until = stack_integers(LANES)[: times_ns.shape[0]]
    is_any = False
    for k in range(times_ns.shape[0]):
        until[k] = -(-times_ns[k] // TICK_NS)
        is_any = is_any or until[k] > bunch.ticks[k]
    if is_any:
        advance_bunch(scene, bunch, until)
    return is_any


@spliced
def act(scene: Any, worlds: Any, bunch: Any, is_on: Any, times_ns: Any) -> Any:
    """Set the speeds and other outputs of all robots, and note when the next loop begins; arguments as for `sense`.

    A shorter command acts sooner, so the commands of a world act in the order of their lengths. At the end, `times_ns`
    holds the time at which the last command of each world acted.
    """
    line, wheels, numbers = worlds.line, worlds.wheels, bunch.worlds
    for k in range(numbers.shape[0]):
        times_ns[k] = worlds.begins_ns[numbers[k]]
        if is_on[k]:
            for robot in range(wheels.shape[1]):
                for wheel in range(2):
                    wanted = wheels[numbers[k], robot, wheel]
                    wheels[numbers[k], robot, wheel] = whole_speed(wanted, line.speed_scale, line.speed_max)
            sort_commands(line, wheels, numbers[k], worlds.turns)
    for turn in range(wheels.shape[1]):
        is_later = turn == 0
        for k in range(numbers.shape[0]):
            if is_on[k]:
                length = command_length(line, wheels, numbers[k], worlds.turns[numbers[k], turn])
                acts_ns = acts_at(line, worlds.sensed_ns[numbers[k]], length)
                is_later = is_later or acts_ns > times_ns[k]
                times_ns[k] = acts_ns
        # Most of a thousand commands are as long as the one before.
        if is_later:
            pass_to(scene, worlds, bunch, times_ns)
        for k in range(numbers.shape[0]):
            if is_on[k]:
                robot = worlds.turns[numbers[k], turn]
                left, right = wheels[numbers[k], robot, 0], wheels[numbers[k], robot, 1]
                command_speed(robot_in(scene, bunch, k, robot)[0], np.int64(left), np.int64(right))
    for k in range(numbers.shape[0]):
        if is_on[k]:
            worlds.sensed_ns[numbers[k]] = times_ns[k] + line.done_length * line.character_ns
            # From here on as controllers and measures have them.
            for robot in range(wheels.shape[1] if line.speed_scale != 1.0 else 0):
                for wheel in range(2):
                    wheels[numbers[k], robot, wheel] /= line.speed_scale
    if worlds.orders.shape[0] > 0:
        send_orders(scene, worlds, bunch, is_on, times_ns)
    for k in range(numbers.shape[0]):
        if is_on[k]:
            world = numbers[k]
            worlds.begins_ns[world] = max(worlds.sensed_ns[world], worlds.begins_ns[world] + line.period_ns)
            worlds.steps[world] += 1


@kernel
def send_orders(scene: Any, worlds: Any, bunch: Any, is_on: Any, times_ns: Any) -> Any:
    """Send what has changed of the outputs after those of the wheels, one after the other; arguments as for `act`.

    The program sends one order to all its robots, then waits for all replies. Of several robots in a world, the one
    with the shortest command acts first.
    """
    numbers = bunch.worlds
    for place in range(worlds.orders.shape[0]):
        head = worlds.orders[place, 1]
        shortest, longest = head + 99, head
        for k in range(numbers.shape[0]):
            for robot in range(worlds.wheels.shape[1] if is_on[k] else 0):
                if is_changed(worlds, place, numbers[k], robot):
                    length = head + digits_of(worlds.wheels[numbers[k], robot, 2 + place])
                    shortest, longest = min(shortest, length), max(longest, length)
        for length in range(shortest, longest + 1):
            for k in range(numbers.shape[0]):
                for robot in range(worlds.wheels.shape[1] if is_on[k] else 0):
                    value = worlds.wheels[numbers[k], robot, 2 + place]
                    if is_changed(worlds, place, numbers[k], robot) and head + digits_of(value) == length:
                        times_ns[k] = acts_at(worlds.line, worlds.sensed_ns[numbers[k]], length)
            pass_to(scene, worlds, bunch, times_ns)
            show_tracks(scene, bunch)
            for k in range(numbers.shape[0]):
                for robot in range(worlds.wheels.shape[1] if is_on[k] else 0):
                    value = worlds.wheels[numbers[k], robot, 2 + place]
                    if is_changed(worlds, place, numbers[k], robot) and head + digits_of(value) == length:
                        carry_out(scene, worlds, bunch, k, robot, place, times_ns[k])
        for k in range(numbers.shape[0]):
            if is_on[k]:
                world = numbers[k]
                for robot in range(worlds.wheels.shape[1]):
                    if is_changed(worlds, place, world, robot):
                        worlds.sent[world, robot, place] = worlds.wheels[world, robot, 2 + place]
                        heard_ns = times_ns[k] + worlds.orders[place, 2] * worlds.line.character_ns
                        worlds.sensed_ns[world] = max(worlds.sensed_ns[world], heard_ns)


@kernel
def is_changed(worlds: Any, place: Any, world: Any, robot: Any) -> Any:
    """Return whether an output of a robot must be sent; it is rounded to what is sent."""
    if place >= worlds.order_counts[robot]:
        return False
    row, sent = worlds.orders[place], worlds.sent[world, robot, place]
    value = whole_value(worlds.wheels[world, robot, 2 + place], 1.0 * row[3], 1.0 * row[4], sent)
    worlds.wheels[world, robot, 2 + place] = value
    return not math.isnan(value) and value != sent


@kernel
def carry_out(scene: Any, worlds: Any, bunch: Any, k: Any, robot: Any, place: Any, time_ns: Any) -> Any:
    """Let an actuator of a robot in a world of the bunch act."""
    world, row = bunch.worlds[k], worlds.orders[place]
    show_robot(scene, bunch, k, robot)
    view = view_of(scene, world, robot, bunch.ticks[k], time_ns, True, row[5], row[6])
    call_actuator(row[0], (view, worlds.wheels[world, robot, 2 + place]))
    take_robot(scene, bunch, k, robot)


@kernel
def command_length(line: Any, wheels: Any, world: Any, robot: Any) -> Any:
    """Return the number of characters of the command that sets the speeds of a robot."""
    return order_length(line, np.int64(wheels[world, robot, 0]), np.int64(wheels[world, robot, 1]))


@kernel
def sort_commands(line: Any, wheels: Any, world: Any, turns: Any) -> Any:
    """Write a world's robots into its row of `turns` in the order of their commands' lengths; ties by index.

    A counting sort: commands have few lengths, and worlds may have a thousand robots.
    """
    ends = stack_integers(LENGTHS)
    ends[:] = 0
    for robot in range(wheels.shape[1]):
        ends[command_length(line, wheels, world, robot)] += 1
    for length in range(1, LENGTHS):
        ends[length] += ends[length - 1]
    for robot in range(wheels.shape[1] - 1, -1, -1):
        length = command_length(line, wheels, world, robot)
        ends[length] -= 1
        turns[world, ends[length]] = robot


@spliced
def mask_ended(worlds: Any, numbers: Any, is_on: Any, until_ns: Any) -> Any:
    """Mask the worlds of a bunch whose next loop begins at or after a time [ns]; return whether any is left."""
    left = 0
    for k in range(numbers.shape[0]):
        is_on[k] = is_on[k] and worlds.begins_ns[numbers[k]] < until_ns
        left += is_on[k]
    return left > 0


@spliced
def call_measures(
    scene: Any, worlds: Any, bunch: Any, is_on: Any, times_ns: Any, watchers: Any, until_note: Any, poses: Any
) -> Any:
    """Call the measures for the robots of a bunch, and mask the worlds whose trial has ended.

    Args:
        scene: The scene.
        worlds: What the loop knows of all worlds.
        bunch: The worlds that are stepped together.
        is_on: Their mask, bool [W].
        times_ns: When the last command of each world acted [ns], int64 [W].
        watchers: The measures (`kiks.batch.measure_slots.MeasureSlots.watchers`).
        until_note: The trial of a world has ended when this note of one of its robots is above 0; -1 if none ends it.
        poses: Buffer for the poses of a world's robots, float64 [robot, 3].
    """
    for k in range(bunch.worlds.shape[0]):
        if is_on[k]:
            world = bunch.worlds[k]
            times_s = times_ns[k] / NS_PER_S, (times_ns[k] - worlds.watched_ns[world]) / NS_PER_S
            worlds.watched_ns[world] = times_ns[k]
            robot_count = poses.shape[0] if watchers.shape[0] > 0 else 0
            for robot in range(robot_count):
                one = robot_in(scene, bunch, k, robot)[0]
                poses[robot, 0], poses[robot, 1], poses[robot, 2] = one.x_mm, one.y_mm, one.heading_rad
            for robot in range(robot_count):
                one, record = robot_in(scene, bunch, k, robot)
                seen = worlds.sensors[world, robot], worlds.wheels[world, robot]
                around = scene.bodies[world], scene.lamps[world], robot, poses
                moment = moment_of(times_s, *seen, one, record, *around)
                for number in range(watchers.shape[0]):
                    notes = worlds.notes[world, robot, watchers[number, 1] : watchers[number, 2]]
                    call_measure(watchers[number, 0], (moment, notes))
                if until_note >= 0 and worlds.notes[world, robot, until_note] > 0.0:
                    is_on[k] = False


@entry
def roll_out(scene: Any, worlds: Any, size: Any, block: Any, span: Any, callbacks: Any) -> Any:
    """Do control loops, or halves of them, in the worlds of a block.

    Args:
        scene: The scene of the block (`kiks.engine.scene.Scene.record`).
        worlds: What the loop knows of all worlds (`kiks.batch.kernel_args.Worlds`).
        size: Number of worlds in a bunch.
        block: Indices of the worlds, int64 [world].
        span: Number of the first half of a loop to do, and of the first one not to do: even halves sense, odd halves
            act; time at and after which no loop begins [ns].
        callbacks: The controllers (`kiks.batch.callbacks.deciders_of`), none if `worlds.wheels` holds the speeds
            already; the measures (`kiks.batch.measure_slots.MeasureSlots.watchers`); and the note that ends a trial
            (`call_measures`).
    """
    scene = open_scene(scene[0])
    robot_count = scene.robots.shape[1]
    lanes, room, poses = make_lanes(size * robot_count), make_room(scene, size), np.zeros((robot_count, 3))
    roll_out_block(scene, worlds, size, block, span, callbacks, lanes, room, poses)


@kernel
def roll_out_block(
    scene: Any, worlds: Any, size: Any, block: Any, span: Any, callbacks: Any, lanes: Any, room: Any, poses: Any
) -> Any:
    """Do what `roll_out` does, in an open scene, with memory as for `kiks.engine.bunch.take` and `call_measures`."""
    first_half, end_half, until_ns = span
    deciders, watchers, until_note = callbacks
    all_numbers, all_times_ns, all_on = stack_integers(LANES), stack_integers(LANES), stack_booleans(LANES)
    ticks = stack_integers(LANES)
    readers, counts = make_readers(), stack_floats(_READINGS).reshape((READERS, SENSOR_COUNT))
    for first in range(0, block.shape[0], size):
        count = min(size, block.shape[0] - first)
        numbers, times_ns, is_on = all_numbers[:count], all_times_ns[:count], all_on[:count]
        for k in range(count):
            numbers[k], is_on[k] = block[first + k], True
            ticks[k] = worlds.ticks[numbers[k]]
        bunch = take(scene, numbers, ticks[:count], lanes, room)
        for half in range(first_half, end_half):
            if half % 2 == 0:
                if not mask_ended(worlds, numbers, is_on, until_ns):
                    break
                sense(scene, worlds, bunch, is_on, times_ns, readers, counts)
                for number in range(deciders.shape[0]):
                    given = worlds.sensors, worlds.memory, worlds.parameters, worlds.wheels
                    call_decider(deciders[number, 0], (deciders[number], numbers, is_on, *given))
            else:
                act(scene, worlds, bunch, is_on, times_ns)
                call_measures(scene, worlds, bunch, is_on, times_ns, watchers, until_note, poses)
        for k in range(count):
            times_ns[k] = worlds.begins_ns[numbers[k]]
        pass_to(scene, worlds, bunch, times_ns)
        give_back(scene, bunch)
        for k in range(count):
            worlds.ticks[numbers[k]] = ticks[k]
