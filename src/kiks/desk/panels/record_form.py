"""A form for a record of a file, made from the record's own rules, which say under a field what is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from typing import Any

from nicegui import ui

from kiks.desk.panels.properties import label_of, rules_of
from kiks.desk.panels.widgets import named, with_props
from kiks.errors import KiksError, ParameterError, shown
from kiks.model.data_file import check
from kiks.model.ranges import numbers_of

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

            async def wrong(typed: str) -> str | None:
                return await self._wrong(name, typed)

            field = build(word, value=_typed(value), validation=wrong)
            field.props("dense outlined hide-bottom-space")
            if name in self._wide:
                field.classes("desk-wide")
            if is_long:
                field.props("autogrow input-style='min-height: 7rem; max-height: 40vh'")
            if tip := self._tips.get(name, ""):
                with_props(field, hint=tip)
        return named(field, f"{self._name}-{name}")

    def _value(self, name: str, typed: Any) -> Any:
        if isinstance(typed, bool):
            return typed
        return _read(str(typed or ""), self._rules[name], self._kept[name])

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


def _typed(value: Any) -> str:
    """Return a value as people type it.

    Example:
        >>> _typed((1, 2)), _typed(("none", "fixed:5"))
        ('1, 2', 'none, fixed:5')
    """
    if isinstance(value, tuple):
        if value and hasattr(value[0], "at_mm"):
            return "; ".join(f"{x:g}, {y:g}, {each.heading_deg:g}" for each in value for x, y in (each.at_mm,))
        return ", ".join(map(str, value))
    return str(value)


def _read(typed: str, rule: Mapping[str, Any], before: Any) -> Any:
    """Return what a person has typed in a field with a rule; what cannot be read stays a text, which the rules refuse.

    Example:
        >>> _read("1..3, 7", {"items": {"type": "integer"}}, ())
        (1, 2, 3, 7)
        >>> _read("100, 200, 90; 300, 50", {"items": {"$ref": "#/$defs/StartEntry"}}, ())
        ({'at_mm': (100.0, 200.0), 'heading_deg': 90.0}, {'at_mm': (300.0, 50.0)})
    """
    if isinstance(before, str):
        return typed
    if not isinstance(before, tuple):
        return _number(typed, type(before))
    items = rule["items"]
    if "$ref" in items:
        return tuple(_place(each) for each in typed.split(";") if each.strip())
    words = [each.strip() for each in typed.split(",") if each.strip()]
    return numbers_of(",".join(words), "The list", step=1) if words and items.get("type") == "integer" else tuple(words)


def _place(typed: str) -> dict[str, Any]:
    values = [_number(each, float) for each in typed.split(",")]
    if len(values) not in (2, 3):
        raise ParameterError(
            f"must be places such as 100, 200, 90 (x [mm], y [mm], heading [deg]) with ; between them, but one was "
            f"{shown(typed.strip())}."
        )
    return {"at_mm": tuple(values[:2])} | ({"heading_deg": values[2]} if len(values) == 3 else {})


def _number(typed: str, kind: type) -> Any:
    with suppress(ValueError):
        return kind(typed.strip())
    return typed.strip()
