"""Records of the robots of eight worlds, and how kernels read and write them.

Need: a tick is a few hundred operations on one robot. A processor can do each of them for eight robots at the same
time. The formulas must stand in one place, for one robot and for eight.
Method: `EIGHT` has the numbers of `ROBOT` that a tick of a lone robot reads or writes, `EIGHT_KINDS` those of
`PARAMETERS`, each as eight float64 side by side, which hold whole numbers below 2^53 exactly. For kernels such a record
is a `Record8`: `robot.x_mm` are lanes, `robot.trail[0, 1]` too. `one_of(robot, lane)` is the robot of a lane, with the
same names for single numbers.
"""

from __future__ import annotations

import hashlib
import math
import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.typing import templates
from numba.extending import models

from kiks.engine.parameters import DRIVING, PARAMETERS
from kiks.engine.simd.lanes import F64X8, LANES, offer
from kiks.engine.simd.masks import select
from kiks.engine.state import ROBOT

# Numba annotates these in part, and not as they are used in kernels.
_intrinsic: Any = extending.intrinsic
_lower: Any = extending
_templates: Any = templates
_proxy: Any = cgutils.create_struct_proxy

_BYTE, _WORD = ir.IntType(8), ir.IntType(64)


def record8_of(record: np.dtype[np.void], names: tuple[str, ...], *more: str) -> np.dtype[np.void]:
    """Return the type of a record that holds some numbers of eight records.

    Args:
        record: Type of each of the eight.
        names: Which of its fields.
        more: Fields of its own besides.
    """
    fields = [(name, np.float64, (*record[name].shape, LANES)) for name in names]
    return np.dtype(fields + [(name, np.float64, (LANES,)) for name in more])


EIGHT = record8_of(
    ROBOT,
    (
        *("x_mm", "y_mm", "heading_rad", "trail", "forwards_mm", "backwards_mm", "contact_count", "is_touching"),
        *("wheel_pulses", "slip_pulses", "motor_speed", "pulse_count", "slip_count", "counter_offset"),
        *("target_pulses", "trajectory_pulses", "trajectory_speed", "error_sum", "last_error", "measured_speed"),
        *("controlled_speed", "motor_mode", "speed_setpoint", "pwm_setpoint", "pwm", "on_target", "profile_speed"),
        *("profile_acceleration", "speed_gains", "position_gains"),
    ),
    *("number", "tick_count", "until", "left_pulses", "right_pulses", "way_mm", "room_mm", "is_near"),
    "is_touching_discs",
)
"""Eight robots of a bunch, and what a tick notes about them (`kiks.engine.bunch`)."""

EIGHT_KINDS = record8_of(
    PARAMETERS,
    (
        *("radius_mm", *DRIVING),
        *("free_speed_pulses", "dead_band_pwm", "motor_gain", "lag_decay", "lag_ticks", "gain_scale"),
        *("steps_per_s_max", "timer_hz"),
    ),
)
"""The constants of the eight."""


class _Numbers(types.Type):  # type: ignore[misc, unused-ignore]
    """A record of eights, or a field of one, that a kernel reads and writes by name or by number."""

    def __init__(self, fields: Any) -> None:
        self.fields = fields  # Numba's type of the record, or the shape of the field
        # The name goes into those of all functions that are compiled for it, so it must be short.
        digest = hashlib.sha256(str(fields).encode()).hexdigest()[:12]
        super().__init__(name=f"{type(self).__name__}({digest})")


class Record8(_Numbers):
    """Numba's type of eight records: their numbers are lanes."""


class RecordLane(_Numbers):
    """Numba's type of one of them: its numbers are float64."""


@extending.register_model(Record8)
@extending.register_model(RecordLane)
class _NumbersModel(models.StructModel):  # type: ignore[misc, unused-ignore]
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, [("address", types.voidptr)])  # type: ignore[no-untyped-call, unused-ignore]


def _kind_of(numbers: Any) -> Any:
    """Return the type of what one name or number stands for."""
    return F64X8 if isinstance(numbers, Record8) else types.float64


def _at(builder: Any, address: Any, offset: Any, content: Any) -> Any:
    """Return the address of a value at an offset [bytes] from another address."""
    return builder.bitcast(builder.gep(address, [offset], inbounds=True), content.as_pointer())


def _parts(context: Any, builder: Any, numbers: Any, value: Any) -> Any:
    return _proxy(numbers)(context, builder, value)


def _read(context: Any, builder: Any, numbers: Any, value: Any, offset: Any) -> Any:
    """Return the value at an offset [bytes] from the beginning."""
    content = context.get_data_type(_kind_of(numbers))
    return builder.load(_at(builder, _parts(context, builder, numbers, value).address, offset, content), align=8)


def _write(context: Any, builder: Any, numbers: Any, value: Any, offset: Any, kind: Any, new: Any) -> Any:
    """Write the value at an offset [bytes] from the beginning."""
    new = context.cast(builder, new, kind, _kind_of(numbers))
    place = _at(builder, _parts(context, builder, numbers, value).address, offset, new.type)
    builder.store(new, place, align=8)


def _field(numbers: Any, name: str) -> Any:
    """Return where a field begins [bytes], and its shape without the lanes."""
    field = numbers.fields.fields[name]
    return ir.Constant(_WORD, field.offset), field.type.shape[:-1]


@templates.infer_getattr
class _LaneFields(_templates.AttributeTemplate):  # type: ignore[misc, unused-ignore]
    key = _Numbers

    def generic_resolve(self, numbers: Any, name: str) -> Any:
        """Return the type of a field."""
        shape = _field(numbers, name)[1]
        return type(numbers)(shape) if shape else _kind_of(numbers)


@_lower.lower_getattr_generic(_Numbers)
def _get_field(context: Any, builder: Any, numbers: Any, value: Any, name: str) -> Any:
    offset, shape = _field(numbers, name)
    if not shape:
        return _read(context, builder, numbers, value, offset)
    before = _parts(context, builder, numbers, value)
    part = _proxy(type(numbers)(shape))(context, builder)
    part.address = builder.gep(before.address, [offset], inbounds=True)
    return part._getvalue()


@_lower.lower_setattr_generic(_Numbers)
def _set_field(context: Any, builder: Any, signature: Any, arguments: Any, name: str) -> None:
    numbers, kind = signature.args
    value, new = arguments
    _write(context, builder, numbers, value, _field(numbers, name)[0], kind, new)


def _offset(builder: Any, numbers: Any, kind: Any, index: Any) -> Any:
    """Return how far an element of a field is from its beginning [bytes]."""
    indices = builder.extract_value if isinstance(kind, types.BaseTuple) else None
    place: Any = ir.Constant(_WORD, 0)
    for axis, length in enumerate(numbers.fields):
        each = index if indices is None else builder.extract_value(index, axis)
        each = builder.sext(each, _WORD) if each.type.width < 64 else each
        place = builder.add(builder.mul(place, ir.Constant(_WORD, length)), each)
    return builder.mul(place, ir.Constant(_WORD, 8 * LANES))


def _get(typing: Any, numbers: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value, place = arguments
        return _read(context, builder, numbers, value, _offset(builder, numbers, signature.args[1], place))

    return _kind_of(numbers)(numbers, index), generate


def _set(typing: Any, numbers: Any, index: Any, new: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value, place, lanes = arguments
        offset = _offset(builder, numbers, signature.args[1], place)
        _write(context, builder, numbers, value, offset, signature.args[2], lanes)
        return context.get_dummy_value()

    return types.void(numbers, index, new), generate


def _are_numbers(numbers: Any, *others: Any) -> bool:
    return isinstance(numbers, _Numbers)


offer(operator.getitem, _get, _are_numbers)
offer(operator.setitem, _set, _are_numbers)


# ---- from one type to the other ----


@_intrinsic
def open_record8(typing: Any, record: Any) -> Any:
    """Return a record of `EIGHT` or `EIGHT_KINDS` as a `Record8`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        eight = _proxy(signature.return_type)(context, builder)
        eight.address = builder.bitcast(arguments[0], _BYTE.as_pointer())
        return eight._getvalue()

    return Record8(record)(record), generate


@_intrinsic
def one_of(typing: Any, robot: Any, lane: Any) -> Any:
    """Return the robot of a lane; a robot alone is itself."""
    is_eight = isinstance(robot, Record8)
    result = RecordLane(robot.fields) if is_eight else robot

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value, number = arguments
        if not is_eight:
            return value
        one = _proxy(result)(context, builder)
        place = builder.mul(number, ir.Constant(_WORD, 8))
        one.address = builder.gep(_parts(context, builder, robot, value).address, [place], inbounds=True)
        return one._getvalue()

    return result(robot, types.int64), generate


@_intrinsic
def copy_record8(typing: Any, source: Any, target: Any) -> Any:
    """Copy a record of eights to another one."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        there, here = (_parts(context, builder, source, each).address for each in arguments)
        cgutils.raw_memcpy(builder, here, there, ir.Constant(_WORD, source.fields.size), 1)  # type: ignore[no-untyped-call, unused-ignore]
        return context.get_dummy_value()

    return types.void(source, target), generate


@_intrinsic
def copy_lanes(typing: Any, source: Any, target: Any, condition: Any) -> Any:
    """Copy the lanes in which a condition holds from one `Record8` to another."""
    count = source.fields.size // (8 * LANES)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        there, here = (_parts(context, builder, source, each).address for each in arguments[:2])
        there, here = (builder.bitcast(each, F64X8.vector.as_pointer()) for each in (there, here))
        with cgutils.for_range(builder, ir.Constant(_WORD, count)) as loop:  # type: ignore[no-untyped-call, unused-ignore]
            new = builder.load(builder.gep(there, [loop.index]), align=8)
            place = builder.gep(here, [loop.index])
            old = builder.load(place, align=8)
            builder.store(select(builder, arguments[2], new, old), place, align=8)
        return context.get_dummy_value()

    return types.void(source, target, condition), generate


# ---- from eight records and back ----


def _copies(eight: Any, record: Any) -> Any:
    """Yield a number's type in a record, where it stands in it, and where its lanes begin in an eight, for each."""
    for name, field in eight.fields.items():
        if name in record.fields:
            source = record.fields[name]
            element = source.type.dtype if isinstance(source.type, types.NestedArray) else source.type
            for k in range(math.prod(field.type.shape[:-1])):
                yield element, source.offset + k * (element.bitwidth // 8), field.offset + k * 8 * LANES


@_intrinsic
def fill_lanes(typing: Any, eight: Any, record: Any) -> Any:
    """Copy what a record of eights has of a record into all lanes."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lanes, one = (builder.bitcast(each, _BYTE.as_pointer()) for each in arguments)
        for kind, there, here in _copies(eight, record):
            single = _at(builder, one, ir.Constant(_WORD, there), context.get_data_type(kind))
            value = context.cast(builder, builder.load(single, align=1), kind, types.float64)
            filled = context.cast(builder, value, types.float64, F64X8)
            builder.store(filled, _at(builder, lanes, ir.Constant(_WORD, here), F64X8.vector), align=8)
        return context.get_dummy_value()

    return types.void(eight, record), generate


def _lane_copy(is_loaded: bool) -> Any:
    """Return what copies the numbers of one lane from a record, or to it."""

    def copy(typing: Any, eight: Any, lane: Any, record: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            lanes, number_of_lane, one = arguments
            lanes, one = (builder.bitcast(each, _BYTE.as_pointer()) for each in (lanes, one))
            lanes = builder.gep(lanes, [builder.mul(number_of_lane, ir.Constant(_WORD, 8))], inbounds=True)
            for kind, there, here in _copies(eight, record):
                single = _at(builder, one, ir.Constant(_WORD, there), context.get_data_type(kind))
                number = _at(builder, lanes, ir.Constant(_WORD, here), ir.DoubleType())
                if is_loaded:
                    value = builder.load(single, align=1)
                    builder.store(context.cast(builder, value, kind, types.float64), number, align=8)
                else:
                    value = builder.load(number, align=8)
                    builder.store(context.cast(builder, value, types.float64, kind), single, align=1)
            return context.get_dummy_value()

        return types.void(eight, types.int64, record), generate

    return _intrinsic(copy)


load_lane = _lane_copy(True)
"""Copies what a record of eights has of a record into a lane: the eights, the lane, the record."""

store_lane = _lane_copy(False)
"""Copies what a record of eights has of a record from a lane."""
