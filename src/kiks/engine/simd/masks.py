"""Choices without a jump: one source for a number and for eight, with a yes or no or with eight of them.

Need: a formula with a condition in it, compiled for a number, decides by a boolean; compiled for eight, each lane
decides for itself.
Method: comparisons of lanes give a `MASK`, with the operators & | and !=; `choose` and `opposite` take either. What is
seldom done at all stands under `if anywhere(...)`, and what only one can do under a loop over `lane_count(...)`.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import extending, types

from kiks.engine.simd.lanes import F64X8, LANES, MASK, Lanes, cast_all, filled

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic


_BITS = ir.IntType(LANES)
_MAGIC = 6755399441055744.0  # 1.5 * 2^52: added to a whole number, it leaves that in the lowest bits


def _bits(builder: Any, mask: Any) -> Any:
    """Return a mask as a vector of single bits."""
    return builder.icmp_signed("<", mask, ir.Constant(MASK.vector, [0] * LANES))


def _whole(builder: Any, mask: Any) -> Any:
    """Return a mask as a number of eight bits, the first lane lowest."""
    return builder.bitcast(_bits(builder, mask), _BITS)


def select(builder: Any, mask: Any, then: Any, otherwise: Any) -> Any:
    """Return the instruction that takes one of two vectors in each lane."""
    return builder.select(_bits(builder, mask), then, otherwise)


@_intrinsic
def opposite(typing: Any, condition: Any) -> Any:
    """Return the opposite of a condition: for a boolean, `not`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.not_(arguments[0])

    return condition(condition), generate


@_intrinsic
def choose(typing: Any, condition: Any, then: Any, otherwise: Any) -> Any:
    """Return one of two values, worked out both; each lane of a mask has its own choice."""
    if condition == MASK:
        result = next((kind for kind in (then, otherwise) if isinstance(kind, Lanes)), F64X8)
    else:
        result = typing.unify_types(then, otherwise)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values = cast_all(context, builder, result, arguments[1:], signature.args[1:])
        if condition == MASK:
            return select(builder, arguments[0], *values)
        return builder.select(arguments[0], *values)

    return result(condition, then, otherwise), generate


def _of_all(comparison: str, bits: int) -> Any:
    """Return the intrinsic that compares the lanes of a mask with bits; a boolean stays what it is."""

    @_intrinsic
    def compare(typing: Any, condition: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            if condition != MASK:
                return arguments[0]
            whole = _whole(builder, arguments[0])
            return builder.icmp_unsigned(comparison, whole, ir.Constant(whole.type, bits))

        return types.boolean(condition), generate

    return compare


anywhere = _of_all("!=", 0)
"""Says whether a condition holds in any lane."""

everywhere = _of_all("==", 2**LANES - 1)
"""Says whether a condition holds in all lanes."""


@_intrinsic
def lane_count(typing: Any, condition: Any) -> Any:
    """Return how many lanes a condition has: 8, or 1 if it is a boolean."""
    count = LANES if condition == MASK else 1

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return ir.Constant(ir.IntType(64), count)

    return types.int64(condition), generate


@_intrinsic
def holds(typing: Any, condition: Any, lane: Any) -> Any:
    """Return whether a condition holds in a lane."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if condition != MASK:
            return arguments[0]
        bits = builder.zext(_whole(builder, arguments[0]), ir.IntType(64))
        return builder.trunc(builder.lshr(bits, arguments[1]), ir.IntType(1))

    return types.boolean(condition, types.int64), generate


@_intrinsic
def has_bit(typing: Any, number: Any, bit: Any) -> Any:
    """Return whether a bit is set in a float64 that holds a whole number, negative ones in two's complement."""
    result = MASK if isinstance(number, Lanes) else types.boolean

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value, place = arguments
        if result == types.boolean:
            whole = builder.fptosi(value, ir.IntType(64))
            return builder.trunc(builder.lshr(whole, place), ir.IntType(1))
        shifted = builder.fadd(value, ir.Constant(number.vector, [_MAGIC] * LANES))
        top = filled(builder, MASK.vector, builder.sub(ir.Constant(ir.IntType(64), 63), place))
        bits = builder.shl(builder.bitcast(shifted, MASK.vector), top)
        return builder.ashr(bits, ir.Constant(MASK.vector, [63] * LANES))

    return result(number, types.int64), generate
