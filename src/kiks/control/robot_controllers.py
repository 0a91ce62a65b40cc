"""The controllers of the robots in a world, with their parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control.actuators import orders_of
from kiks.control.controller import Controller
from kiks.control.senses import named, sense_of
from kiks.control.turret_parts import memory_slices, turrets_of
from kiks.errors import ParameterError, shown
from kiks.model.checks import check_kind


class RobotControllers:
    """Controllers and parameters of every robot of every world.

    Args:
        given: A controller for all robots, or one for each robot of a world.
        parameters: As for `kiks.Batch.run`.
        world_count: Number of worlds.
        robot_count: Number of robots in each.

    Attributes:
        controllers: The controller of each robot.
        parameter_counts: The number of parameters of each robot.
        parameters: Their parameters, padded with zeros, float64 [world, robot, parameter].
        senses: All senses: those of the controller with the most. Each other robot has the first of these.
        common_senses: The senses that all robots have.
        sense_counts: Number of senses of each robot, int64 [robot].
        orders: All actuators after the wheels, likewise.
        order_counts: Number of these of each robot, int64 [robot].
        parts: Senses and actuators together, of the robot with the most.
        turrets: The turrets of each robot, names and classes.
        memory_count: Largest number of numbers that a controller remembers.
    """

    def __init__(self, given: Any, parameters: Any, world_count: int, robot_count: int) -> None:
        is_list = isinstance(given, Sequence)
        self.controllers: tuple[Controller, ...] = tuple(given) if is_list else (given,) * robot_count
        if len(self.controllers) != robot_count:
            raise ParameterError(
                f"controller must be one for all robots, or a list of {robot_count}, one for each robot of a world, "
                f"but it was a list of {len(self.controllers)}."
            )
        for each in self.controllers:
            check_kind("controller", each, Controller, "Write @kiks.controller over the function.")
        different = dict.fromkeys(self.controllers)  # a swarm has a thousand robots, and one controller
        self.senses = max((each.senses for each in different), key=len)
        for each in different:
            if each.senses != self.senses[: len(each.senses)]:
                raise ParameterError(
                    f"the senses of one controller must come first among those of the one that has the most, but "
                    f"{shown(each.name)} senses {named(each.senses)} where another senses {named(self.senses)}."
                )
        if is_list:
            rows = _parameters_of_each(self.controllers, parameters, world_count)
            self.parameters = np.zeros((world_count, robot_count, max(row.shape[1] for row in rows)))
            for robot, row in enumerate(rows):
                self.parameters[:, robot, : row.shape[1]] = row
            self.parameter_counts = tuple(row.shape[1] for row in rows)
        else:
            self.parameters = _parameters_of_all(given, parameters, world_count, robot_count)
            self.parameter_counts = (self.parameters.shape[2],) * robot_count
        sense_counts = [len(each.senses) for each in self.controllers]
        self.common_senses, self.sense_counts = self.senses[: min(sense_counts)], np.array(sense_counts, np.int64)
        turrets = {each: turrets_of(each.parts) for each in different}
        self.turrets = [turrets[each] for each in self.controllers]
        orders = {each: orders_of(each.actuators) for each in different}
        self.orders = max(orders.values(), key=len)
        self.order_counts = np.array([len(orders[each]) for each in self.controllers], np.int64)
        self.parts = (*map(sense_of, self.senses), *self.orders)
        places = dict(zip(self.parts, memory_slices(self.parts), strict=True))
        for each, its in orders.items():
            if its != self.orders[: len(its)] or [places[part] for part in each.parts] != memory_slices(each.parts):
                raise ParameterError(
                    "the actuators of one controller must come first among those of the one that has the most, on the "
                    f"same turrets, but those of {shown(each.name)} do not. Let all robots have the same."
                )
        self.memory_count = max(each.memory_count for each in different)

    @property
    def names(self) -> str:
        """Names of the controllers, for messages."""
        return ", ".join(dict.fromkeys(repr(each.name) for each in dict.fromkeys(self.controllers)))


def _parameters_of_all(
    controller: Controller, parameters: Any, world_count: int, robot_count: int
) -> NDArray[np.float64]:
    """Return the parameters of one controller for all robots, float64 [world, robot, parameter]."""
    given = controller.check_parameters(parameters)
    if given.ndim == 2:
        given = given[:, None, :]
    try:
        return np.array(np.broadcast_to(given, (world_count, robot_count, given.shape[-1])), order="C")
    except ValueError:
        raise ParameterError(
            f"parameters must be [parameter], [world, parameter] or [world, robot, parameter] with {world_count} "
            f"worlds and {robot_count} robots, but their shape was {np.shape(parameters)}."
        ) from None


def _parameters_of_each(
    controllers: Sequence[Controller], parameters: Any, world_count: int
) -> list[NDArray[np.float64]]:
    """Return the parameters of each controller, float64 [world, parameter]."""
    if not isinstance(parameters, Sequence) or len(parameters) not in (0, len(controllers)):
        raise ParameterError(
            f"parameters must be a list with those of each of the {len(controllers)} controllers, but they were "
            f"{shown(parameters)}."
        )
    rows = []
    for robot, controller in enumerate(controllers):
        given = controller.check_parameters(parameters[robot] if len(parameters) else ())
        try:
            rows.append(np.broadcast_to(given, (world_count, given.shape[-1])))
        except ValueError:
            raise ParameterError(
                f"parameters of a controller must be [parameter] or [world, parameter] with {world_count} worlds, but "
                f"those of robot {robot + 1} had the shape {given.shape}."
            ) from None
    return rows
