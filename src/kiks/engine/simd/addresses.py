"""Arrays at addresses, so that a record can stand for many arrays.

Need: Numba opens each array that Python hands to a kernel, which costs 65 ns, and a world has two dozen. One record
with their addresses costs as much as one array.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.typing import templates
from numba.extending import models
from numba.np import arrayobj
from numba.np.numpy_support import from_dtype
from numpy.typing import NDArray

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_arrays: Any = arrayobj
_pack: Any = cgutils.pack_array
_lower: Any = extending
_templates: Any = templates
_named_tuple: Any = types.NamedTuple

_BYTE = ir.IntType(8)


def address_field(name: str, dimensions: int) -> tuple[str, type, tuple[int]]:
    """Return the field of a record that stands for an array: its address and its shape."""
    return name, np.int64, (1 + dimensions,)


def address_of_array(array: NDArray[Any], element: Any, dimensions: int) -> tuple[int, ...]:
    """Return what stands in that field. The array must live as long as the record is used.

    Args:
        array: The array, in C order without gaps.
        element: Its element type.
        dimensions: Number of its dimensions.
    """
    assert array.dtype == element
    assert array.ndim == dimensions
    assert array.flags.c_contiguous
    return array.ctypes.data, *array.shape


class ArrayRecord(types.Type):  # type: ignore[misc, unused-ignore]
    """Numba's type of a record that stands for arrays; kernels pass it on as one address.

    Args:
        record: The record.
        elements: Element types of the arrays, by name; other fields are plain numbers.
        groups: Named tuples of fields that kernels read as one, by name.
    """

    def __init__(self, record: np.dtype[np.void], elements: dict[str, Any], groups: dict[str, Any]) -> None:
        self.record: Any = from_dtype(record)
        self.groups = groups
        self.elements = {name: from_dtype(np.dtype(element)) for name, element in elements.items()}
        digest = hashlib.sha256(str((self.record, sorted(self.elements), sorted(groups))).encode()).hexdigest()[:12]
        super().__init__(name=f"ArrayRecord({digest})")

    def kind_of(self, name: str) -> Any:
        """Return Numba's type of a field or group."""
        if name in self.groups:
            kinds = [self.kind_of(field) for field in self.groups[name]._fields]
            return _named_tuple(kinds, self.groups[name])
        field = self.record.fields[name].type
        return types.Array(self.elements[name], field.shape[0] - 1, "C") if name in self.elements else field


@extending.register_model(ArrayRecord)
class _ArrayRecordModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _BYTE.as_pointer())  # type: ignore[no-untyped-call, unused-ignore]


@templates.infer_getattr
class _ArrayFields(_templates.AttributeTemplate):  # type: ignore[misc, unused-ignore]
    key = ArrayRecord

    def generic_resolve(self, numbers: Any, name: str) -> Any:
        """Return the type of a field or group."""
        return numbers.kind_of(name)


@_lower.lower_getattr_generic(ArrayRecord)
def _get_field(context: Any, builder: Any, numbers: Any, address: Any, name: str) -> Any:
    kind = numbers.kind_of(name)
    if name in numbers.groups:
        fields = numbers.groups[name]._fields
        parts = [_get_field(context, builder, numbers, address, field) for field in fields]
        return context.make_tuple(builder, kind, parts)
    place = builder.gep(address, [context.get_value_type(types.intp)(numbers.record.fields[name].offset)])
    if name not in numbers.elements:
        content = context.get_data_type(kind)
        number = builder.load(builder.bitcast(place, content.as_pointer()))
        return context.data_model_manager[kind].from_data(builder, number)
    return _array(context, builder, kind, place)


def _array(context: Any, builder: Any, kind: Any, place: Any) -> Any:
    """Return the array whose address and shape stand at a place."""
    size, content = context.get_value_type(types.intp), context.get_data_type(kind.dtype)
    place = builder.bitcast(place, size.as_pointer())
    address, *shape = (builder.load(builder.gep(place, [size(k)])) for k in range(1 + kind.ndim))
    return array_in(context, builder, kind, builder.inttoptr(address, content.as_pointer()), shape)


def array_in(context: Any, builder: Any, kind: Any, data: Any, shape: Any) -> Any:
    """Return the array of a type that lies in some memory, without gaps."""
    size, content = context.get_value_type(types.intp), context.get_data_type(kind.dtype)
    strides = [size(context.get_abi_sizeof(content))]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    array = _arrays.make_array(kind)(context, builder)
    _arrays.populate_array(
        array,
        data=data,
        shape=_pack(builder, shape),
        strides=_pack(builder, strides),
        itemsize=strides[-1],
        meminfo=None,
        parent=None,
    )
    return array._getvalue()


def opener(opened: ArrayRecord) -> Any:
    """Return what opens a record in a kernel: then its names are the arrays."""

    @_intrinsic
    def open_record(typing: Any, closed: Any) -> Any:
        """Return an open record, from one of an array."""

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], _BYTE.as_pointer())

        return opened(closed), generate

    return open_record
