"""Controllers: plain functions from a robot's readings to the speeds of its wheels.

The same function runs compiled in a batch and drives one robot on any port, simulated or real (`kiks.drive`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.control.actuators import WHEELS, AnyActuator, check_actuators, orders_of
from kiks.control.compiled_function import RETURNS, Compiled, decorator, explained
from kiks.control.recipes import recipe_of
from kiks.control.senses import AnySense, check_senses, named, reading_count, sense_of
from kiks.control.turret_parts import TurretPart
from kiks.engine.compiling import entry, kernel
from kiks.errors import ParameterError, counted, shown
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_count

ARGUMENTS = ("sensors", "memory", "parameters", "wheels")


class Controller(Compiled):
    """A function `(sensors, memory, parameters, wheels)` of four float64 arrays that writes the last.

    It is called once a control step. `sensors` has the readings of each sense, in the order of `senses`: eight counts
    of proximity or ambient light, clockwise from the left, sixteen greys of the camera, from the left. `memory` is
    zeros at the start and its own from then on. `wheels` takes the speeds of the left and right wheel [pulses/10 ms],
    which are rounded and cut to +-127 when they are sent, and then a number for each other output: with a gripper, the
    place of its arm (255 down, 127 upright, 0 folded back), and 0 for open jaws or 1 for closed ones.

    Args:
        function: The function.
        senses: Its senses, of `kiks.control.senses.SENSES` or of a user's own (`kiks.sense`).
        actuators: Its actuators, of `kiks.control.actuators.ACTUATORS` or of a user's own (`kiks.actuator`), the wheels
            first.
        memory: How many numbers it remembers.
        parameters: How many parameters it has; any count if left out.

    Attributes:
        senses: Its senses.
        actuators: Its actuators.
        memory_count: Numbers in its memory.
        parameter_count: Number of its parameters; None if any number will do.
        recipe: The table that recreates it (`kiks.controllers.from_recipe`), of JSON values; None for a function inside
            another, or one that was typed into a console.

    Example:
        >>> import numpy as np
        >>> import kiks
        >>> @kiks.controller(parameters=1)
        ... def shy(sensors, memory, parameters, wheels):
        ...     wheels[0] = wheels[1] = 5.0 - parameters[0] * sensors[2]
        >>> wheels = np.zeros(2)
        >>> shy(np.full(8, 100.0), np.zeros(0), np.array([0.1]), wheels)
        >>> wheels
        array([-5., -5.])
        >>> shy.check_parameters([1])
        array([1.])
    """

    what, arguments, options = "controller", ARGUMENTS, ("memory", "parameters")

    def __init__(
        self,
        function: Callable[..., Any],
        *,
        senses: AnySense | Sequence[AnySense] = ("proximity",),
        actuators: AnyActuator | Sequence[AnyActuator] = (WHEELS,),
        memory: int = 0,
        parameters: int | None = None,
    ) -> None:
        super().__init__(function)
        self.senses = check_senses(senses)
        if not self.senses:
            raise ParameterError("senses must name one sense at least, but there was none.")
        self.actuators = check_actuators(actuators)
        self.memory_count = check_count("memory", memory)
        self.parameter_count = None if parameters is None else check_count("parameters", parameters)
        self.recipe = recipe_of(function)

    def __repr__(self) -> str:
        count = (
            "any number of parameters" if self.parameter_count is None else counted(self.parameter_count, "parameter")
        )
        return f"<{type(self).__name__} {self.name!r}: {named(self.senses)}; {count}>"

    @property
    def sizes(self) -> dict[str, int | None]:
        """How many numbers each array has that it is called with; None if any number will do."""
        counts = self.sensor_count, self.memory_count, self.parameter_count, self.output_count
        return dict(zip(ARGUMENTS, counts, strict=True))

    @property
    def sensor_count(self) -> int:
        """Number of its readings."""
        return reading_count(self.senses)

    @property
    def output_count(self) -> int:
        """Number of its outputs."""
        return 2 + len(orders_of(self.actuators))

    @property
    def parts(self) -> tuple[TurretPart, ...]:
        """Its senses and its actuators after the wheels, with their commands."""
        return (*map(sense_of, self.senses), *orders_of(self.actuators))

    def __call__(
        self,
        sensors: NDArray[np.float64],
        memory: NDArray[np.float64],
        parameters: NDArray[np.float64],
        wheels: NDArray[np.float64],
    ) -> None:
        """Decide once, with the same machine code as in a batch."""
        try:
            returned = self.kernel(sensors, memory, parameters, wheels)
        except Exception as error:
            raise explained(error, [self]) from None
        if returned is not None:
            raise self.refused(TypeError(RETURNS))

    def check_parameters(self, parameters: ArrayLike) -> NDArray[np.float64]:
        """Return parameters as float64 [..., parameter]."""
        given = check_numbers("parameters", parameters)
        given = given.reshape(1) if given.ndim == 0 else given
        if self.parameter_count not in (None, given.shape[-1]):
            raise ParameterError(
                f"the controller {shown(self.name)} must be given {counted(self.parameter_count or 0, 'parameter')}, "
                f"but got {given.shape[-1]} (shape {given.shape}; the last axis is one controller's)."
            )
        return given


controller = decorator(Controller)
"""Make a controller of a function; a decorator, with or without the options of `Controller`."""


@kernel
def whole_speed(wanted: Any, scale: Any, most: Any) -> Any:
    """Return the speed to send for a wanted one [8 mm/s].

    Args:
        wanted: The speed; what is no number is 0.
        scale: What it is multiplied by for the command: controllers give all kinds of robots the same speeds.
        most: The largest number in the command, either way: the speed is cut to it, and rounded.
    """
    if math.isnan(wanted):
        return np.int64(0)
    return np.int64(np.rint(min(max(wanted * scale, -1.0 * most), 1.0 * most)))


@entry
def whole_speeds(wheels: Any, scale: Any, most: Any) -> Any:
    """Return the speeds to send for two wanted ones."""
    return whole_speed(wheels[0], scale, most), whole_speed(wheels[1], scale, most)
