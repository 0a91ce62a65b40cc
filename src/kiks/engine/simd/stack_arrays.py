"""Scratch arrays on the stack.

Need: an array of NumPy costs an allocation, which takes longer than a tick. And the compiler makes vector code only
where it can prove that nothing else overlaps an array.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import extending, types

from kiks.engine.simd.addresses import array_in

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic

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
        shape = [context.get_value_type(types.intp)(count)]
        return array_in(context, builder, array_type, builder.bitcast(memory, content.as_pointer()), shape)

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
