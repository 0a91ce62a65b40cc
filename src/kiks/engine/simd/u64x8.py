"""Vectors of eight 64-bit words, with ^ >> * and +, for the random numbers of eight worlds."""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.extending import models
from numba.np import arrayobj

from kiks.engine.simd.f64x8 import LANES, Lanes, offer

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_arrays: Any = arrayobj


class Words(types.Type):  # type: ignore[misc, unused-ignore]
    """Numba's type of eight uint64 that are calculated with together."""

    element = types.uint64

    def __init__(self) -> None:
        super().__init__(name="Words")


_WORDS_TYPE, _LANES = Words(), Lanes()
_WORD, _WORDS, _NUMBERS = ir.IntType(64), ir.VectorType(ir.IntType(64), LANES), ir.VectorType(ir.DoubleType(), LANES)
_TWO_TO_52, _FRACTION = 4503599627370496.0, 2**52 - 1


@extending.register_model(Words)
class _WordsModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _WORDS)  # type: ignore[no-untyped-call, unused-ignore]


def _splat(builder: Any, value: Any) -> Any:
    """Return eight times a word, unless it is eight words already."""
    if value.type == _WORDS:
        return value
    filled = ir.Constant(_WORDS, ir.Undefined)
    for lane in range(LANES):
        filled = builder.insert_element(filled, value, ir.Constant(ir.IntType(32), lane))
    return filled


def _are_words(*kinds: Any) -> bool:
    return all(isinstance(kind, Words | types.Integer) for kind in kinds) and _WORDS_TYPE in kinds


def _arithmetic(operation: str) -> Any:
    """Return what calculates with words, or words and an integer."""

    def calculate(typing: Any, first: Any, second: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pairs = zip(arguments, signature.args, strict=True)
            words = [
                v if isinstance(kind, Words) else context.cast(builder, v, kind, types.uint64) for v, kind in pairs
            ]
            return getattr(builder, operation)(*(_splat(builder, word) for word in words))

        return _WORDS_TYPE(first, second), generate

    return calculate


for _symbol, _operation in (
    (operator.add, "add"),
    (operator.mul, "mul"),
    (operator.xor, "xor"),
    (operator.rshift, "lshr"),
):
    offer(_symbol, _arithmetic(_operation), _are_words)


@_intrinsic
def load_words(typing: Any, array: Any) -> Any:
    """Return the first eight words of an array of uint64 or int64 without gaps."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = _arrays.make_array(array)(context, builder, arguments[0]).data
        return builder.load(builder.bitcast(data, _WORDS.as_pointer()), align=8)

    return _WORDS_TYPE(array), generate


@_intrinsic
def word(typing: Any, value: Any) -> Any:
    """Return a whole number as a word, or eight; `Lanes` must hold numbers from 0 to 2^52."""
    result = _WORDS_TYPE if isinstance(value, Words | Lanes) else types.uint64

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(value, Words):
            return arguments[0]
        if not isinstance(value, Lanes):
            return context.cast(builder, arguments[0], value, types.uint64)
        # Few processors convert eight at once: beyond 2^52 the lowest bits of a float64 are the number itself.
        shifted = builder.fadd(arguments[0], ir.Constant(_NUMBERS, [_TWO_TO_52] * LANES))
        return builder.and_(builder.bitcast(shifted, _WORDS), ir.Constant(_WORDS, [_FRACTION] * LANES))

    return result(value), generate


@_intrinsic
def number(typing: Any, value: Any) -> Any:
    """Return a word below 2^53 as a float64, or eight."""
    result = _LANES if isinstance(value, Words) else types.float64

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(value, Words):
            return builder.uitofp(arguments[0], _NUMBERS)
        return context.cast(builder, arguments[0], value, types.float64)

    return result(value), generate
