"""Bunches of worlds that a kernel does at once, and the steps that they are done in: what `kiks.batch.loop` is made of.

The type of `place` selects the steps: `kiks.batch.world_stepper` does one world at a time, in which things may meet,
`kiks.batch.lane_stepper` eight worlds of lone robots at once. W is the number of worlds in a bunch.

* take(place, worlds, numbers) makes a bunch of the worlds of these numbers, int64 [W];
* give_back(place, worlds, bunch) ends it: what it changed stands in `worlds` again;
* pass_to(place, worlds, bunch, times_ns) does the ticks that have begun up to a time of each world, int64 [W];
* read(place, worlds, bunch, code, times_ns, robot, counts) reads a sense at these times into int64 [W, 8];
* command(place, bunch, k, robot, left, right) sets the speeds of a robot in the bunch's world k;
* show(place, worlds, bunch, k, robot, state) writes its present and past poses: the fields of a
  `kiks.control.measure.Moment` from `x_mm` to `is_touching`, float64 [8].
"""

from __future__ import annotations

from typing import Any

from numba import extending, types

from kiks.batch import lane_stepper, world_stepper
from kiks.batch.kernel_args import Alone, Together
from kiks.engine.simd.f64x8 import LANES

_overload: Any = extending.overload

STEPS = {Together: world_stepper, Alone: lane_stepper}
"""The modules of the steppers, by the type of the place."""


def bunch_size(place: Any) -> int:
    """Return the number of worlds in a bunch."""
    return LANES if isinstance(place, Alone) else 1


def _steps(place: Any) -> Any:
    """Return the module for a type of place."""
    assert isinstance(place, types.NamedTuple)
    return STEPS[place.instance_class]


def take(place: Any, worlds: Any, numbers: Any) -> Any:
    """Make a bunch."""


def give_back(place: Any, worlds: Any, bunch: Any) -> Any:
    """End it."""


def pass_to(place: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    """Let time pass."""


def read(place: Any, worlds: Any, bunch: Any, code: Any, times_ns: Any, robot: Any, counts: Any) -> Any:
    """Read a sense."""


def command(place: Any, bunch: Any, k: Any, robot: Any, left: Any, right: Any) -> Any:
    """Set speeds."""


def show(place: Any, worlds: Any, bunch: Any, k: Any, robot: Any, state: Any) -> Any:
    """Write the present and past poses of a robot."""


@_overload(take)
def _take(place: Any, worlds: Any, numbers: Any) -> Any:
    return _steps(place).take.py_func


@_overload(give_back)
def _give_back(place: Any, worlds: Any, bunch: Any) -> Any:
    return _steps(place).give_back.py_func


@_overload(pass_to)
def _pass_to(place: Any, worlds: Any, bunch: Any, times_ns: Any) -> Any:
    return _steps(place).pass_to.py_func


@_overload(read)
def _read(place: Any, worlds: Any, bunch: Any, code: Any, times_ns: Any, robot: Any, counts: Any) -> Any:
    return _steps(place).read.py_func


@_overload(command)
def _command(place: Any, bunch: Any, k: Any, robot: Any, left: Any, right: Any) -> Any:
    return _steps(place).command.py_func


@_overload(show)
def _show(place: Any, worlds: Any, bunch: Any, k: Any, robot: Any, state: Any) -> Any:
    return _steps(place).show.py_func
