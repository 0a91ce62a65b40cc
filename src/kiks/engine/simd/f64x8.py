"""Vectors of eight float64 numbers: the rays of a sensor, or the robots of eight worlds.

Need: the compiler unrolls a loop over seven or eight rays, and does not turn the unrolled code into vector code.
Method: a type of its own, `Lanes`, with the operators + - * /, square roots and choices. Each is one instruction for
eight numbers, or two or four on older processors, with the roundings of the scalar one; so the bits are the same.
`floor`, `abs`, `min`, `max` and `lane_of` are for a number as well: what is written with them and with
`kiks.engine.simd.masks` is compiled for one number and for eight.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils, typeconv
from numba.core.typing import templates
from numba.extending import models
from numba.np import arrayobj

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_overloads: Any = extending.overload
_insert_function: Any = cgutils.get_or_insert_function
_arrays: Any = arrayobj
_typeconv: Any = typeconv
_templates: Any = templates
_lower_cast: Any = extending.lower_cast


class Lanes(types.Type):  # type: ignore[misc, unused-ignore]
    """Numba's type of eight float64 numbers that are calculated with together."""

    element = types.float64

    def __init__(self) -> None:
        super().__init__(name="Lanes")

    def can_convert_from(self, typing: Any, other: Any) -> Any:
        """Say that a number may stand for eight times itself."""
        return _typeconv.Conversion.safe if isinstance(other, types.Number) else None


LANES = 8
"""SIMD width: seven rays plus one padding lane; as wide as the widest vector registers."""

_LANES = Lanes()
_INTEGER = ir.IntType(32)
_VECTOR, _INTEGERS = ir.VectorType(ir.DoubleType(), LANES), ir.VectorType(_INTEGER, LANES)


@extending.register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _VECTOR)  # type: ignore[no-untyped-call, unused-ignore]


def _splat(builder: Any, value: Any) -> Any:
    """Return a vector of one number, unless it is a vector already."""
    if value.type == _VECTOR:
        return value
    if isinstance(value.type, ir.IntType):
        value = builder.sitofp(value, ir.DoubleType())
    filled = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(LANES):
        filled = builder.insert_element(filled, value, ir.Constant(_INTEGER, lane))
    return filled


def are_lanes(*kinds: Any) -> bool:
    """Return whether these types are `Lanes` and numbers, one of them at least `Lanes`."""
    return all(isinstance(kind, Lanes | types.Number) for kind in kinds) and _LANES in kinds


@_lower_cast(types.Number, Lanes)
def _widen(context: Any, builder: Any, kind: Any, lanes: Any, value: Any) -> Any:
    """Let a number stand for eight times itself."""
    return _splat(builder, context.cast(builder, value, kind, types.float64))


def offer(symbol: Any, define: Any, fits: Callable[..., bool]) -> None:
    """Let kernels write a function or an operator for arguments of types that fit.

    Numba's own way, `overload`, would compile each pair of types as a function of its own, a tenth of a second each.

    Args:
        symbol: The function or operator.
        define: A function as `numba.extending.intrinsic` takes it.
        fits: Whether it is for these types of arguments.
    """

    @functools.wraps(define)
    def definition(typing: Any, *kinds: Any) -> Any:
        return define(typing, *kinds) if fits(*kinds) else None

    template = _templates.make_intrinsic_template(symbol, definition, define.__name__)
    _templates.infer_global(symbol, types.Function(template))


def _arithmetic(operation: str) -> Any:
    """Return what calculates with two sets of lanes, or one and a number."""

    def calculate(typing: Any, first: Any, second: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return getattr(builder, operation)(*(_splat(builder, value) for value in arguments))

        return _LANES(first, second), generate

    return calculate


for _operation, *_symbols in (
    ("fadd", operator.add, operator.iadd),
    ("fsub", operator.sub, operator.isub),
    ("fmul", operator.mul, operator.imul),
    ("fdiv", operator.truediv, operator.itruediv),
):
    for _symbol in _symbols:
        offer(_symbol, _arithmetic(_operation), are_lanes)


def _function(name: str) -> Any:
    """Return what calculates one number from one, or eight from eight."""

    def calculate(typing: Any, value: Any) -> Any:
        result = _LANES if isinstance(value, Lanes) else types.float64

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            number = context.cast(builder, arguments[0], value, result)
            suffix = f"v{LANES}f64" if result == _LANES else "f64"
            kind = ir.FunctionType(number.type, [number.type])
            return builder.call(_insert_function(builder.module, kind, f"llvm.{name}.{suffix}"), [number])

        return result(value), generate

    return calculate


floor = _intrinsic(_function("floor"))
"""The greatest whole number that is not above a number, as a float64, or those of eight."""

root = _intrinsic(_function("sqrt"))
"""The square root of a number, or those of eight."""

offer(abs, _function("fabs"), are_lanes)


def _negative(typing: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fneg(arguments[0])

    return _LANES(lanes), generate


offer(operator.neg, _negative, are_lanes)


def _extreme(comparison: str) -> Any:
    """Return what calculates `min` or `max`: of two that are equal the first, as it is with numbers."""

    def calculate(typing: Any, first: Any, second: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            one, other = (_splat(builder, value) for value in arguments)
            return builder.select(builder.fcmp_ordered(comparison, other, one), other, one)

        return _LANES(first, second), generate

    return calculate


offer(min, _extreme("<"), are_lanes)
offer(max, _extreme(">"), are_lanes)


@_intrinsic
def load(typing: Any, array: Any) -> Any:
    """Return the first eight numbers of an array without gaps."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = _arrays.make_array(array)(context, builder, arguments[0]).data
        return builder.load(builder.bitcast(data, _VECTOR.as_pointer()), align=8)

    return _LANES(array), generate


@_intrinsic
def store(typing: Any, array: Any, lanes: Any) -> Any:
    """Write eight numbers to the beginning of an array without gaps."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = _arrays.make_array(array)(context, builder, arguments[0]).data
        builder.store(_splat(builder, arguments[1]), builder.bitcast(data, _VECTOR.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(array, lanes), generate


@_intrinsic
def splat(typing: Any, number: Any) -> Any:
    """Return eight times a number."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _splat(builder, arguments[0])

    return _LANES(number), generate


@_intrinsic
def where_less(typing: Any, first: Any, second: Any, then: Any, otherwise: Any) -> Any:
    """Return `then` in lanes in which the first is less than the second, and `otherwise` in the others."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first, second, then, otherwise = (_splat(builder, value) for value in arguments)
        return builder.select(builder.fcmp_ordered("<", first, second), then, otherwise)

    return _LANES(first, second, then, otherwise), generate


@_intrinsic
def lane_of(typing: Any, lanes: Any, index: Any) -> Any:
    """Return one of the numbers; of a number alone, that."""
    element = getattr(lanes, "element", None)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.extract_element(*arguments) if element else arguments[0]

    return (element or lanes)(lanes, types.int64), generate


@_intrinsic
def with_lane(typing: Any, lanes: Any, index: Any, number: Any) -> Any:
    """Return the numbers with another one in a lane; for a number alone, the other one."""
    element = getattr(lanes, "element", None)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        before, lane, other = arguments
        return builder.insert_element(before, other, lane) if element else other

    return lanes(lanes, types.int64, element or lanes), generate


@_intrinsic
def greatest(typing: Any, lanes: Any) -> Any:
    """Return the greatest of the numbers; of a number alone, that."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if not isinstance(lanes, Lanes):
            return arguments[0]
        found = builder.extract_element(arguments[0], ir.Constant(_INTEGER, 0))
        for lane in range(1, LANES):
            other = builder.extract_element(arguments[0], ir.Constant(_INTEGER, lane))
            found = builder.select(builder.fcmp_ordered(">", other, found), other, found)
        return found

    return (types.float64 if isinstance(lanes, Lanes) else lanes)(lanes), generate


def _cells(builder: Any, places: Any, count: Any) -> Any:
    """Return the cells that contain places along an axis of `count` cells; beyond its ends, the outermost cell."""
    nought, last = ir.Constant(_VECTOR, [0.0] * LANES), _splat(builder, builder.sub(count, ir.Constant(count.type, 1)))
    # NaN is not above 0, and becomes 0.
    places = builder.select(builder.fcmp_ordered(">", places, nought), places, nought)
    places = builder.select(builder.fcmp_ordered("<", places, last), places, last)
    return builder.fptosi(places, _INTEGERS)


@_intrinsic
def _pick(typing: Any, raster: Any, columns: Any, rows: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = _arrays.make_array(raster)(context, builder, arguments[0])
        height, width = (builder.extract_value(array.shape, axis) for axis in range(2))
        columns, rows = _cells(builder, arguments[1], width), _cells(builder, arguments[2], height)
        found = ir.Constant(_VECTOR, ir.Undefined)
        for lane in range(LANES):
            number = ir.Constant(_INTEGER, lane)
            row = builder.mul(builder.extract_element(rows, number), builder.trunc(width, _INTEGER))
            place = builder.add(row, builder.extract_element(columns, number))
            value = builder.load(builder.gep(array.data, [place], inbounds=True))
            convert = builder.fpext if raster.dtype == types.float32 else builder.sitofp
            found = builder.insert_element(found, convert(value, ir.DoubleType()), number)
        return found

    return _LANES(raster, columns, rows), generate


def pick(raster: Any, column: Any, row: Any) -> Any:
    """Return the number of a raster, float32 or int16, at a place [cells], or lanes of them; beyond it, the nearest."""
    raise NotImplementedError("it is for kernels")


@_overloads(pick)
def _overload_pick(raster: Any, column: Any, row: Any) -> Any:
    def at_one(raster: Any, column: Any, row: Any) -> Any:
        i = np.int64(min(max(0.0, column), raster.shape[1] - 1.0))
        j = np.int64(min(max(0.0, row), raster.shape[0] - 1.0))
        return np.float64(raster[j, i])

    def at_eight(raster: Any, column: Any, row: Any) -> Any:
        return _pick(raster, column, row)

    return at_eight if isinstance(column, Lanes) else at_one


@_intrinsic
def _corners(typing: Any, raster: Any, columns: Any, rows: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = _arrays.make_array(raster)(context, builder, arguments[0])
        width = builder.trunc(builder.extract_value(array.shape, 1), _INTEGER)
        columns, rows = (builder.fptosi(each, _INTEGERS) for each in arguments[1:])
        filled = ir.Constant(_INTEGERS, ir.Undefined)
        for lane in range(LANES):
            filled = builder.insert_element(filled, width, ir.Constant(_INTEGER, lane))
        places = builder.add(builder.mul(rows, filled), columns)
        pair, pairs = ir.IntType(64), ir.VectorType(ir.IntType(64), LANES)
        lower = array.data
        upper = builder.gep(array.data, [width], inbounds=True)
        found = []
        for begin in (lower, upper):
            taken = ir.Constant(pairs, ir.Undefined)
            for lane in range(LANES):
                number = ir.Constant(_INTEGER, lane)
                place = builder.gep(begin, [builder.extract_element(places, number)], inbounds=True)
                both = builder.load(builder.bitcast(place, pair.as_pointer()), align=4)
                taken = builder.insert_element(taken, both, number)
            singles = builder.bitcast(taken, ir.VectorType(ir.FloatType(), 2 * LANES))
            for side in range(2):
                order = ir.Constant(_INTEGERS, [2 * lane + side for lane in range(LANES)])
                found.append(builder.fpext(builder.shuffle_vector(singles, singles, order), _VECTOR))
        return context.make_tuple(builder, signature.return_type, found)

    four: Any = types.UniTuple
    return four(_LANES, 4)(raster, columns, rows), generate


def corners(raster: Any, column: Any, row: Any) -> Any:
    """Return four numbers of a raster: at a cell, to the right of it, above it, and above that; or lanes of them."""
    raise NotImplementedError("it is for kernels")


@_overloads(corners)
def _overload_corners(raster: Any, column: Any, row: Any) -> Any:
    def at_one(raster: Any, column: Any, row: Any) -> Any:
        i, j = np.int64(column), np.int64(row)
        lower, upper = (raster[j, i], raster[j, i + 1]), (raster[j + 1, i], raster[j + 1, i + 1])
        return np.float64(lower[0]), np.float64(lower[1]), np.float64(upper[0]), np.float64(upper[1])

    def at_eight(raster: Any, column: Any, row: Any) -> Any:
        return _corners(raster, column, row)

    return at_eight if isinstance(column, Lanes) else at_one
