"""Measures: functions that observe a robot in a batch and return numbers about its run."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control.compiled_function import Compiled, decorator, explained
from kiks.control.senses import AnySense, check_senses
from kiks.engine.compiling import inlined
from kiks.errors import ParameterError, shown
from kiks.model.checks import check_count, check_kind

Moment: Any = namedtuple(
    "Moment",
    (
        "time_s",
        "period_s",
        "sensors",
        "wheels",
        "x_mm",
        "y_mm",
        "heading_rad",
        "start_x_mm",
        "start_y_mm",
        "path_mm",
        "contact_count",
        "is_touching",
        "bodies",
        "lamps",
        "robot",
        "poses",
    ),
)
"""The input of a measure: one robot in a control step, when its command takes effect.

* time_s: simulated time [s];
* period_s: time since the last call, the first since 0 [s];
* sensors: the readings of the controller, float64;
* wheels: the sent speeds, left and right [pulses/10 ms], then what other actuators were sent, float64;
* x_mm, y_mm, heading_rad: the robot's pose;
* start_x_mm, start_y_mm: its start;
* path_mm: its path so far, forwards and backwards together [mm];
* contact_count: number of its contacts so far;
* is_touching: whether it touches something, or did within the last 0.2 s;
* bodies: records of `kiks.engine.state.BODY`, balls and cylinders of its world;
* lamps: x [mm], y [mm], power [W] and 1 for on or 0 for off, float64 [lamp, 4];
* robot: index of the robot in its world, from 0;
* poses: x [mm], y [mm] and heading [rad] of all robots of its world at this instant, float64 [robot, 3].
"""


@inlined
def moment_of(
    times_s: Any, sensors: Any, wheels: Any, now: Any, start: Any, bodies: Any, lamps: Any, robot: Any, poses: Any
) -> Any:
    """Return what a measure sees of a robot: in a batch compiled, in a simulation as Python.

    Args:
        times_s: Its `time_s` and `period_s`.
        sensors: As in `Moment`.
        wheels: As in `Moment`.
        now: The robot's record, or what is stepped of it (`kiks.engine.bunch`): its path and its contacts.
        start: The robot's record, which has its start.
        bodies: As in `Moment`.
        lamps: As in `Moment`.
        robot: As in `Moment`.
        poses: As in `Moment`.
    """
    return Moment(
        times_s[0],
        times_s[1],
        sensors,
        wheels,
        poses[robot, 0],
        poses[robot, 1],
        poses[robot, 2],
        start.start_x_mm,
        start.start_y_mm,
        now.forwards_mm + now.backwards_mm,
        1.0 * now.contact_count,
        now.is_touching > 0.0,
        bodies,
        lamps,
        robot,
        poses,
    )


NEIGHBOUR, BODY, LAMP = "another robot", "a ball or a cylinder", "a lamp"

NEEDS: dict[str, Callable[[Any], bool]] = {
    "": lambda moment: True,
    NEIGHBOUR: lambda moment: len(moment.poses) > 1,
    BODY: lambda moment: len(moment.bodies) > 0,
    LAMP: lambda moment: len(moment.lamps) > 0,
}
"""What a measure may be about, and whether its world has one."""

Result = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def first_note(notes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the first of a measure's notes."""
    return notes[..., 0]


class Measure(Compiled):
    """A function `(moment, notes)` that is called in each control step and writes into its notes.

    Args:
        function: The function; see `Moment` for what it sees.
        notes: Numbers that it keeps for each robot, zeros at the start.
        result: From the notes at the end, float64 [..., note], to the values, float64 [...]; the first if left out.
            With `names`, to several values, float64 [..., value].
        senses: The senses that must come first in `moment.sensors`, as for `kiks.Controller`; controllers with others
            are rejected.
        names: Names of its values, if it has several.
        advice: What to do if a value is not finite, which a task refuses.
        needs: What it is about, 'another robot', 'a ball or a cylinder' or 'a lamp': a goal refuses it in a world
            without one. Empty if it has a meaning in each world.

    Example:
        >>> import kiks
        >>> @kiks.measure
        ... def farthest_mm(moment, notes):
        ...     way = ((moment.x_mm - moment.start_x_mm) ** 2 + (moment.y_mm - moment.start_y_mm) ** 2) ** 0.5
        ...     notes[0] = max(notes[0], way)
        >>> farthest_mm.note_count
        1
    """

    what, arguments, options = "measure", ("moment", "notes"), ("notes",)
    prefix = ""

    def __init__(
        self,
        function: Callable[..., Any],
        *,
        notes: int = 1,
        result: Result = first_note,
        senses: AnySense | Sequence[AnySense] = (),
        names: Sequence[str] = (),
        advice: str = "Check its divisions.",
        needs: str = "",
    ) -> None:
        super().__init__(function)
        self.own_names = tuple(check_kind("each of names", each, str) for each in names)
        self.note_count = check_count("notes", notes, least=1)
        if not callable(result):
            raise ParameterError(f"result must be a function from notes to values, but it was {shown(result)}.")
        self.result = result
        self.senses = check_senses(senses)
        self.advice = check_kind("advice", advice, str)
        if needs not in NEEDS:
            raise ParameterError(f"needs must be one of {[*NEEDS]}, but it was {shown(needs)}.")
        self.needs = needs

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name!r}>"

    def named(self, name: str) -> Measure:
        """Return the same measure under another name; the names of several values begin with it.

        So a measure with arguments can be taken twice.

        Example:
            >>> import kiks
            >>> kiks.measures.goal_mm(60, 350).named("left_mm").value_names
            ('left_mm',)
            >>> kiks.measures.trajectory(seconds=2, points=1).named("end").value_names
            ('end_x_mm_1', 'end_y_mm_1', 'end_heading_rad_1')
        """
        if not check_kind("name", name, str):
            raise ParameterError("name must have a character, but it was ''.")
        other = object.__new__(type(self))
        vars(other).update(vars(self), name=name, prefix=f"{name}_")
        return other

    @property
    def sizes(self) -> dict[str, int | None]:
        """How many numbers its notes are."""
        return {"notes": self.note_count}

    @property
    def value_names(self) -> tuple[str, ...]:
        """Names of its values: its own name, if it has one value."""
        return tuple(self.prefix + each for each in self.own_names) or (self.name,)

    def value(self, notes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values of all worlds and robots for their notes [world, robot, note].

        They are float64 [world, robot], or, of a measure with several values, [world, robot, value].

        Example:
            >>> import numpy as np
            >>> import kiks
            >>> kiks.measures.path_mm.value(np.zeros((3, 2, kiks.measures.path_mm.note_count))).shape
            (3, 2)
        """
        try:
            values: NDArray[np.float64] = np.asarray(self.result(notes.copy()))
        except Exception as error:
            raise explained(error, [self]) from None
        shape = (*notes.shape[:-1], *((len(self.own_names),) if self.own_names else ()))
        if values.dtype.kind not in "biuf" or values.shape != shape:
            found = f"of shape {values.shape}" if values.dtype.kind in "biuf" else "no numbers"
            each = "the named values" if self.own_names else "a value"
            raise ParameterError(
                f"the result of the measure {self.name!r} must be of shape {shape}, {each} for each world and "
                f"robot, but it was {found}. Work along the last axis, as notes[..., 0] does."
            )
        return values


def check_names(names: Sequence[str], others: Collection[str]) -> None:
    """Check that the names of the values of measures differ, also from the other columns of their table."""
    for name in names:
        if name in others or names.count(name) > 1:
            but = "is another column of their table" if name in others else "was there more than once"
            raise ParameterError(
                f"measures must have different names, but {shown(name)} {but}. "
                f"Give another name, as in measure.named({shown(f'other_{name}')})."
            )


measure = decorator(Measure)
"""Make a measure of a function; a decorator, with or without the options of `Measure`."""
