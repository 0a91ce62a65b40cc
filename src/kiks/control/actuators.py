"""The actuators of controllers beside the wheels: orders that a program sends when their number changes.

An actuator is a compiled function with its command, as a sense is. Those that come with KiKS are in `ACTUATORS` and
have names; one of a user's own is an object.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numba import types
from numpy.typing import NDArray

from kiks.control.compiled_function import caller_of, decorator
from kiks.control.turret_parts import VIEW, TurretPart, head_length, memory_slices
from kiks.engine.compiling import entry, kernel
from kiks.engine.physics.gripper import ARM_MAX
from kiks.errors import ParameterError, shown
from kiks.meant import nearest
from kiks.model.checks import check_count

ARGUMENTS = (VIEW, types.float64)
"""Types of a view and a value."""

call_actuator = caller_of(ARGUMENTS)

NOTHING = math.nan
"""An output that sends nothing, and what was sent before the first loop."""

VALUE_MAX = 10_000_000


class Actuator(TurretPart):
    r"""A function `(view, value)` that does in a batch what a command with one whole number does on the wire.

    A controller writes the number into the place of its output that follows the wheels. It is rounded and cut to the
    limits. The command is sent in the first loop, and then whenever the number differs from the one that was sent last;
    NaN sends nothing. An actuator that is defined in the class of a turret belongs to it, and robots whose controllers
    have it carry the turret.

    Args:
        function: The function; see `kiks.control.turret_parts.RobotView` for what it sees, and may write to.
        command: The command without its number, such as 'T,1,E'.
        most: The largest number.
        least: The smallest number.
        turret: The turret that answers the command, a name or a class; none for a command of the robot's own.

    Attributes:
        name: Its name.
        command: As above, as all others.
        turret: The turret: a name, a class, or None.
        recipe: The table that finds it again, of JSON values; None for one that cannot be imported.
        address: Where a batch calls it.

    Example:
        >>> import kiks
        >>> from kiks.firmware.turret import Turret
        >>> class Lamp(Turret):
        ...     number, name, memory_count = 25, "Lamp", 1
        ...
        ...     def switch(self, value):
        ...         self.site.memory[0] = value
        ...         return ()
        ...
        ...     orders = {"S": (1, switch)}
        ...
        ...     @kiks.actuator(command="T,25,S", most=1)
        ...     def light(view, value):
        ...         view.memory[0] = value
        >>> Lamp.light, Lamp.light.request(1.0)
        (<Actuator 'light': T,25,S>, b'T,25,S,1\n')
    """

    what, arguments, options, argument_types = "actuator", ("view", "value"), (), ARGUMENTS

    def __init__(
        self, function: Callable[..., Any], *, command: str, most: int, least: int = 0, turret: Any = None
    ) -> None:
        super().__init__(function, command, turret)
        self.most = check_count("most", most, -VALUE_MAX, VALUE_MAX)
        self.least = check_count("least", least, -VALUE_MAX, self.most)

    def request(self, value: float) -> bytes:
        r"""Return the command as it is sent."""
        return f"{self.command},{int(value)}\n".encode()


actuator = decorator(Actuator)
"""Make an actuator of a function; a decorator, with the options of `Actuator`."""


@actuator(command="T,1,E", most=int(ARM_MAX), turret="gripper")  # khepera-protocol.md 10.2
def arm(view: Any, value: Any) -> None:
    """Move the arm of a gripper: 255 is down in front, 127 upright, 0 folded back."""
    view.robots[view.robot].arm_target = value


@actuator(command="T,1,D", most=1, turret="gripper")
def jaws(view: Any, value: Any) -> None:
    """Open (0) or close (1) the jaws of a gripper."""
    view.robots[view.robot].is_closing = value


WHEELS = "wheels"
"""The actuator that every controller has, first."""

ACTUATORS: dict[str, tuple[Actuator, ...]] = {WHEELS: (), "gripper": (arm, jaws)}
"""The actuators that have names, and the outputs of each after those of the wheels."""

AnyActuator: TypeAlias = str | Actuator
"""An actuator of `ACTUATORS` by its name, or one of a user's own."""


def orders_of(actuators: Sequence[AnyActuator]) -> tuple[Actuator, ...]:
    """Return what stands for the outputs of actuators after those of the wheels."""
    return tuple(order for each in actuators for order in ((each,) if isinstance(each, Actuator) else ACTUATORS[each]))


def check_actuators(actuators: AnyActuator | Sequence[AnyActuator]) -> tuple[AnyActuator, ...]:
    """Return some of `ACTUATORS`, or of a user's own, the wheels first."""
    try:
        given = (actuators,) if isinstance(actuators, str | Actuator) else tuple(actuators)
    except TypeError:
        given = ()
    for each in given:
        if not isinstance(each, Actuator) and (not isinstance(each, str) or each not in ACTUATORS):
            raise ParameterError(
                f"actuators must be some of {', '.join(ACTUATORS)}, but {shown(each)} was among them."
                f"{nearest(each, ACTUATORS)} One of your own is made by @kiks.actuator."
            )
    if given[:1] != (WHEELS,) or len(set(given)) != len(given):
        raise ParameterError(
            f"actuators must name each once, the wheels first, but they were {shown(actuators)}. "
            'Write actuators=("wheels", "gripper").'
        )
    return given


@functools.lru_cache(maxsize=256)
def order_rows_of(parts: tuple[TurretPart, ...]) -> NDArray[np.int64]:
    """Return what the loop of a batch knows of the actuators among some senses and actuators, int64 [order, 7].

    These are where it calls each; the number of the characters of its command but for the number, and of its reply; the
    limits of the number; and where the numbers of its turret begin and end.
    """
    rows = []
    for each, (begin, end) in zip(parts, memory_slices(parts), strict=True):
        if isinstance(each, Actuator):
            lengths = len(each.command) + 2, head_length(each.command) + 2
            rows.append((each.address, *lengths, each.least, each.most, begin, end))
    return np.array(rows, np.int64).reshape(-1, 7)


@kernel
def whole_value(wanted: Any, least: Any, most: Any, sent: Any) -> Any:
    """Return the number to send for a wanted one, rounded, within limits; for none, the one that was sent last."""
    return sent if math.isnan(wanted) else np.rint(min(max(wanted, least), most))


@entry
def value_of(wanted: Any, least: Any, most: Any, sent: Any) -> Any:
    """Call `whole_value` from Python."""
    return whole_value(wanted, least, most, sent)
