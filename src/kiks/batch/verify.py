"""Does a batch equal the line? Its worlds once more as simulations, which one program drives over the serial lines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, product
from typing import Any

import numpy as np

from kiks.batch.batch import Batch
from kiks.client.drive import ControllerDriver
from kiks.control.controller import Controller
from kiks.control.robot_controllers import RobotControllers
from kiks.control.senses import sense_of
from kiks.errors import ParameterError
from kiks.model.arena import Pose
from kiks.model.checks import check_count
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S, ns_from_s

Compared = tuple[int | None, str, Any, Any]
"""The number of a robot, or None; what is compared; of the batch and on the line."""


@dataclass(frozen=True)
class Difference:
    """The first difference between a world of a batch and the same world on the line.

    Attributes:
        world: Index of the world.
        loop: Number of the control loop at whose end they differ, from 1.
        tick: Ticks done by then.
        robot: Number of the robot, from 1; None if it is something else that differs.
        quantity: A reading (`proximity 3`), an output, the time, or a field of the state (`kiks.engine.state`).
        batch: Its value in the batch.
        line: Its value on the line.

    Example:
        >>> print(Difference(world=3, loop=12, tick=120, robot=2, quantity="x_mm", batch=103.25, line=103.5))
        world 3, loop 12, tick 120, robot 2: x_mm is 103.25 in the batch, 103.5 on the line
    """

    world: int
    loop: int
    tick: int
    robot: int | None
    quantity: str
    batch: Any
    line: Any

    def __str__(self) -> str:
        where = f"world {self.world}, loop {self.loop}, tick {self.tick}"
        where += "" if self.robot is None else f", robot {self.robot}"
        return f"{where}: {self.quantity} is {self.batch} in the batch, {self.line} on the line"


def verify(
    batch: Batch,
    controller: Controller | Sequence[Controller],
    parameters: Any = (),
    *,
    seconds: float,
    worlds: Iterable[int] | None = None,
) -> list[Difference]:
    """Return where worlds of a batch first differ from the same worlds on the line; an empty list if they are equal.

    The batch runs its loops one by one. For each world there is a `kiks.Simulation` with its arena, kinds of robots,
    turrets, starts, lamps and seed, whose robots `kiks.drive` drives with the batch's timing. After each loop all
    readings, outputs, times and states are compared to the bit, and at the end the states that `Batch.run` leaves. The
    simulations take a thousand times as long as the batch.

    Args:
        batch: The batch; it ends as `run` leaves it.
        controller: As for `Batch.run`.
        parameters: As for `Batch.run`.
        seconds: As for `Batch.run` [s].
        worlds: Indices of the worlds to compare; all if left out.

    Raises:
        ParameterError: If the batch has no line (`baud=None`).

    Example:
        >>> import kiks
        >>> batch = kiks.Batch(kiks.Arena.box(500, 500), 8, robots=2, seed=1, timing=kiks.Timing(think_s=0.005))
        >>> kiks.verify(batch, kiks.controllers.linear(), [0.5] * 18, seconds=2, worlds=[0, 7])
        []
    """
    if (baud := batch.timing.baud) is None:
        raise ParameterError(
            "timing must have a baud rate, but it was None: without a line there is nothing to compare with. "
            "Make the batch with timing=kiks.Timing(baud=9600)."
        )
    last = batch.world_count - 1
    chosen = [check_count("world", each, 0, last) for each in (range(last + 1) if worlds is None else worlds)]
    loops = batch.loops(controller, parameters, seconds=seconds)
    driving = RobotControllers(controller, parameters, batch.world_count, batch.robot_count)
    lines = {world: _WorldOnLine(batch, world, driving, baud) for world in chosen}
    until_ns, found = ns_from_s(seconds), dict[int, Difference]()
    for loop, (sensors, wheels) in enumerate(loops, 1):
        for world, line in lines.items():
            if world not in found and line.driver.begin_ns < until_ns:
                line.driver.step()
                line.sim.sync()
                compared = chain(line.exchanged(sensors[world], wheels[world]), line.states())
                if difference := line.difference(loop, compared):
                    found[world] = difference
    batch.run(controller, parameters, seconds=seconds)
    for world, line in lines.items():
        if world not in found and (difference := line.difference(line.driver.loop_count, line.states())):
            found[world] = difference
    return [found[world] for world in chosen if world in found]


class _WorldOnLine:
    """A world of a batch that has been reset, as a simulation on whose lines a program drives the robots."""

    def __init__(self, batch: Batch, world: int, driving: RobotControllers, baud: int) -> None:
        self._batch, self._world, self._driving = batch, world, driving
        arena, starts, lamps = batch.arenas[batch.arena_indices[world]], batch.poses[world], batch.lamps[world]
        options: Any = {
            "robot": [batch.specs[kind] for kind in batch.state.robots["kind"][world].tolist()],
            "seed": int(batch.seeds[world]),
            "thinking": batch.timing.thinking,
        }
        if batch.has_own_starts[world]:
            arena = replace(arena, starts=tuple(Pose(*pose) for pose in starts.tolist()))
        self.sim = Simulation(arena, **options)
        if not np.array_equal(self.sim.lamps, lamps[: len(self.sim.lamps)]) or lamps[len(self.sim.lamps) :, 3].any():
            self.sim.lamps = np.zeros(lamps.shape)
            self.sim.lamps[:] = lamps  # some may have no place, which only an array that is written to may hold
        ports = []
        for number, turrets in enumerate(driving.turrets, 1):
            for turret in turrets:
                self.sim.fit(number, turret if isinstance(turret, str) else turret())
            ports.append(self.sim.port(number))
            ports[-1].baudrate = baud
        parameters = [driving.parameters[world, k, :count] for k, count in enumerate(driving.parameter_counts)]
        self.driver = ControllerDriver(
            ports,
            driving.controllers,
            parameters,
            period_s=batch.timing.period_s,
            kind=batch.specs[0].kind,
        )

    def difference(self, loop: int, compared: Iterable[Compared]) -> Difference | None:
        """Return the first difference; None if all is equal to the bit."""
        for robot, quantity, batch, line in compared:
            batches, lines = np.ravel(batch), np.ravel(line)
            for place in range(len(batches) if batches.tobytes() != lines.tobytes() else 0):
                if batches[place].tobytes() != lines[place].tobytes():
                    name = f"{quantity} {place}" if len(batches) > 1 else quantity
                    values = batches[place].item(), lines[place].item()
                    return Difference(self._world, loop, self.sim.world.state.tick_count, robot, name, *values)
        return None

    def exchanged(self, sensors: Any, wheels: Any) -> Iterator[Compared]:
        """Yield what the program of a batch has read and sent in a loop, and what that on the line has."""
        driver, driving = self.driver, self._driving
        for k, count in enumerate(driving.sense_counts.tolist()):
            first = 0
            for sense in map(sense_of, driving.senses[:count]):
                part = slice(first, first + sense.size)
                yield k + 1, sense.name, sensors[k, part], driver.sensors[k, part]
                first += sense.size
        for k, count in enumerate(driving.order_counts.tolist()):
            names = ("left speed", "right speed", *(order.name for order in driving.orders[:count]))
            for place, name in enumerate(names):
                yield k + 1, name, wheels[k, place], driver.wheels[k, place]

    def states(self) -> Iterator[Compared]:
        """Yield the times, and the states of robots and bodies."""
        batch, line = self._batch.state_of(self._world), self.sim.world.state
        yield None, "time_s", self._batch.times_s[self._world], self.driver.begin_ns / NS_PER_S
        yield None, "tick", batch.tick_count, line.tick_count
        if batch.robots.tobytes() != line.robots.tobytes():
            for k, name in product(range(line.robots.shape[1]), line.robots.dtype.names or ()):
                yield k + 1, name, batch.robots[name][0, k], line.robots[name][0, k]
        if batch.bodies.tobytes() != line.bodies.tobytes():
            for k, name in product(range(line.bodies.shape[1]), line.bodies.dtype.names or ()):
                yield None, f"{name} of body {k + 1}", batch.bodies[name][0, k], line.bodies[name][0, k]
