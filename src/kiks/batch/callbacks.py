"""Controllers and measures as the loop of a batch calls them: machine code at an address.

Compiling the loop takes some seconds. A new controller or another choice of measures must not cost that again. So the
loop is compiled once, stays in the cache, and calls functions by address. Each measure is compiled by itself. For a
controller, a small function around it is compiled, which the loop calls once per bunch of worlds.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from itertools import groupby
from typing import Any

from kiks.engine.compiling import address_of, callable_kernel

# isort: split
import numpy as np
from numba import extending, types
from numba.core import cgutils
from numba.np import arrayobj
from numba.np.numpy_support import from_dtype
from numpy.typing import NDArray

from kiks.control.compiled_function import caller_of, compiled_for
from kiks.control.controller import ARGUMENTS, Controller
from kiks.control.measure import Moment
from kiks.engine.state import BODY

# Numba annotates these in part, and not as they are used here.
_arrays: Any = arrayobj
_intrinsic: Any = extending.intrinsic
_pack: Any = cgutils.pack_array
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


@_intrinsic
def begin_of(typing: Any, row: Any, count: Any) -> Any:
    """Return the first `count` numbers of a row; since that is a constant, the compiler removes most index checks."""
    if not isinstance(count, types.IntegerLiteral):
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = _arrays.make_array(row)(context, builder, arguments[0])
        array.shape = _pack(builder, [context.get_constant(types.intp, count.literal_value)])
        return _arrays.impl_ret_borrowed(context, builder, row, array._getvalue())

    return row(row, count), generate


@functools.lru_cache(maxsize=256)
def decider_of(controller: Controller, parameter_count: int) -> Any:
    """Return what Numba knows of `decider`, compiled."""
    return compiled_for(decider(controller, parameter_count), DECIDER)


def decider(controller: Controller, parameter_count: int) -> Any:
    """Return what calls a controller, with so many parameters, for its robots in all worlds of a bunch."""
    controller.check((_ROW,) * len(ARGUMENTS))
    decide, sensor_count, memory_count = controller.kernel, controller.sensor_count, controller.memory_count
    output_count = controller.output_count

    @callable_kernel
    def decide_all(row: Any, numbers: Any, is_on: Any, sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        for k in range(numbers.shape[0]):
            if is_on[k]:
                world = numbers[k]
                for robot in range(row[1], row[2]):
                    decide(
                        begin_of(sensors[world, robot], sensor_count),
                        begin_of(memory[world, robot], memory_count),
                        begin_of(parameters[world, robot], parameter_count),
                        begin_of(wheels[world, robot], output_count),
                    )

    return decide_all


NO_DECIDERS = np.zeros((0, 3), np.int64)
"""The rows of `deciders_of` where no controller decides."""


def deciders_of(controllers: Sequence[Controller], parameter_counts: Sequence[int]) -> NDArray[np.int64]:
    """Return the kernels that decide for the robots of a world, int64 [run, 3].

    Each row has the address of a kernel, the first of its robots, and the end of them.
    Neighbours with the same controller and number of parameters share a row. An address is valid while `decider_of`
    keeps its kernel.

    Args:
        controllers: The controller of each robot.
        parameter_counts: The number of parameters of each robot.
    """
    rows, first = [], 0
    for (controller, parameter_count), run in groupby(zip(controllers, parameter_counts, strict=True)):
        end = first + len(list(run))
        rows.append((address_of(decider_of(controller, parameter_count)), first, end))
        first = end
    return np.array(rows, np.int64)
