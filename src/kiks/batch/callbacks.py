"""Controllers and measures as the loop of a batch calls them: machine code at an address.

Compiling the loop with the whole engine in it takes half a minute. A new controller or another choice of measures must
not cost that again. So the loop is compiled once, stays in the cache, and calls functions by address. Each measure is
compiled by itself. For a controller, a small function around it is compiled, which the loop calls once per bunch of
worlds.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from itertools import groupby
from typing import Any

from kiks.engine.compiling import callable_kernel

# isort: split
import numpy as np
from numba import types
from numba.core.errors import NumbaError
from numba.np.numpy_support import from_dtype
from numpy.typing import NDArray

from kiks.control.compiled_function import address_of, caller_of
from kiks.control.controller import Controller
from kiks.control.measure import Measure, Moment
from kiks.engine.state import BODY

_types: Any = types


def _array(element: Any, dimensions: int) -> Any:
    return types.Array(element, dimensions, "C")


_EACH, _ROW, _NUMBER = _array(types.float64, 3), _array(types.float64, 1), types.float64

_INTEGERS = _array(types.int64, 1)

DECIDER = (_INTEGERS, _INTEGERS, _array(types.boolean, 1), _EACH, _EACH, _EACH, _EACH)
"""Types of a row of `deciders_of`, indices of worlds [W], their mask [W], and sensors, memory, parameters and wheels of
all worlds."""

_MOMENT = (
    *(_NUMBER, _NUMBER, _ROW, _ROW, *(_NUMBER,) * 7, types.boolean),
    *(_array(from_dtype(BODY), 1), _array(types.float64, 2), types.int64, _array(types.float64, 2)),
)
MEASURE = (_types.NamedTuple(_MOMENT, Moment), _ROW)
"""Types of a moment and notes."""

call_decider, call_measure = caller_of(DECIDER), caller_of(MEASURE)


@functools.lru_cache(maxsize=256)
def decider_of(controller: Controller) -> Any:
    """Return the kernel that calls a controller for its robots in all worlds of a bunch.

    Raises:
        ParameterError: If Numba cannot compile the controller.
    """
    decide, sensor_count, memory_count = controller.kernel, controller.sensor_count, controller.memory_count

    @callable_kernel
    def decide_all(row: Any, numbers: Any, is_on: Any, sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        for k in range(numbers.shape[0]):
            if is_on[k]:
                world = numbers[k]
                for robot in range(row[1], row[2]):
                    decide(
                        sensors[world, robot, :sensor_count],
                        memory[world, robot, :memory_count],
                        parameters[world, robot, : row[3]],
                        wheels[world, robot],
                    )

    try:
        address_of(decide_all, DECIDER)
    except NumbaError as error:
        raise controller.refused(error) from None
    return decide_all


NO_DECIDERS = np.zeros((0, 4), np.int64)
"""The rows of `deciders_of` where no controller decides."""


def deciders_of(controllers: Sequence[Controller], parameter_counts: Sequence[int]) -> NDArray[np.int64]:
    """Return the kernels that decide for the robots of a world, int64 [run, 4].

    Each row has the address of a kernel, the first of its robots, the end of them, and their number of parameters.
    Neighbours with the same controller and number of parameters share a row. An address is valid while `decider_of`
    keeps its kernel.

    Args:
        controllers: The controller of each robot.
        parameter_counts: The number of parameters of each robot.

    Raises:
        ParameterError: If Numba cannot compile a controller.
    """
    rows, first = [], 0
    for (controller, parameter_count), run in groupby(zip(controllers, parameter_counts, strict=True)):
        end = first + len(list(run))
        rows.append((address_of(decider_of(controller), DECIDER), first, end, parameter_count))
        first = end
    return np.array(rows, np.int64)


def watchers_of(measures: tuple[Measure, ...]) -> NDArray[np.int64]:
    """Return the address of each measure and the range of its notes, int64 [measure, 3]: address, begin, end.

    Raises:
        ParameterError: If Numba cannot compile a measure.
    """
    watchers, begin = np.zeros((len(measures), 3), np.int64), 0
    for each, row in zip(measures, watchers, strict=True):
        try:
            row[:] = address_of(each.kernel, MEASURE), begin, begin + each.note_count
        except NumbaError as error:
            raise each.refused(error) from None
        begin += each.note_count
    return watchers
