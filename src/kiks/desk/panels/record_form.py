"""A form for a record of a file, made from the record's own rules, and the texts of values in any such form."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from functools import partial
from typing import Any

from nicegui import ui

from kiks.desk.panels.widgets import named, with_props
from kiks.errors import KiksError, ParameterError, shown
from kiks.model.data_file import adapter, check
from kiks.model.ranges import numbers_of

UNITS = {"_mm_s2": "mm/s²", "_mm": "mm", "_deg": "°", "_w": "W"}
"""Units by how names of values end."""

Examine = Callable[[str, Any], Awaitable[object]]


class RecordForm:
    """Fields for the values of a record; switches for yes or no, and lists with commas between their values.

    Args:
        kind: The record's class.
        values: The values of the fields, by name; that of the class for one that is left out.
        name: What tests call the form.
        labels: What people read above fields, by name; the names of others say it.
        tips: What people read below fields, by name.
        wide: Names of fields that take a whole row.
        long: Names of those that take several lines, too.
        left_out: Names of fields that are not shown; they keep their values.
        examine: Called with the name of a field and its value as one types, after the rules of the record; raises a
            `KiksError` if it is wrong.
    """

    def __init__(
        self,
        kind: type[Any],
        values: Mapping[str, Any],
        name: str,
        *,
        labels: Mapping[str, str] | None = None,
        tips: Mapping[str, str] | None = None,
        wide: Sequence[str] = (),
        long: Sequence[str] = (),
        left_out: Sequence[str] = (),
        examine: Examine | None = None,
    ) -> None:
        self._kind, self._name, self._examine, self._wide = kind, name, examine, (*wide, *long)
        self._rules, self._labels, self._tips = rules_of(kind), labels or {}, tips or {}
        self._kept = {each.name: values.get(each.name, each.default) for each in fields(kind)}
        self._fields: dict[str, ui.input | ui.textarea | ui.switch] = {}
        with ui.element("div").classes("desk-properties"):
            for each, value in self._kept.items():
                if each not in left_out:
                    self._fields[each] = self._build(each, value, is_long=each in long)

    def _build(self, name: str, value: Any, *, is_long: bool) -> ui.input | ui.textarea | ui.switch:
        word, unit = label_of(name)
        word = self._labels.get(name, f"{word} [{unit}]" if unit else word)
        field: ui.input | ui.textarea | ui.switch
        if isinstance(value, bool):
            field = ui.switch(word, value=value)
        else:
            build: Any = ui.textarea if is_long else ui.input
            field = build(word, value=text_of(value), validation=partial(self._wrong, name))
            field.props("dense outlined hide-bottom-space")
            if name in self._wide:
                field.classes("desk-wide")
            if is_long:
                field.props("autogrow input-style='min-height: 7rem; max-height: 40vh'")
            if tip := self._tips.get(name, ""):
                with_props(field, hint=tip)
        return named(field, f"{self._name}-{name}")

    def _value(self, name: str, typed: Any) -> Any:
        return value_of("" if typed is None else typed, self._kept[name], self._rules[name])

    async def _wrong(self, name: str, typed: str) -> str | None:
        """Return what is wrong with a field as one types."""
        try:
            value = self._value(name, typed)
            check(self._kind, {name: value}, "")
            if self._examine is not None:
                await self._examine(name, value)
        except KiksError as error:
            # The field itself says what it is about.
            return re.sub(r"^.{0,60}?(?=must )", "", str(error), count=1)
        return None

    def record(self) -> Any:
        """Return the record of what stands in the fields.

        Raises:
            ParameterError: If a value breaks a rule.
        """
        values = {name: self._value(name, field.value) for name, field in self._fields.items()}
        kept = {name: value for name, value in self._kept.items() if name not in values}
        return self._kind(**kept, **values)


def rules_of(kind: Any) -> dict[str, dict[str, Any]]:
    """Return the rules of each field of a record, from its JSON schema."""
    schema = adapter(kind).json_schema()
    if "properties" in schema:
        return dict(schema["properties"])
    return dict(zip(kind._fields, schema["prefixItems"], strict=True))


def label_of(name: str) -> tuple[str, str]:
    """Return what people call a value, and its unit.

    Example:
        >>> label_of("friction_mm_s2")
        ('Friction', 'mm/s²')
    """
    ending = next((each for each in UNITS if name.endswith(each)), "")
    word = name.removesuffix(ending).removeprefix("is_").replace("_", " ")
    return word if len(word) == 1 else word.capitalize(), UNITS.get(ending, "")


def text_of(value: Any) -> Any:
    """Return a value as people type it; a switch stays what it is.

    Example:
        >>> text_of((1, 2.5)), text_of(((0.0, 10.0), (20.0, 30.0)))
        ('1, 2.5', '0, 10; 20, 30')
    """
    if isinstance(value, bool | str):
        return value
    if hasattr(value, "at_mm"):
        value = (*value.at_mm, value.heading_deg)
    if isinstance(value, tuple):
        is_flat = not value or isinstance(value[0], str | int | float)
        return (", " if is_flat else "; ").join(map(text_of, value))
    return str(value) if isinstance(value, int) else f"{round(value, 3):.12g}"


def value_of(typed: Any, before: Any, rule: Mapping[str, Any]) -> Any:
    """Return what a person has typed in place of a value; what cannot be read stays a text, which the rules refuse.

    Args:
        typed: What stands in the field.
        before: The value in its place.
        rule: The rule of the field.

    Example:
        >>> value_of("10, 20; 30, 40.5", ((1.0, 2.0), (3.0, 4.0)), {})
        ((10, 20), (30, 40.5))
        >>> value_of("1..3, 7", (), {"items": {"type": "integer"}})
        (1, 2, 3, 7)
        >>> value_of("100, 200, 90; 300, 50", (), {"items": {"$ref": "#/$defs/StartEntry"}})
        ({'at_mm': (100, 200), 'heading_deg': 90}, {'at_mm': (300, 50)})
    """
    if isinstance(before, bool | str):
        return typed
    typed = str(typed)
    if not isinstance(before, tuple):
        return _number(typed)
    items = rule.get("items", {})
    if "$ref" in items:
        return tuple(_place(each) for each in typed.split(";") if each.strip())
    if before and isinstance(before[0], tuple):
        return tuple(value_of(each, before[0], {}) for each in typed.split(";"))
    words = [each.strip() for each in typed.split(",") if each.strip()]
    if items.get("type") == "integer" and words:
        return numbers_of(",".join(words), "The list", step=1)
    return tuple(words if items.get("type") in ("string", "integer") else map(_number, words))


def _place(typed: str) -> dict[str, Any]:
    values = tuple(map(_number, typed.split(",")))
    if len(values) not in (2, 3):
        raise ParameterError(
            f"must be places such as 100, 200, 90 (x [mm], y [mm], heading [deg]) with ; between them, but one was "
            f"{shown(typed.strip())}."
        )
    return {"at_mm": values[:2]} | ({"heading_deg": values[2]} if len(values) == 3 else {})


def _number(typed: str) -> float | str:
    for kind in (int, float):
        with suppress(ValueError):
            return kind(typed)
    return typed.strip()
