"""The functions of the steppers; the type of `place` selects the stepper when the caller is compiled.

`kiks.batch.world_stepper` steps one world at a time, in which things may collide; `kiks.batch.lane_stepper` steps eight
worlds of lone robots at once. The worlds that are stepped at once are a bunch; W is their number.

* take(place, worlds, numbers) returns a bunch of the worlds with these indices, int64 [W];
* give_back(place, worlds, bunch) writes the state of the bunch back into `worlds`;
* pass_to(place, worlds, bunch, times_ns) does the ticks that have begun before the time of each world, int64 [W];
* read(place, worlds, bunch, code, times_ns, robot, counts) reads a sense at these times into int64 [W, 8];
* command(place, bunch, k, robot, left, right) sets the speeds of a robot in world k of the bunch;
* show(place, worlds, bunch, k, robot, state) writes its present and past poses, which are the fields of a
  `kiks.control.measure.Moment` from `x_mm` to `is_touching`, float64 [8].
"""

from __future__ import annotations

from typing import Any

from numba import extending, types

from kiks.batch import lane_stepper, world_stepper
from kiks.batch.kernel_args import CollidingPlace, LonePlace
from kiks.engine.simd.f64x8 import LANES

_overload: Any = extending.overload

STEPPERS = {CollidingPlace: world_stepper, LonePlace: lane_stepper}
"""The steppers, by the type of the place."""


def bunch_size(place: Any) -> int:
    """Return the number of worlds in a bunch."""
    return LANES if isinstance(place, LonePlace) else 1


def _stepper(place: Any) -> Any:
    """Return the stepper for Numba's type of a place."""
    assert isinstance(place, types.NamedTuple)
    return STEPPERS[place.instance_class]


def take(place: Any, worlds: Any, numbers: Any) -> Any:
    """Return a bunch of worlds."""


def give_back(place: Any, worlds: Any, bunch: Any) -> Any:
    """Write the state of a bunch back."""


def pass_to(place: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    """Do the ticks that have begun."""


def read(place: Any, worlds: Any, bunch: Any, code: Any, times_ns: Any, robot: Any, counts: Any) -> Any:
    """Read a sense."""


def command(place: Any, bunch: Any, k: Any, robot: Any, left: Any, right: Any) -> Any:
    """Set the speeds of a robot."""


def show(place: Any, worlds: Any, bunch: Any, k: Any, robot: Any, state: Any) -> Any:
    """Write the present and past poses of a robot."""


@_overload(take)
def _take(place: Any, worlds: Any, numbers: Any) -> Any:
    return _stepper(place).take.py_func


@_overload(give_back)
def _give_back(place: Any, worlds: Any, bunch: Any) -> Any:
    return _stepper(place).give_back.py_func


@_overload(pass_to)
def _pass_to(place: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    return _stepper(place).pass_to.py_func


@_overload(read)
def _read(place: Any, worlds: Any, bunch: Any, code: Any, times_ns: Any, robot: Any, counts: Any) -> Any:
    return _stepper(place).read.py_func


@_overload(command)
def _command(place: Any, bunch: Any, k: Any, robot: Any, left: Any, right: Any) -> Any:
    return _stepper(place).command.py_func


@_overload(show)
def _show(place: Any, worlds: Any, bunch: Any, k: Any, robot: Any, state: Any) -> Any:
    return _stepper(place).show.py_func
