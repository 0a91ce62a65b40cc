"""Choices without a jump: one source for a number and for eight, with a yes or no or with eight of them.

Need: a formula with a condition in it, compiled for a number, decides by a boolean; compiled for eight, each lane
decides for itself.
Method: comparisons of `Lanes` give a `Mask`, with the operators & | and !=; `choose` and `opposite` take either. What
is seldom done at all stands under `if anywhere(...)`, and what only one can do under a loop over `lane_count(...)`.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.extending import models

from kiks.engine.simd.f64x8 import LANES, Lanes, are_lanes, offer

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic


class Mask(types.Type):  # type: ignore[misc, unused-ignore]
    """Numba's type of eight decisions."""

    def __init__(self) -> None:
        super().__init__(name="Mask")


_MASK, _LANES = Mask(), Lanes()
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_WORDS = ir.VectorType(ir.IntType(64), LANES)
_NOUGHTS, _ONES = ir.Constant(_WORDS, [0] * LANES), ir.Constant(_WORDS, [-1] * LANES)
_MAGIC = 6755399441055744.0  # 1.5 * 2^52: added to a whole number, it leaves that in the lowest bits


@extending.register_model(Mask)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    """As wide as the numbers, all ones for yes: single bits cost conversions on processors without mask registers."""

    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _WORDS)  # type: ignore[no-untyped-call, unused-ignore]


def _bits(builder: Any, mask: Any) -> Any:
    """Return a mask as a vector of single bits."""
    return builder.icmp_signed("<", mask, _NOUGHTS)


def _whole(builder: Any, mask: Any) -> Any:
    """Return a mask as a number of eight bits, the first lane lowest."""
    return builder.bitcast(_bits(builder, mask), ir.IntType(LANES))


def select(builder: Any, mask: Any, then: Any, otherwise: Any) -> Any:
    """Return the instruction that takes one of two vectors in each lane."""
    return builder.select(_bits(builder, mask), then, otherwise)


def _comparison(symbol: Any, comparison: str) -> None:
    """Let kernels compare lanes."""

    def compare(typing: Any, first: Any, second: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            values = [context.cast(builder, *each, _LANES) for each in zip(arguments, signature.args, strict=True)]
            return builder.sext(builder.fcmp_ordered(comparison, *values), _WORDS)

        return _MASK(first, second), generate

    offer(symbol, compare, are_lanes)


for _symbol, _comparison_name in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _comparison(_symbol, _comparison_name)


def _logic(symbol: Any, operation: str) -> None:
    """Let kernels combine masks."""

    def combine(typing: Any, first: Any, second: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return getattr(builder, operation)(*arguments)

        return _MASK(first, second), generate

    offer(symbol, combine, lambda first, second: isinstance(first, Mask) and isinstance(second, Mask))


for _symbol, _operation in ((operator.and_, "and_"), (operator.or_, "or_"), (operator.ne, "xor")):
    _logic(_symbol, _operation)


@_intrinsic
def opposite(typing: Any, condition: Any) -> Any:
    """Return the opposite of a condition: for a boolean, `not`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.not_(arguments[0])

    return condition(condition), generate


@_intrinsic
def choose(typing: Any, condition: Any, then: Any, otherwise: Any) -> Any:
    """Return one of two values, worked out both; each lane of a mask has its own choice."""
    result = _LANES if isinstance(condition, Mask) else typing.unify_types(then, otherwise)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds = signature.args[1:]
        values = [context.cast(builder, *each, result) for each in zip(arguments[1:], kinds, strict=True)]
        if isinstance(condition, Mask):
            return select(builder, arguments[0], *values)
        return builder.select(arguments[0], *values)

    return result(condition, then, otherwise), generate


def _of_all(comparison: str, bits: int) -> Any:
    """Return the intrinsic that compares the lanes of a mask with bits; a boolean stays what it is."""

    @_intrinsic
    def compare(typing: Any, condition: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            if not isinstance(condition, Mask):
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
    count = LANES if isinstance(condition, Mask) else 1

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return ir.Constant(ir.IntType(64), count)

    return types.int64(condition), generate


@_intrinsic
def holds(typing: Any, condition: Any, lane: Any) -> Any:
    """Return whether a condition holds in a lane."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if not isinstance(condition, Mask):
            return arguments[0]
        bits = builder.zext(_whole(builder, arguments[0]), ir.IntType(64))
        return builder.trunc(builder.lshr(bits, arguments[1]), ir.IntType(1))

    return types.boolean(condition, types.int64), generate


@_intrinsic
def has_bit(typing: Any, number: Any, bit: Any) -> Any:
    """Return whether a bit is set in a float64 that holds a whole number, negative ones in two's complement."""
    is_one = not isinstance(number, Lanes)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value, place = arguments
        if is_one:
            whole = builder.fptosi(value, ir.IntType(64))
            return builder.trunc(builder.lshr(whole, place), ir.IntType(1))
        shifted = builder.fadd(value, ir.Constant(_VECTOR, [_MAGIC] * LANES))
        top = builder.sub(ir.Constant(ir.IntType(64), 63), place)
        filled = ir.Constant(_WORDS, ir.Undefined)
        for lane in range(LANES):
            filled = builder.insert_element(filled, top, ir.Constant(ir.IntType(32), lane))
        bits = builder.shl(builder.bitcast(shifted, _WORDS), filled)
        return builder.ashr(bits, ir.Constant(_WORDS, [63] * LANES))

    return (types.boolean if is_one else _MASK)(number, types.int64), generate
