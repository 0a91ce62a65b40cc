"""A controller drives robots on ports, simulated or real, in the same loop as a batch of worlds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.client.port import Port
from kiks.client.serial_robot import SerialRobot
from kiks.control.actuators import NOTHING, Actuator, value_of
from kiks.control.controller import Controller, whole_speeds
from kiks.control.robot_controllers import RobotControllers
from kiks.control.senses import for_controllers, reading_count, sense_of
from kiks.errors import ParameterError
from kiks.firmware.robot_kind import robot_kind
from kiks.model.checks import SECONDS_MAX, check_choice, check_number
from kiks.model.robot_kinds import ROBOT_KINDS
from kiks.units import ns_from_s, s_from_ns


def drive(
    port: str | Port | Sequence[str | Port],
    controller: Controller | Sequence[Controller],
    parameters: Any = (),
    *,
    seconds: float,
    period_s: float = 0.1,
    baud: int | None = None,
    kind: str = "khepera",
) -> int:
    """Let a controller drive: each loop reads the sensors, lets it decide, sends the speeds and waits.

    A batch with the same timing (`kiks.Timing`), controller and seed gives the same run, to the bit: `kiks.verify`
    compares them. The robots stop at the end, also after an error.

    Args:
        port: As for `kiks.Khepera`: a simulation's port, a port's name, or an open port. One program drives several
            ports; each robot has a memory of its own.
        controller: The controller of all robots, or a list with one for each. The senses of each must come first among
            those of the one that has the most.
        parameters: Its parameters, float64 [parameter], or [robot, parameter]; with a list of controllers, a list with
            those of each.
        seconds: Time after which no loop begins [s].
        period_s: Time from the beginning of one loop to that of the next [s]; a loop that takes longer delays the next.
        baud: Speed of the lines [bit/s]. Left out, open ports keep their own, and those opened by name have 9600.
        kind: The kind of the robots, as their files name it.

    Returns:
        Number of loops.

    Raises:
        LinkError: If a port cannot be opened, or a robot does not send the expected reply.

    Example:
        >>> import kiks
        >>> @kiks.controller
        ... def ahead(sensors, memory, parameters, wheels):
        ...     wheels[:] = 5.0
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
        >>> kiks.drive(sim.port(1), ahead, seconds=1.0)
        10
    """
    driving_ns = ns_from_s(check_number("seconds", seconds, 0, SECONDS_MAX))
    driver = ControllerDriver(port, controller, parameters, period_s=period_s, baud=baud, kind=kind)
    until_ns = driver.begin_ns + driving_ns
    try:
        while driver.begin_ns < until_ns:
            driver.step()
    finally:
        driver.stop()
    return driver.loop_count


class ControllerDriver:
    """A controller that drives robots of a kind loop by loop; other arguments as for `drive`.

    Attributes:
        begin_ns: Time at which the next loop begins, by the robots' clock [ns].
        loop_count: Number of loops so far.
        sensors: The last readings, float64 [robot, sensor].
        wheels: The last sent speeds [8 mm/s], and outputs of other actuators, float64 [robot, 2 + order].

    Raises:
        LinkError: If a port cannot be opened.
    """

    def __init__(
        self,
        port: str | Port | Sequence[str | Port],
        controller: Controller | Sequence[Controller],
        parameters: Any = (),
        *,
        period_s: float = 0.1,
        baud: int | None = None,
        kind: str = "khepera",
    ) -> None:
        check_choice("kind", kind, ROBOT_KINDS)
        self._kind = robot_kind(kind)
        self._kind.must_take_lines("a drive by a controller")
        self._period_ns = ns_from_s(check_number("period_s", period_s, 0, SECONDS_MAX))
        ports = [port] if isinstance(port, str) or not isinstance(port, Sequence) else list(port)
        if not ports:
            raise ParameterError("port must be one or more robots' ports, but there was none.")
        if isinstance(controller, Controller):
            given = controller.check_parameters(parameters)
            parameters = given[None] if given.ndim == 2 else given  # one world
        driving = RobotControllers(controller, parameters, 1, len(ports))
        self._senses, self._controllers = driving.senses, driving.controllers
        self._requests = [f"{sense_of(each).command_for(self._kind)}\n".encode() for each in driving.senses]
        self._conversions = [for_controllers(sense_of(each), self._kind) for each in driving.senses]
        self._given = [driving.parameters[0, k, :count] for k, count in enumerate(driving.parameter_counts)]
        self.sensors = np.zeros((len(ports), reading_count(driving.senses)))
        self._memory = [np.zeros(each.memory_count) for each in driving.controllers]
        self._orders, self._order_counts = driving.orders, driving.order_counts
        self.wheels = np.zeros((len(ports), 2 + len(self._orders)))
        self._sent = np.full((len(ports), len(self._orders)), NOTHING)
        # Compiles the controllers, so that a faulty one raises before a robot moves.
        for k in range(len(ports)):
            self._decide(k, self._memory[k].copy())
        self.wheels[:] = 0.0
        self._robots = [SerialRobot(each, baud=baud) for each in ports]
        self.begin_ns = ns_from_s(self._robots[0].time_s)
        self.loop_count = 0

    def step(self) -> None:
        """Run one loop, and wait until its period is over.

        Raises:
            LinkError: If a robot does not send the expected reply.
        """
        robots, sensors, wheels = self._robots, self.sensors, self.wheels
        first = 0
        for number, name in enumerate(self._senses):
            sense = sense_of(name)
            sensing = [k for k, each in enumerate(self._controllers) if number < len(each.senses)]
            request, (scale, places) = self._requests[number], self._conversions[number]
            for k in sensing:
                robots[k].port.write(request)
            for k in sensing:
                readings = robots[k].read_numbers(request, sense.size)
                sensors[k, first : first + sense.size] = [readings[place] * scale for place in places]
            first += sense.size
        for k, robot in enumerate(robots):
            self._decide(k, self._memory[k])
            sent = whole_speeds(wheels[k], self._kind.speed_scale, self._kind.speed_max)
            robot.port.write(self._kind.set_speeds(*sent))
            wheels[k, :2] = sent[0] / self._kind.speed_scale, sent[1] / self._kind.speed_scale
        for robot in robots:
            robot.read_confirmation(self._kind.stop)
        for place, order in enumerate(self._orders):
            self._send(place, order)
        self.loop_count += 1
        now_ns = ns_from_s(robots[0].time_s)
        if self.begin_ns + self._period_ns > now_ns:
            robots[0].pause(s_from_ns(self.begin_ns + self._period_ns - now_ns))
        self.begin_ns = max(self.begin_ns + self._period_ns, now_ns)

    def _send(self, place: int, order: Actuator) -> None:
        """Send an order to the robots for which its number has changed, and read their replies."""
        wanted, sent, asked = self.wheels[:, 2 + place], self._sent[:, place], list[int]()
        for k in np.flatnonzero(place < self._order_counts).tolist():
            wanted[k] = value_of(wanted[k], float(order.least), float(order.most), sent[k])
            if not math.isnan(wanted[k]) and wanted[k] != sent[k]:
                self._robots[k].port.write(order.request(wanted[k]))
                sent[k] = wanted[k]
                asked.append(k)
        for k in asked:
            self._robots[k].read_confirmation(order.request(sent[k]))

    def _decide(self, robot: int, memory: NDArray[np.float64]) -> None:
        """Let the controller of a robot write its speeds."""
        decide = self._controllers[robot]
        outputs = self.wheels[robot, : decide.output_count]
        decide(self.sensors[robot, : decide.sensor_count], memory, self._given[robot], outputs)

    def stop(self) -> None:
        """Stop the robots."""
        for robot in self._robots:
            robot.port.write(self._kind.stop)
            robot.read_confirmation(self._kind.stop)
