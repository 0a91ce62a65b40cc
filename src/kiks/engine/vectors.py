"""Eight numbers at once: what the rays of a sensor are calculated with, in vector code on every processor.

Need: a loop over seven or eight rays the compiler unrolls, and what comes of that it no longer turns into vector code.
Method: a type of its own, `Lanes`, with the operators + - * /, square roots and choices. Each is one instruction for
eight numbers, or two or four on older processors, with the roundings of the scalar one; so the bits are the same.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.extending import models
from numba.np import arrayobj

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_overloads: Any = extending.overload
_insert_function: Any = cgutils.get_or_insert_function
_arrays: Any = arrayobj


class Lanes(types.Type):  # type: ignore[misc, unused-ignore]
    """Numba's type of eight float64 numbers that are calculated with together."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


LANES = 8
"""How many they are: as many as the widest vectors hold; the rays of a proximity sensor, and one over."""

_LANES = Lanes()
_INTEGER = ir.IntType(32)
_VECTOR, _INTEGERS = ir.VectorType(ir.DoubleType(), LANES), ir.VectorType(_INTEGER, LANES)


@extending.register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _VECTOR)  # type: ignore[no-untyped-call, unused-ignore]


def _splat(builder: Any, value: Any) -> Any:
    """Return a vector of one value, unless it is a vector already."""
    if value.type == _VECTOR:
        return value
    filled = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(LANES):
        filled = builder.insert_element(filled, value, ir.Constant(_INTEGER, lane))
    return filled


def _arithmetic(operation: str) -> Any:
    """Return an intrinsic that calculates with two sets of lanes, or one and a number."""

    @_intrinsic
    def calculate(typing: Any, first: Any, second: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return getattr(builder, operation)(*(_splat(builder, value) for value in arguments))

        return _LANES(first, second), generate

    return calculate


def _overload(symbol: Any, operation: str) -> None:
    """Let kernels write an operator for it."""
    calculate = _arithmetic(operation)

    def write(first: Any, second: Any) -> Any:
        return calculate(first, second)

    @_overloads(symbol)
    def operate(first: Any, second: Any) -> Any:
        kinds = (Lanes, types.Float)
        fits = isinstance(first, kinds) and isinstance(second, kinds)
        return write if fits and _LANES in (first, second) else None


for _symbol, _operation in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _overload(_symbol, _operation)


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
def root(typing: Any, lanes: Any) -> Any:
    """Return square roots."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        return builder.call(_insert_function(builder.module, kind, f"llvm.sqrt.v{LANES}f64"), arguments)

    return _LANES(lanes), generate


@_intrinsic
def where_less(typing: Any, first: Any, second: Any, then: Any, otherwise: Any) -> Any:
    """Return `then` in lanes in which the first is less than the second, and `otherwise` in the others."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first, second, then, otherwise = (_splat(builder, value) for value in arguments)
        return builder.select(builder.fcmp_ordered("<", first, second), then, otherwise)

    return _LANES(first, second, then, otherwise), generate


@_intrinsic
def lane_of(typing: Any, lanes: Any, index: Any) -> Any:
    """Return one of the numbers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.extract_element(arguments[0], arguments[1])

    return types.float64(lanes, types.int64), generate


def _cells(builder: Any, places: Any, count: Any) -> Any:
    """Return the cells that places along an axis are in, of so many; beyond the ends, the outermost."""
    cells = builder.fptosi(places, _INTEGERS)
    last = builder.sub(builder.trunc(count, _INTEGER), ir.Constant(_INTEGER, 1))
    filled = ir.Constant(_INTEGERS, ir.Undefined)
    for lane in range(LANES):
        filled = builder.insert_element(filled, last, ir.Constant(_INTEGER, lane))
    nought = ir.Constant(_INTEGERS, [0] * LANES)
    cells = builder.select(builder.icmp_signed("<", cells, nought), nought, cells)
    return builder.select(builder.icmp_signed("<", cells, filled), cells, filled)


@_intrinsic
def cells_of(typing: Any, places: Any, count: Any) -> Any:
    """Return the cells that places along an axis are in, of so many [cells]; beyond the ends, the outermost."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.sitofp(_cells(builder, *arguments), _VECTOR)

    return _LANES(places, types.int64), generate


@_intrinsic
def pick(typing: Any, raster: Any, columns: Any, rows: Any) -> Any:
    """Return the numbers of a raster, float32 or uint8 without gaps, at some places [cells]; beyond it, the nearest."""

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
            widen = builder.fpext if raster.dtype == types.float32 else builder.uitofp
            found = builder.insert_element(found, widen(value, ir.DoubleType()), number)
        return found

    return _LANES(raster, columns, rows), generate


@_intrinsic
def is_any(typing: Any, lanes: Any) -> Any:
    """Say whether a number is above 0."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nought = ir.Constant(_VECTOR, [0.0] * LANES)
        bits = builder.bitcast(builder.fcmp_ordered(">", arguments[0], nought), ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))

    return types.boolean(lanes), generate
