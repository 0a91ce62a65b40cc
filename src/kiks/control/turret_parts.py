"""What senses and actuators have in common: a command on the wire, a compiled function in a batch, and a turret."""

from __future__ import annotations

import functools
from collections import namedtuple
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from numba import types
from numba.np.numpy_support import from_dtype

from kiks.control.checked_code import is_trusted
from kiks.control.compiled_function import Compiled
from kiks.control.recipes import recipe_of
from kiks.engine.compiling import address_of, entry, inlined
from kiks.engine.scene import OPEN_SCENE
from kiks.engine.sensing.proximity import lone_pose_at
from kiks.engine.state import BODY, ROBOT
from kiks.errors import ParameterError, shown

_tuple: Any = types.NamedTuple

RobotView: Any = namedtuple(
    "RobotView",
    (
        "robot",
        "x_mm",
        "y_mm",
        "heading_rad",
        "time_ns",
        "memory",
        "robots",
        "bodies",
        "is_noisy",
        "tick_count",
        "world",
        "scene",
    ),
)
"""The input of a sense or actuator: one robot, at the time at which its command acts.

* robot: index of the robot in its world, from 0;
* x_mm, y_mm, heading_rad: its pose at that time;
* time_ns: the time [ns];
* memory: numbers that the turret remembers, float64, as `Site.memory`;
* robots: records of `kiks.engine.state.ROBOT`, all robots of its world, at the end of the last tick;
* bodies: records of `kiks.engine.state.BODY`, the balls and cylinders, at the end of the last tick;
* is_noisy: False if the readings are to be free of noise;
* tick_count: ticks done;
* world: index of its world in the scene;
* scene: the arrays of the engine (`kiks.engine.scene.open_scene`).
"""


def _list(element: Any) -> Any:
    return types.Array(element, 1, "C")


_NUMBER, _ROW, _INTEGER = types.float64, _list(types.float64), types.int64

VIEW = _tuple(
    (
        *(_INTEGER, _NUMBER, _NUMBER, _NUMBER, _INTEGER, _ROW, _list(from_dtype(ROBOT)), _list(from_dtype(BODY))),
        *(types.boolean, _INTEGER, _INTEGER, OPEN_SCENE),
    ),
    RobotView,
)
"""Numba's type of a view."""


@inlined
def view_of(
    scene: Any, world: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, first: Any, end: Any
) -> Any:
    """Return what a sense sees of a robot at a time; its turret remembers the numbers from `first` up to `end`."""
    state = scene.robots[world, robot]
    x_mm, y_mm, heading_rad = lone_pose_at(state, tick_count, time_ns)
    return RobotView(
        robot,
        x_mm,
        y_mm,
        heading_rad,
        time_ns,
        state.turret_memory[first:end],
        scene.robots[world],
        scene.bodies[world],
        is_noisy,
        tick_count,
        world,
        scene,
    )


class TurretPart(Compiled):
    """A compiled function with the command that does the same on the wire; the common base of senses and actuators.

    Args:
        function: The function.
        command: The command.
        turret: The turret that answers it, a name or a class; the class that it is defined in sets it.

    Attributes:
        recipe: The table that finds it again, of JSON values, or the name of one that stands for it; None for one that
            cannot be imported.
    """

    argument_types: tuple[Any, ...]

    def __init__(self, function: Callable[..., Any], command: str, turret: Any) -> None:
        super().__init__(function)
        if self._stands_in_module:
            self.kernel = entry(function)
        if not isinstance(command, str) or not command.isascii() or not command.isprintable() or not command:
            raise ParameterError(f"command must be a line such as 'E' or 'T,24,C', but it was {shown(command)}.")
        self.command = command
        self.turret = turret
        self.recipe: dict[str, Any] | str | None = recipe_of(function)

    @property
    def _stands_in_module(self) -> bool:
        """Whether it is a function of KiKS's own with one meaning: code on disk does not tell closures apart."""
        return is_trusted(self.function) and self.function.__closure__ is None

    def __set_name__(self, owner: type, name: str) -> None:
        self.turret = owner

    def __reduce__(self) -> Any:
        if self._stands_in_module:
            return self.name
        # The turret's class has this part: each is made before the other is known.
        if not isinstance(self.turret, type):
            return super().__reduce__()
        alone = object.__new__(type(self))
        vars(alone).update(vars(self), turret=None)
        return (*alone.__reduce__(), {"turret": self.turret})

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name!r}: {self.command}>"

    @functools.cached_property
    def address(self) -> int:
        """Where a batch calls it; valid while it lives, in this process."""
        return address_of(self.check(self.argument_types))

    @property
    def memory_count(self) -> int:
        """How many numbers its turret remembers."""
        return int(getattr(self.turret, "memory_count", 0))


def head_length(command: str) -> int:
    """Return the length of the reply before its numbers and its end: a turret repeats its number and the letter.

    Example:
        >>> head_length("T,24,C,5"), head_length("N")  # t,24,c and n
        (6, 1)
    """
    words = command.split(",")  # khepera-protocol.md 4.18
    return len(",".join(words[: 3 if words[0] == "T" else 1]))


def turrets_of(parts: Iterable[TurretPart]) -> tuple[Any, ...]:
    """Return the turrets that some parts need, names and classes, each once."""
    return tuple(dict.fromkeys(each.turret for each in parts if each.turret is not None))


def memory_slices(parts: Sequence[TurretPart]) -> list[tuple[int, int]]:
    """Return where the numbers of each part's turret begin and end, if a robot carries the turrets of all these."""
    first, begins = 0, dict[Any, int]()
    for each in parts:
        if each.turret not in begins:
            begins[each.turret] = first
            first += each.memory_count
    places = ((begins[each.turret], each.memory_count) for each in parts)
    return [(begin, begin + count) if count else (0, 0) for begin, count in places]
