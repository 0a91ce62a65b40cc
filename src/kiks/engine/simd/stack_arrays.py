"""Scratch arrays on the stack, and arrays whose references are not counted.

Need: an array of NumPy costs an allocation, and each call that passes one counts references; both take longer than a
tick. And the compiler makes vector code only where it can prove that nothing else overlaps an array.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.np import arrayobj

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_arrays: Any = arrayobj
_pack: Any = cgutils.pack_array

_CACHE_LINE = 64  # bytes


def _on_the_stack(element_type: Any, *kinds: Any) -> Any:
    """Return signature and code of an intrinsic that makes an array on the stack; None if its length is no constant."""
    if not isinstance(kinds[0], types.IntegerLiteral):
        return None
    array_type = types.Array(element_type, 1, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        content, count = context.get_data_type(element_type), kinds[0].literal_value
        with builder.goto_entry_block():
            memory = builder.alloca(ir.ArrayType(content, count))
            memory.align = _CACHE_LINE
        size = context.get_value_type(types.intp)
        bytes_each = size(context.get_abi_sizeof(content))
        array = _arrays.make_array(array_type)(context, builder)
        _arrays.populate_array(
            array,
            data=builder.bitcast(memory, content.as_pointer()),
            shape=_pack(builder, [size(count)]),
            strides=_pack(builder, [bytes_each]),
            itemsize=bytes_each,
            meminfo=None,
            parent=None,
        )
        return array._getvalue()

    return array_type(*kinds), generate


def _stack(element_type: Any) -> Any:
    """Return what makes an uninitialised array on the stack, of a length that is a constant."""

    def make(typing: Any, count: Any) -> Any:
        return _on_the_stack(element_type, count)

    return _intrinsic(make)


stack_floats, stack_narrow, stack_integers, stack_booleans = (
    _stack(kind) for kind in (types.float64, types.float32, types.int64, types.boolean)
)
"""Each makes an uninitialised array on the stack, of a length that is a constant; it dies with its function."""


@_intrinsic
def stack_records(typing: Any, count: Any, record_type: Any) -> Any:
    """Return an uninitialised array of records on the stack, of a length and a type that are constants."""
    return _on_the_stack(record_type.dtype, count, record_type)


@_intrinsic
def borrowed(typing: Any, value: Any) -> Any:
    """Return arrays, or tuples of them, without reference counting; the caller of the entry point keeps them alive.

    Counting them at each call of a kernel that is not compiled into its caller would cost a sixth of a batch's time.
    """

    def borrow(context: Any, builder: Any, kind: Any, arrays: Any) -> Any:
        if isinstance(kind, types.BaseTuple):
            kinds: Any = tuple(kind)  # type: ignore[arg-type, unused-ignore]
            parts = [borrow(context, builder, each, builder.extract_value(arrays, k)) for k, each in enumerate(kinds)]
            return context.make_tuple(builder, kind, parts)
        if isinstance(kind, types.Array):
            array = _arrays.make_array(kind)(context, builder, arrays)
            array.meminfo = ir.Constant(array.meminfo.type, None)
            array.parent = ir.Constant(array.parent.type, None)
            return array._getvalue()
        return arrays

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return borrow(context, builder, value, arguments[0])

    return value(value), generate


@_intrinsic
def keep_alive(typing: Any, *values: Any) -> Any:
    """Do nothing: arrays that were borrowed live up to here."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.get_dummy_value()

    return types.void(types.BaseTuple.from_types(values)), generate  # type: ignore[no-untyped-call, unused-ignore]
