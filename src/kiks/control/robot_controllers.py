"""The controllers of the robots in a world, with their parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.control.controller import Controller
from kiks.errors import ParameterError, shown
from kiks.model.checks import check_kind


class RobotControllers(NamedTuple):
    """Controllers and parameters of every robot of every world.

    Attributes:
        controllers: The controller of each robot.
        parameter_counts: The number of parameters of each robot.
        parameters: Their parameters, padded with zeros, float64 [world, robot, parameter].
        senses: All senses: those of the controller with the most. Each other robot has the first of these.
    """

    controllers: tuple[Controller, ...]
    parameter_counts: tuple[int, ...]
    parameters: NDArray[np.float64]
    senses: tuple[str, ...]

    @property
    def sense_counts(self) -> NDArray[np.int64]:
        """Number of senses of each robot, int64 [robot]."""
        return np.array([len(each.senses) for each in self.controllers], np.int64)

    @property
    def has_camera(self) -> NDArray[np.bool_]:
        """Whether each robot has a camera, bool [robot]."""
        return np.array(["camera" in each.senses for each in self.controllers])

    @property
    def common_senses(self) -> tuple[str, ...]:
        """The senses that all robots have."""
        return self.senses[: min(len(each.senses) for each in self.controllers)]

    @property
    def names(self) -> str:
        """Names of the controllers, for messages."""
        return ", ".join(dict.fromkeys(repr(each.name) for each in self.controllers))

    @property
    def memory_count(self) -> int:
        """Largest number of numbers that a controller remembers."""
        return max(each.memory_count for each in self.controllers)


def robot_controllers(given: Any, parameters: Any, world_count: int, robot_count: int) -> RobotControllers:
    """Return the controllers of robots, checked.

    Args:
        given: A controller for all robots, or one for each robot of a world.
        parameters: As for `kiks.Batch.run`.
        world_count: Number of worlds.
        robot_count: Number of robots in each.
    """
    if not isinstance(given, Sequence):
        _check_controller(given)
        each_given = _parameters_of_all(given, parameters, world_count, robot_count)
        return RobotControllers((given,) * robot_count, (each_given.shape[2],) * robot_count, each_given, given.senses)
    if len(given) != robot_count:
        raise ParameterError(
            f"controller must be one for all robots, or a list of {robot_count}, one for each robot of a world, but it "
            f"was a list of {len(given)}."
        )
    for each in given:
        _check_controller(each)
    senses = max((each.senses for each in given), key=len)
    for each in given:
        if each.senses != senses[: len(each.senses)]:
            raise ParameterError(
                f"the senses of one controller must come first among those of the one that has the most, but "
                f"{shown(each.name)} senses {', '.join(each.senses)} where another senses {', '.join(senses)}."
            )
    rows = _parameters_of_each(given, parameters, world_count)
    counts = tuple(row.shape[1] for row in rows)
    padded = np.zeros((world_count, robot_count, max(counts)))
    for robot, row in enumerate(rows):
        padded[:, robot, : row.shape[1]] = row
    return RobotControllers(tuple(given), counts, padded, senses)


def _check_controller(given: object) -> None:
    check_kind("controller", given, Controller, "Write @kiks.controller over the function.")


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
