"""The control loop of a batch, for a bunch of worlds at once: sense, decide, act, measure, wait.

The instants of a loop are those of a program on serial lines (`kiks.batch.loop_timing`). At each instant
the batch does what a `kiks.Simulation` does: first the ticks that have begun, then the reading or the command.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.batch.callbacks import call_decider, call_measure
from kiks.batch.loop_timing import ASK_LENGTH, acts_at, answer_length, order_length
from kiks.batch.stepper_dispatch import command, give_back, pass_to, read, show, take
from kiks.control.controller import whole_speed
from kiks.control.measure import Moment
from kiks.engine.compiling import entry, kernel, spliced
from kiks.engine.simd.f64x8 import LANES
from kiks.engine.simd.stack_arrays import borrowed, stack_booleans, stack_floats, stack_integers
from kiks.model.robot import SENSOR_COUNT
from kiks.units import NS_PER_S

STATE_SIZE = 8
"""Numbers of a `Moment` that `show` writes: the poses and contacts of a robot."""

_READINGS = LANES * SENSOR_COUNT  # the size of a stack array must be a constant


@spliced
def sense(place: Any, worlds: Any, bunch: Any, numbers: Any, is_on: Any, times_ns: Any, counts: Any) -> Any:
    """Read all senses of all robots, and note when the last reply has arrived.

    Args:
        place: What the worlds of the block share.
        worlds: All worlds.
        bunch: The worlds that are stepped at once.
        numbers: Their indices, int64 [W].
        is_on: Their mask, bool [W].
        times_ns: Buffer for the time of each world [ns], int64 [W].
        counts: Buffer for a reading of each world, int64 [W, 8].
    """
    robot_count = worlds.sensors.shape[1]
    for k in range(numbers.shape[0]):
        times_ns[k] = worlds.begins_ns[numbers[k]]
        if is_on[k]:
            worlds.sensed_ns[numbers[k]] = times_ns[k]
    for number in range(place.sense_codes.shape[0]):
        for k in range(numbers.shape[0]):
            if is_on[k]:
                times_ns[k] = acts_at(place.line, worlds.sensed_ns[numbers[k]], ASK_LENGTH)
        pass_to(place, worlds, bunch, times_ns)
        first = number * SENSOR_COUNT
        for robot in range(robot_count):
            read(place, worlds, bunch, place.sense_codes[number], times_ns, robot, counts)
            for k in range(numbers.shape[0]):
                if is_on[k]:
                    world = numbers[k]
                    for sensor in range(SENSOR_COUNT):
                        worlds.sensors[world, robot, first + sensor] = counts[k, sensor]
                    heard_ns = times_ns[k] + answer_length(counts[k]) * place.line.character_ns
                    worlds.sensed_ns[world] = max(worlds.sensed_ns[world], heard_ns)


@spliced
def act(place: Any, worlds: Any, bunch: Any, numbers: Any, is_on: Any, times_ns: Any) -> Any:
    """Set the speeds of all robots, and note when the next loop begins; arguments as for `sense`.

    A shorter command acts sooner, so the commands of a world act in the order of their lengths. At the end, `times_ns`
    holds the time at which the last command of each world acted.
    """
    line, wheels = place.line, worlds.wheels
    for k in range(numbers.shape[0]):
        times_ns[k] = worlds.begins_ns[numbers[k]]
        if is_on[k]:
            for robot in range(wheels.shape[1]):
                for wheel in range(2):
                    wheels[numbers[k], robot, wheel] = whole_speed(wheels[numbers[k], robot, wheel])
    for turn in range(wheels.shape[1]):
        for k in range(numbers.shape[0]):
            if is_on[k]:
                length = command_length(wheels, numbers[k], robot_at_turn(wheels, numbers[k], turn))
                times_ns[k] = acts_at(line, worlds.sensed_ns[numbers[k]], length)
        pass_to(place, worlds, bunch, times_ns)
        for k in range(numbers.shape[0]):
            if is_on[k]:
                robot = robot_at_turn(wheels, numbers[k], turn)
                left, right = wheels[numbers[k], robot, 0], wheels[numbers[k], robot, 1]
                command(place, bunch, k, robot, np.int64(left), np.int64(right))
    for k in range(numbers.shape[0]):
        if is_on[k]:
            world = numbers[k]
            done_ns = times_ns[k] + line.done_length * line.character_ns
            worlds.begins_ns[world] = max(done_ns, worlds.begins_ns[world] + line.period_ns)
            worlds.steps[world] += 1


@spliced
def finish_bunch(place: Any, worlds: Any, bunch: Any, numbers: Any, times_ns: Any) -> Any:
    """Do the ticks before the next loop, and write the bunch back; arguments as for `sense`."""
    for k in range(numbers.shape[0]):
        times_ns[k] = worlds.begins_ns[numbers[k]]
    pass_to(place, worlds, bunch, times_ns)
    give_back(place, worlds, bunch)


@kernel
def command_length(wheels: Any, world: Any, robot: Any) -> Any:
    """Return the number of characters of the command that sets the speeds of a robot."""
    return order_length(np.int64(wheels[world, robot, 0]), np.int64(wheels[world, robot, 1]))


@kernel
def robot_at_turn(wheels: Any, world: Any, turn: Any) -> Any:
    """Return the index of the robot with the `turn`-th shortest command; ties by index."""
    robot_count = wheels.shape[1]
    if robot_count > 1:
        for robot in range(robot_count):
            length, before = command_length(wheels, world, robot), 0
            for other in range(robot_count):
                other_length = command_length(wheels, world, other)
                before += other_length < length or (other_length == length and other < robot)
            if before == turn:
                return robot
    return 0


@spliced
def fill_bunch(block: Any, first: Any, numbers: Any, is_on: Any) -> Any:
    """Choose the worlds of the next bunch; the last world pads an incomplete bunch, and the mask hides the padding."""
    for k in range(numbers.shape[0]):
        numbers[k] = block[min(first + k, block.shape[0] - 1)]
        is_on[k] = first + k < block.shape[0]


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
    place: Any, worlds: Any, bunch: Any, numbers: Any, is_on: Any, times_ns: Any, state: Any, watchers: Any
) -> Any:
    """Call the measures for the robots of a bunch.

    Args:
        place: What the worlds of the block share.
        worlds: All worlds.
        bunch: The worlds that are stepped at once.
        numbers: Their indices, int64 [W].
        is_on: Their mask, bool [W].
        times_ns: When the last command of each world acted [ns], int64 [W].
        state: Buffer for the output of `show`, float64 [`STATE_SIZE`].
        watchers: The measures (`kiks.batch.callbacks.watchers_of`).
    """
    for k in range(numbers.shape[0]):
        if is_on[k]:
            world = numbers[k]
            period_s = (times_ns[k] - worlds.watched_ns[world]) / NS_PER_S
            worlds.watched_ns[world] = times_ns[k]
            for robot in range(worlds.sensors.shape[1] if watchers.shape[0] > 0 else 0):
                show(place, worlds, bunch, k, robot, state)
                moment = Moment(
                    times_ns[k] / NS_PER_S,
                    period_s,
                    worlds.sensors[world, robot],
                    worlds.wheels[world, robot],
                    state[0],
                    state[1],
                    state[2],
                    state[3],
                    state[4],
                    state[5],
                    state[6],
                    state[7] > 0.0,
                    worlds.scene[1][world],
                    worlds.lamps[world],
                )
                for number in range(watchers.shape[0]):
                    notes = worlds.notes[world, robot, watchers[number, 1] : watchers[number, 2]]
                    call_measure(watchers[number, 0], (moment, notes))


@entry
def roll_out(
    place: Any, worlds: Any, size: Any, block: Any, halves: Any, until_ns: Any, decider: Any, watchers: Any
) -> Any:
    """Do control loops, or halves of them, in the worlds of a block.

    Args:
        place: What the worlds of the block share.
        worlds: All worlds.
        size: Number of worlds in a bunch.
        block: Indices of the worlds, int64 [world].
        halves: Number of the first half to do, and of the first one not to do: even halves sense, odd halves act.
        until_ns: Time at and after which no loop begins [ns].
        decider: Address of the kernel that calls a controller for each world of a bunch (`kiks.batch.callbacks`); 0 if
            `worlds.wheels` holds the speeds already.
        watchers: The measures (`kiks.batch.callbacks.watchers_of`).
    """
    place, worlds, watchers = borrowed(place), borrowed(worlds), borrowed(watchers)
    numbers, times_ns = stack_integers(LANES)[:size], stack_integers(LANES)[:size]
    is_on, state = stack_booleans(LANES)[:size], stack_floats(STATE_SIZE)
    counts = stack_integers(_READINGS).reshape((LANES, SENSOR_COUNT))[:size]
    for first in range(0, block.shape[0], size):
        fill_bunch(block, first, numbers, is_on)
        bunch = take(place, worlds, numbers)
        for half in range(halves[0], halves[1]):
            if half % 2 == 0:
                if not mask_ended(worlds, numbers, is_on, until_ns):
                    break
                sense(place, worlds, bunch, numbers, is_on, times_ns, counts)
                if decider != 0:
                    given = worlds.sensors, worlds.memory, worlds.parameters, worlds.wheels
                    call_decider(decider, (numbers, is_on, *given))
            else:
                act(place, worlds, bunch, numbers, is_on, times_ns)
                call_measures(place, worlds, bunch, numbers, is_on, times_ns, state, watchers)
        finish_bunch(place, worlds, bunch, numbers, times_ns)
