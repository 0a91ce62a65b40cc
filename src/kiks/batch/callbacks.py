"""Controllers and measures as the loop of a batch calls them: machine code at an address.

Compiling the loop with the whole engine in it takes half a minute. A new controller or another choice of measures must
not cost that again. So the loop is compiled once, stays in the cache, and calls functions by address. Each measure is
compiled by itself. For a controller, a small function around it is compiled, which the loop calls once per bunch of
worlds.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numba import types
from numba.core.errors import NumbaError
from numba.np.numpy_support import from_dtype
from numpy.typing import NDArray

from kiks.control.compiled_function import address_of, caller_of
from kiks.control.controller import Controller
from kiks.control.measure import Measure, Moment
from kiks.engine.compiling import callable_kernel
from kiks.engine.state import BODY

_types: Any = types


def _array(element: Any, dimensions: int) -> Any:
    return types.Array(element, dimensions, "C")


_EACH, _ROW, _NUMBER = _array(types.float64, 3), _array(types.float64, 1), types.float64

DECIDER = (_array(types.int64, 1), _array(types.boolean, 1), _EACH, _EACH, _EACH, _EACH)
"""Types of indices of worlds [W], their mask [W], and sensors, memory, parameters and wheels of all worlds."""

_MOMENT = (
    *(_NUMBER, _NUMBER, _ROW, _ROW, *(_NUMBER,) * 7, types.boolean),
    *(_array(from_dtype(BODY), 1), _array(types.float64, 2)),
)
MEASURE = (_types.NamedTuple(_MOMENT, Moment), _ROW)
"""Types of a moment and notes."""

call_decider, call_measure = caller_of(DECIDER), caller_of(MEASURE)


@functools.lru_cache(maxsize=256)
def decider_of(controller: Controller) -> Any:
    """Return the kernel that calls a controller for all robots of a bunch; its address is valid while the kernel lives.

    Raises:
        ParameterError: If Numba cannot compile the controller.
    """
    decide = controller.kernel

    @callable_kernel
    def decide_all(numbers: Any, is_on: Any, sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        for k in range(numbers.shape[0]):
            if is_on[k]:
                world = numbers[k]
                for robot in range(sensors.shape[1]):
                    decide(sensors[world, robot], memory[world, robot], parameters[world, robot], wheels[world, robot])

    try:
        address_of(decide_all, DECIDER)
    except NumbaError as error:
        raise controller.refused(error) from None
    return decide_all


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
