"""Eight numbers that kernels calculate with together: robots, sensors, rays or neurons.

Need: a processor can do an operation for eight numbers at the same time, or for two or four if it is older. But the
compiler unrolls a loop over seven or eight rays, and does not turn the unrolled code into vector code.
Method: types of their own, all made by `Lanes`: `F64X8`, `F32X8` and `U64X8` hold numbers, `MASK` holds decisions. Each
operator is one instruction, with the roundings of the scalar one; so the bits are the same. A number beside lanes
stands for eight times itself. What is written with these functions and with `kiks.engine.simd.masks` is compiled for
one number and for eight.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils, typeconv
from numba.core.typing import templates
from numba.extending import models
from numba.np import arrayobj

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_insert_function: Any = cgutils.get_or_insert_function
_arrays: Any = arrayobj
_typeconv: Any = typeconv
_templates: Any = templates
_lower_cast: Any = extending.lower_cast

LANES = 8
"""SIMD width: seven rays plus one padding lane; as wide as the widest vector registers."""

_INTEGER, _WORD = ir.IntType(32), ir.IntType(64)

# A decision is as wide as a number, all ones for yes: bits cost conversions on processors without mask registers.
_CONTENTS: Any = {
    types.float64: ir.DoubleType(),
    types.float32: ir.FloatType(),
    types.uint64: _WORD,
    types.boolean: _WORD,
}


class Lanes(types.Type):  # type: ignore[misc, unused-ignore]
    """Numba's type of eight numbers or decisions.

    Args:
        element: Numba's type of one of them.
    """

    def __init__(self, element: Any) -> None:
        self.element = element
        super().__init__(name=f"Lanes({element})")

    @property
    def vector(self) -> Any:
        """LLVM's type of them."""
        return ir.VectorType(_CONTENTS[self.element], LANES)

    def can_convert_from(self, typing: Any, other: Any) -> Any:
        """Say that a number may stand for eight times itself."""
        return _typeconv.Conversion.safe if isinstance(other, types.Number) else None


F64X8, F32X8, U64X8, MASK = (Lanes(kind) for kind in (types.float64, types.float32, types.uint64, types.boolean))

_LANES_OF: Any = {types.float64: F64X8, types.float32: F32X8, types.uint64: U64X8, types.int64: U64X8}


@extending.register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, lanes: Any) -> None:
        super().__init__(manager, lanes, lanes.vector)  # type: ignore[no-untyped-call, unused-ignore]


def filled(builder: Any, vector: Any, value: Any) -> Any:
    """Return a vector of a type that holds one value eight times."""
    result = ir.Constant(vector, ir.Undefined)
    for lane in range(LANES):
        result = builder.insert_element(result, value, ir.Constant(_INTEGER, lane))
    return result


@_lower_cast(types.Number, Lanes)
def _widen(context: Any, builder: Any, kind: Any, lanes: Any, value: Any) -> Any:
    """Let a number stand for eight times itself."""
    return filled(builder, lanes.vector, context.cast(builder, value, kind, lanes.element))


def cast_all(context: Any, builder: Any, lanes: Any, values: Any, kinds: Any) -> Any:
    """Return values of some types as lanes."""
    return [context.cast(builder, *each, lanes) for each in zip(values, kinds, strict=True)]


# ---- operators ----


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


def _offer_on(lanes: Any, operate: Callable[..., Any], *symbols: Any, result: Any = None) -> None:
    """Let kernels use a function or operator on lanes of a type, or on some and numbers.

    Args:
        lanes: The type.
        operate: Takes LLVM's builder and the vectors, and returns the vector of the results.
        symbols: The functions and operators.
        result: The type of the results, if it is another.
    """

    def fits(*kinds: Any) -> bool:
        return lanes in kinds and all(kind == lanes or isinstance(kind, types.Number) for kind in kinds)

    def calculate(typing: Any, *kinds: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return operate(builder, *cast_all(context, builder, lanes, arguments, signature.args))

        return (result or lanes)(*kinds), generate

    # Numba counts the arguments by the signature.
    def calculate_one(typing: Any, value: Any) -> Any:
        return calculate(typing, value)

    def calculate_two(typing: Any, first: Any, second: Any) -> Any:
        return calculate(typing, first, second)

    for symbol in symbols:
        offer(symbol, calculate_one if symbol in (abs, operator.neg) else calculate_two, fits)


def _instruction(name: str) -> Callable[..., Any]:
    """Return what builds an instruction of LLVM."""
    return lambda builder, *vectors: getattr(builder, name)(*vectors)


def _comparison(sign: str) -> Callable[..., Any]:
    """Return what compares numbers, as a mask; nothing is true of NaN."""
    return lambda builder, *vectors: builder.sext(builder.fcmp_ordered(sign, *vectors), MASK.vector)


def _extreme(sign: str) -> Callable[..., Any]:
    """Return what finds the smaller or greater: of two that are equal the first, as it is with numbers."""

    def find(builder: Any, one: Any, other: Any) -> Any:
        return builder.select(builder.fcmp_ordered(sign, other, one), other, one)

    return find


def _function(name: str) -> Callable[..., Any]:
    """Return what calls a function of LLVM on one number or on eight."""

    def call(builder: Any, number: Any) -> Any:
        vector = number.type if isinstance(number.type, ir.VectorType) else None
        suffix = (f"v{LANES}" if vector else "") + (vector.element if vector else number.type).intrinsic_name
        kind = ir.FunctionType(number.type, [number.type])
        return builder.call(_insert_function(builder.module, kind, f"llvm.{name}.{suffix}"), [number])

    return call


_FLOAT_OPERATORS: tuple[tuple[Callable[..., Any], tuple[Any, ...]], ...] = (
    (_instruction("fadd"), (operator.add, operator.iadd)),
    (_instruction("fsub"), (operator.sub, operator.isub)),
    (_instruction("fmul"), (operator.mul, operator.imul)),
    (_instruction("fdiv"), (operator.truediv, operator.itruediv)),
    (_instruction("fneg"), (operator.neg,)),
    (_function("fabs"), (abs,)),
    (_extreme("<"), (min,)),
    (_extreme(">"), (max,)),
)
_WORD_OPERATORS = (("add", operator.add), ("mul", operator.mul), ("xor", operator.xor), ("lshr", operator.rshift))
_MASK_OPERATORS = (("and_", operator.and_), ("or_", operator.or_), ("xor", operator.ne))
_COMPARISONS = (
    *(("<", operator.lt), ("<=", operator.le), (">", operator.gt)),
    *((">=", operator.ge), ("==", operator.eq), ("!=", operator.ne)),
)

for _lanes in (F64X8, F32X8):
    for _operate, _symbols in _FLOAT_OPERATORS:
        _offer_on(_lanes, _operate, *_symbols)
    for _sign, _symbol in _COMPARISONS:
        _offer_on(_lanes, _comparison(_sign), _symbol, result=MASK)
for _lanes, _operators in ((U64X8, _WORD_OPERATORS), (MASK, _MASK_OPERATORS)):
    for _name, _symbol in _operators:
        _offer_on(_lanes, _instruction(_name), _symbol)


# ---- functions, for a number as well ----


def _number_function(name: str) -> Any:
    """Return what kernels call on one number or on lanes."""

    def calculate(typing: Any, number: Any) -> Any:
        result = number if isinstance(number, Lanes) else types.float64

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return _function(name)(builder, context.cast(builder, arguments[0], number, result))

        return result(number), generate

    return calculate


floor = _intrinsic(_number_function("floor"))
"""The greatest whole number that is not above a number, as a float."""

root = _intrinsic(_number_function("sqrt"))
"""The square root of a number."""


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
    element = getattr(lanes, "element", None)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if not element:
            return arguments[0]
        numbers = [builder.extract_element(arguments[0], ir.Constant(_INTEGER, lane)) for lane in range(LANES)]
        return functools.reduce(functools.partial(_extreme(">"), builder), numbers)

    return (element or lanes)(lanes), generate


@_intrinsic
def total(typing: Any, lanes: Any) -> Any:
    """Return the sum of lanes: of pairs four lanes apart, then two, then one."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        sums, count = arguments[0], LANES
        while count > 1:
            count //= 2
            halves = (
                ir.Constant(ir.VectorType(_INTEGER, count), [first + k for k in range(count)]) for first in (0, count)
            )
            sums = builder.fadd(*(builder.shuffle_vector(sums, sums, half) for half in halves))
        return builder.extract_element(sums, ir.Constant(_INTEGER, 0))

    return lanes.element(lanes), generate


# ---- arrays and other types ----


def _place(context: Any, builder: Any, array: Any, value: Any, first: Any) -> Any:
    """Return the address of eight numbers of an array without gaps, from a place on."""
    data = builder.gep(_arrays.make_array(array)(context, builder, value).data, [first], inbounds=True)
    return builder.bitcast(data, _LANES_OF[array.dtype].vector.as_pointer())


@_intrinsic
def load(typing: Any, array: Any, first: Any = 0) -> Any:
    """Return eight numbers of an array without gaps, from a place on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, array, *arguments), align=array.dtype.bitwidth // 8)

    return _LANES_OF[array.dtype](array, types.int64), generate


@_intrinsic
def store(typing: Any, array: Any, lanes: Any, first: Any = 0) -> Any:
    """Write eight numbers into an array without gaps, from a place on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, array, arguments[0], arguments[2])
        numbers = context.cast(builder, arguments[1], lanes, _LANES_OF[array.dtype])
        builder.store(numbers, place, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, lanes, types.int64), generate


@_lower_cast(Lanes, Lanes)
def _convert(context: Any, builder: Any, kind: Any, lanes: Any, value: Any) -> Any:
    """Convert numbers to a type; float64 to be words must be whole and from 0 to 2^52."""
    if lanes == F32X8:
        return builder.fptrunc(value, lanes.vector)
    if lanes == F64X8:
        return (builder.fpext if kind == F32X8 else builder.uitofp)(value, lanes.vector)
    # Few processors convert eight at once: beyond 2^52 the lowest bits of a float64 are the number itself.
    shifted = builder.fadd(value, ir.Constant(kind.vector, [2.0**52] * LANES))
    return builder.and_(builder.bitcast(shifted, lanes.vector), ir.Constant(lanes.vector, [2**52 - 1] * LANES))


def _conversion(lanes: Any, alone: Any = None) -> Any:
    """Return what kernels call to convert numbers to lanes; if a type for one alone is named, that becomes no lanes."""

    def convert(typing: Any, value: Any) -> Any:
        result = alone if alone and not isinstance(value, Lanes) else lanes

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return context.cast(builder, arguments[0], value, result)

        return result(value), generate

    return _intrinsic(convert)


wide = _conversion(F64X8)
"""Eight numbers as float64, or eight times a number."""

narrow = _conversion(F32X8)
"""Eight numbers rounded to float32, or eight times a number."""

word = _conversion(U64X8, types.uint64)
"""A whole number as a word of 64 bits, or eight; those in lanes must be from 0 to 2^52."""

number = _conversion(F64X8, types.float64)
"""A word below 2^53 as a float64, or eight."""
