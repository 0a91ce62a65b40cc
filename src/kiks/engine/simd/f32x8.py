"""Vectors of eight float32 numbers, for the steps of a sensor's rays.

Need: steps of rays take most of the time of a reading. A step only has to find the right cell; the distance to it is
calculated once, at the end, in float64. Most processors calculate with eight float32 numbers in one instruction.
Method: a type of its own, `Narrow`, beside `Lanes` of `kiks.engine.simd.f64x8`. Places are counted from the cell that a
ray begins in, so that float32 holds them to a millionth of a cell; look-ups are bare loads that nothing checks.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.extending import models
from numba.np import arrayobj

from kiks.engine.simd.f64x8 import LANES, Lanes, offer
from kiks.model.raster import FACE_BITS, FACE_UNITS

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_insert_function: Any = cgutils.get_or_insert_function
_arrays: Any = arrayobj


class Narrow(types.Type):  # type: ignore[misc, unused-ignore]
    """Numba's type of eight float32 numbers that are calculated with together."""

    def __init__(self) -> None:
        super().__init__(name="Narrow")


_NARROW, _WIDE = Narrow(), Lanes()
_INTEGER = ir.IntType(32)
_FLOAT, _DOUBLE = ir.FloatType(), ir.DoubleType()
_VECTOR, _DOUBLES = ir.VectorType(_FLOAT, LANES), ir.VectorType(_DOUBLE, LANES)
_INTEGERS = ir.VectorType(_INTEGER, LANES)
_ADDRESS = ir.IntType(64)
_ADDRESSES, _POINTERS = ir.VectorType(_ADDRESS, LANES), ir.VectorType(_INTEGER.as_pointer(), LANES)


@extending.register_model(Narrow)
class _NarrowModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _VECTOR)  # type: ignore[no-untyped-call, unused-ignore]


def _filled(builder: Any, kind: Any, value: Any) -> Any:
    """Return a vector of one value."""
    filled = ir.Constant(kind, ir.Undefined)
    for lane in range(LANES):
        filled = builder.insert_element(filled, value, ir.Constant(_INTEGER, lane))
    return filled


def _splat(builder: Any, value: Any) -> Any:
    """Return a vector of one number, rounded to float32, unless it is a vector already."""
    if value.type == _VECTOR:
        return value
    return _filled(builder, _VECTOR, builder.fptrunc(value, _FLOAT) if value.type == _DOUBLE else value)


def _are_narrow(*kinds: Any) -> bool:
    return all(isinstance(kind, Narrow | types.Float) for kind in kinds) and _NARROW in kinds


def _arithmetic(operation: str) -> Any:
    """Return what calculates with two sets of eight, or one and a number."""

    def calculate(typing: Any, first: Any, second: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return getattr(builder, operation)(*(_splat(builder, value) for value in arguments))

        return _NARROW(first, second), generate

    return calculate


for _symbol, _operation in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    offer(_symbol, _arithmetic(_operation), _are_narrow)


@_intrinsic
def narrow(typing: Any, lanes: Any) -> Any:
    """Return `Lanes`, or eight times a number, rounded to float32."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(lanes, Lanes):
            return builder.fptrunc(arguments[0], _VECTOR)
        return _splat(builder, arguments[0])

    return _NARROW(lanes), generate


@_intrinsic
def widen(typing: Any, numbers: Any) -> Any:
    """Return the same numbers as `Lanes`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fpext(arguments[0], _DOUBLES)

    return _WIDE(numbers), generate


def _at(context: Any, builder: Any, array: Any, arguments: Any) -> Any:
    """Return the address of eight numbers of an array without gaps."""
    data = _arrays.make_array(array)(context, builder, arguments[0]).data
    return builder.bitcast(builder.gep(data, [arguments[1]], inbounds=True), _VECTOR.as_pointer())


@_intrinsic
def load_narrow(typing: Any, array: Any, first: Any) -> Any:
    """Return eight numbers of a float32 array without gaps, from a place on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_at(context, builder, array, arguments), align=4)

    return _NARROW(array, types.int64), generate


@_intrinsic
def store_narrow(typing: Any, array: Any, first: Any, numbers: Any) -> Any:
    """Write eight numbers into a float32 array without gaps, from a place on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _at(context, builder, array, arguments), align=4)
        return context.get_dummy_value()

    return types.void(array, types.int64, numbers), generate


@_intrinsic
def whole(typing: Any, numbers: Any) -> Any:
    """Return the greatest whole numbers that are not above these."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        return builder.call(_insert_function(builder.module, kind, f"llvm.floor.v{LANES}f32"), arguments)

    return _NARROW(numbers), generate


@_intrinsic
def if_less(typing: Any, first: Any, second: Any, then: Any, otherwise: Any) -> Any:
    """Return `then` in lanes in which the first is less than the second, and `otherwise` in the others."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first, second, then, otherwise = (_splat(builder, value) for value in arguments)
        return builder.select(builder.fcmp_ordered("<", first, second), then, otherwise)

    return _NARROW(first, second, then, otherwise), generate


@_intrinsic
def count_any(typing: Any, numbers: Any) -> Any:
    """Return 1 if a number is above 0, else 0."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nought = ir.Constant(_VECTOR, [0.0] * LANES)
        bits = builder.bitcast(builder.fcmp_ordered(">", arguments[0], nought), ir.IntType(LANES))
        is_any = builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))
        return builder.zext(is_any, ir.IntType(64))

    return types.int64(numbers), generate


def _looked_up(context: Any, builder: Any, raster: Any, arguments: Any) -> Any:
    """Return a vector of the cells of a raster without gaps that `look_up` names."""
    array = _arrays.make_array(raster)(context, builder, arguments[0])
    width = builder.trunc(builder.extract_value(array.shape, 1), _INTEGER)
    origin = builder.trunc(arguments[1], _INTEGER)
    columns, rows = (builder.fptosi(places, _INTEGERS) for places in arguments[2:4])
    cells = builder.add(builder.mul(rows, _filled(builder, _INTEGERS, width)), columns)
    cells = builder.add(cells, _filled(builder, _INTEGERS, origin))
    element = context.get_data_type(raster.dtype)
    found = ir.Constant(ir.VectorType(element, LANES), ir.Undefined)
    for lane in range(LANES):
        number = ir.Constant(_INTEGER, lane)
        # A raster has less than 2^31 cells, none before the first: no sign to be kept.
        place = builder.zext(builder.extract_element(cells, number), ir.IntType(64))
        found = builder.insert_element(found, builder.load(builder.gep(array.data, [place], inbounds=True)), number)
    return found


@_intrinsic
def look_up(typing: Any, raster: Any, origin: Any, columns: Any, rows: Any) -> Any:
    """Return numbers of a raster without gaps; nothing checks that they lie within it.

    Args:
        typing: Numba's own.
        raster: int16, shape [rows, columns].
        origin: Number of the cell that columns and rows are counted from.
        columns: Whole numbers, `Narrow`.
        rows: Whole numbers, `Narrow`.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.sitofp(_looked_up(context, builder, raster, arguments), _VECTOR)

    return _NARROW(raster, types.int64, columns, rows), generate


@_intrinsic
def faces_at(typing: Any, faces: Any, origin: Any, columns: Any, rows: Any) -> Any:
    """Return the three parts of `kiks.model.arena.Arena.faces` at cells, named as in `look_up`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        packed = _looked_up(context, builder, faces, arguments)
        above, parts = 0, []
        for bits, units in zip(FACE_BITS, FACE_UNITS, strict=True):
            left, right = (ir.Constant(_INTEGERS, [count] * LANES) for count in (above, 32 - bits))
            part = builder.sitofp(builder.ashr(builder.shl(packed, left), right), _VECTOR)
            parts.append(builder.fmul(part, ir.Constant(_VECTOR, [1.0 / units] * LANES)))
            above += bits
        return context.make_tuple(builder, signature.return_type, parts)

    three: Any = types.UniTuple
    return three(_NARROW, 3)(faces, types.int64, columns, rows), generate


@_intrinsic
def total(typing: Any, numbers: Any) -> Any:
    """Return the sum of eight numbers, `Narrow` or `Lanes`: of pairs four lanes apart, then two, then one."""
    element = types.float32 if isinstance(numbers, Narrow) else types.float64

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        sums, count = arguments[0], LANES
        while count > 1:
            count //= 2
            halves = (
                ir.Constant(ir.VectorType(_INTEGER, count), [first + k for k in range(count)]) for first in (0, count)
            )
            sums = builder.fadd(*(builder.shuffle_vector(sums, sums, half) for half in halves))
        return builder.extract_element(sums, ir.Constant(_INTEGER, 0))

    return element(numbers), generate
