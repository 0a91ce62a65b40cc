"""Looking up cells of rasters, for eight rays or places at the same time.

Method: numbers of cells are calculated in lanes, and each cell is a bare load that nothing checks. `pick` keeps places
within the raster; for the other functions, the caller does.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.np import arrayobj

from kiks.engine.simd.lanes import F32X8, F64X8, LANES, filled
from kiks.model.raster import FACE_BITS, FACE_UNITS

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_overloads: Any = extending.overload
_arrays: Any = arrayobj
_tuple_of: Any = types.UniTuple

_INTEGER, _WORD = ir.IntType(32), ir.IntType(64)
_INTEGERS = ir.VectorType(_INTEGER, LANES)


def _cells(builder: Any, width: Any, columns: Any, rows: Any) -> Any:
    """Return the numbers of cells from columns and rows, lanes of floats."""
    columns, rows = (builder.fptosi(places, _INTEGERS) for places in (columns, rows))
    return builder.add(builder.mul(rows, filled(builder, _INTEGERS, builder.trunc(width, _INTEGER))), columns)


def _gather(builder: Any, data: Any, cells: Any, content: Any, align: Any = None) -> Any:
    """Return a vector of what stands at cells of a raster."""
    found = ir.Constant(ir.VectorType(content, LANES), ir.Undefined)
    for lane in range(LANES):
        number = ir.Constant(_INTEGER, lane)
        # A raster has less than 2^31 cells, none before the first: no sign to be kept.
        place = builder.gep(data, [builder.zext(builder.extract_element(cells, number), _WORD)], inbounds=True)
        value = builder.load(builder.bitcast(place, content.as_pointer()), align=align)
        found = builder.insert_element(found, value, number)
    return found


def _within(builder: Any, places: Any, count: Any) -> Any:
    """Return places along an axis of `count` cells; those beyond its ends are in the outermost cells."""
    nought, last = ir.Constant(F64X8.vector, [0.0] * LANES), builder.sub(count, ir.Constant(count.type, 1))
    last = filled(builder, F64X8.vector, builder.sitofp(last, ir.DoubleType()))
    # NaN is not above 0, and becomes 0.
    places = builder.select(builder.fcmp_ordered(">", places, nought), places, nought)
    return builder.select(builder.fcmp_ordered("<", places, last), places, last)


@_intrinsic
def _pick(typing: Any, raster: Any, columns: Any, rows: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = _arrays.make_array(raster)(context, builder, arguments[0])
        height, width = (builder.extract_value(array.shape, axis) for axis in range(2))
        columns, rows = _within(builder, arguments[1], width), _within(builder, arguments[2], height)
        found = _gather(builder, array.data, _cells(builder, width, columns, rows), context.get_data_type(raster.dtype))
        return (builder.fpext if raster.dtype == types.float32 else builder.sitofp)(found, F64X8.vector)

    return F64X8(raster, columns, rows), generate


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

    return at_eight if column == F64X8 else at_one


@_intrinsic
def _corners(typing: Any, raster: Any, columns: Any, rows: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = _arrays.make_array(raster)(context, builder, arguments[0])
        width = builder.extract_value(array.shape, 1)
        cells, found = _cells(builder, width, *arguments[1:]), []
        for data in (array.data, builder.gep(array.data, [width], inbounds=True)):
            pairs = _gather(builder, data, cells, _WORD, align=4)
            singles = builder.bitcast(pairs, ir.VectorType(ir.FloatType(), 2 * LANES))
            for side in range(2):
                order = ir.Constant(_INTEGERS, [2 * lane + side for lane in range(LANES)])
                found.append(builder.fpext(builder.shuffle_vector(singles, singles, order), F64X8.vector))
        return context.make_tuple(builder, signature.return_type, found)

    return _tuple_of(F64X8, 4)(raster, columns, rows), generate


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

    return at_eight if column == F64X8 else at_one


def _looked_up(context: Any, builder: Any, raster: Any, arguments: Any) -> Any:
    """Return a vector of the cells of a raster without gaps that `look_up` names."""
    array = _arrays.make_array(raster)(context, builder, arguments[0])
    origin = filled(builder, _INTEGERS, builder.trunc(arguments[1], _INTEGER))
    cells = builder.add(_cells(builder, builder.extract_value(array.shape, 1), *arguments[2:]), origin)
    return _gather(builder, array.data, cells, context.get_data_type(raster.dtype))


@_intrinsic
def look_up(typing: Any, raster: Any, origin: Any, columns: Any, rows: Any) -> Any:
    """Return numbers of a raster without gaps; nothing checks that they lie within it.

    Args:
        typing: Numba's own.
        raster: int16, shape [rows, columns].
        origin: Number of the cell that columns and rows are counted from.
        columns: Whole numbers, `F32X8`.
        rows: Whole numbers, `F32X8`.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.sitofp(_looked_up(context, builder, raster, arguments), F32X8.vector)

    return F32X8(raster, types.int64, columns, rows), generate


@_intrinsic
def faces_at(typing: Any, faces: Any, origin: Any, columns: Any, rows: Any) -> Any:
    """Return the three parts of `kiks.model.arena.Arena.faces` at cells, named as in `look_up`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        packed = _looked_up(context, builder, faces, arguments)
        above, parts = 0, []
        for bits, units in zip(FACE_BITS, FACE_UNITS, strict=True):
            left, right = (ir.Constant(_INTEGERS, [count] * LANES) for count in (above, 32 - bits))
            part = builder.sitofp(builder.ashr(builder.shl(packed, left), right), F32X8.vector)
            parts.append(builder.fmul(part, ir.Constant(F32X8.vector, [1.0 / units] * LANES)))
            above += bits
        return context.make_tuple(builder, signature.return_type, parts)

    return _tuple_of(F32X8, 3)(faces, types.int64, columns, rows), generate
