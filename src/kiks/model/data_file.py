"""Data files: read within a limit of size, checked against a declared model, rejected in one line.

A file that users write or receive is read completely or not at all. For any error, one line names the file, the key,
the rule, the value and what to do. No file takes much more memory than its size. A model is a class under `record`,
with the rules beside its fields (pydantic). `check` creates one from a table. The declaration gives the words of a
message: type and bounds give the rule, the description gives the advice.
"""

from __future__ import annotations

import dataclasses
import json
import os
import re
import tomllib
import types
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import (
    Annotated,
    Any,
    Literal,
    NamedTuple,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
import pydantic.dataclasses
from pydantic import ConfigDict, Field, Strict, Tag, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import core_schema

from kiks.errors import SHOWN_MAX, KiksError, ParameterError, figure, nearest, shown

BYTES_MAX = 4 << 20
"""Default limit of a file's size [bytes]."""

TEXT_MAX = 1000
"""Most characters of a text in a file."""

KEY_PARTS_MAX = 16
"""Most parts of a dotted key; tomllib's memory grows with their square."""

COORDINATE_MAX = 1e9
"""Largest magnitude of a number that is a coordinate or a length [mm]."""


class Rule(NamedTuple):
    """The words for a field's rule, if its type and bounds do not give them."""

    text: str


Number = Annotated[float, Strict()]
Whole = Annotated[int, Strict()]
Switch = Annotated[bool, Strict()]
Text = Annotated[str, Strict(), Field(max_length=TEXT_MAX, pattern=r"^[^\x00]*$")]
Coordinate = Annotated[float, Strict(), Field(ge=-COORDINATE_MAX, le=COORDINATE_MAX)]
Point = Annotated[tuple[Coordinate, ...], Field(min_length=2, max_length=2), Rule("two numbers in mm")]

_Model = TypeVar("_Model")


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def record(kind: type[_Model]) -> type[_Model]:
    """Make a class a frozen dataclass whose fields keep the rules beside them, made in code or of a file alike.

    Rules between fields stand in `__post_init__`, which raises a ParameterError.
    """
    config = ConfigDict(extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True)
    made: Any = pydantic.dataclasses.dataclass(frozen=True, config=config)(kind)
    initialise = made.__init__

    def checked(self: Any, *args: Any, **values: Any) -> None:
        try:
            initialise(self, *args, **values)
        except ValidationError as error:
            raise ParameterError(_sentence(made, error, whole=kind.__name__)) from None

    made.__init__ = checked
    return made  # type: ignore[no-any-return]


@dataclasses.dataclass(frozen=True)
class OneOf:
    """The names that a text must be one of; not a `Literal`, so that code may hold the name as a `str`."""

    names: tuple[str, ...]

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> core_schema.CoreSchema:
        """Return the schema of a choice."""
        return core_schema.literal_schema(list(self.names))


def check(
    model: type[_Model], values: object, what: str, *, advice: str = "", error: type[KiksError] = ParameterError
) -> _Model:
    """Return a record of the values of a file.

    Args:
        model: What the file holds, a class under `record`.
        values: What was read.
        what: What the message calls the file.
        advice: What the message says where the field says nothing.
        error: What is raised.
    """
    try:
        made: _Model = adapter(model).validate_python(values)  # type: ignore[arg-type] # a class can be hashed
    except ValidationError as broken:
        raise error(f"{what}: {_sentence(model, broken, advice)}") from None
    return made


@cache
def adapter(model: Any) -> TypeAdapter[Any]:
    """Return the object that validates a model and describes it as a JSON schema."""
    return TypeAdapter(model)


def descriptions(kind: Any) -> dict[str, str]:
    """Return the rule and the description of each field of a record, as text."""
    places = {name: _declared(hint) for name, hint in _hints(kind).items()}
    texts = {name: f"{_rule(place)}. {place.description}".rstrip() for name, place in places.items()}
    return {name: text[0].upper() + text[1:] for name, text in texts.items()}


def as_list(values: object) -> object:
    """Return an array as a list, anything else unchanged: records hold no arrays."""
    return values.tolist() if isinstance(values, np.ndarray) else values


# ---- bytes ----


def read_file(path: Path, what: str, *, bytes_max: int = BYTES_MAX, error: type[KiksError] = ParameterError) -> bytes:
    """Return the bytes of a file.

    Args:
        path: The file.
        what: What the message calls it.
        bytes_max: Most bytes that it may have.
        error: What is raised.
    """
    try:
        if path.is_dir():
            raise error(f"{what} must be a file, but it is a folder. Name a file in it.")
        if not path.is_file():
            folder = "" if path.is_absolute() else f" and the folder {str(Path.cwd())!r}"
            raise error(f"{what} must exist, but there is no such file. Check the name{folder}.")
        with path.open("rb") as file:
            # Python asks for the memory of as many bytes as it is told to read, though there are fewer.
            data = file.read(min(os.fstat(file.fileno()).st_size, bytes_max) + 1)
    except (OSError, ValueError) as failure:
        if isinstance(failure, KiksError):
            raise
        raise error(f"{what} must be readable, but: {failure}. Check its name and its rights.") from None
    check_size(data, what, bytes_max=bytes_max, error=error)
    return data


def check_size(data: bytes, what: str, *, bytes_max: int, error: type[KiksError] = ParameterError) -> None:
    """Check that a file is not too large."""
    if len(data) > bytes_max:
        raise error(f"{what} must have at most {bytes_max / 2**20:g} MiB, but it has more. Is it the right file?")


def parse_toml(data: bytes, what: str, *, error: type[KiksError] = ParameterError) -> dict[str, Any]:
    """Return the table of a TOML file."""
    table: dict[str, Any] = _parsed(data, "TOML", _load_toml, what, error)
    return table


def parse_json(data: bytes, what: str, *, error: type[KiksError] = ParameterError) -> Any:
    """Return the content of a JSON file."""
    return _parsed(data, "JSON", json.loads, what, error)


def _parsed(data: bytes, kind: str, load: Callable[[str], Any], what: str, error: type[KiksError]) -> Any:
    try:
        return load(data.decode("utf-8"))
    except (ValueError, RecursionError, OverflowError) as failure:
        raise error(
            f"{what} must be {kind} in UTF-8, but: {one_line(failure)}. Correct the file at that place."
        ) from None


_STRINGS_AND_COMMENTS = re.compile(
    r"""
    \"{3}(?:[^\\"]|\\.|"(?!""))*+\"{3} | '{3}(?:[^']|'(?!''))*+'{3}
    | "(?:[^"\\\n]|\\.)*+" | '[^'\n]*+' | \#[^\n]*+
    """,
    re.DOTALL | re.VERBOSE,
)
_LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]*+\.){{{KEY_PARTS_MAX}}}")


def _load_toml(text: str) -> dict[str, Any]:
    bare = re.sub(r"[ \t]++", "", _STRINGS_AND_COMMENTS.sub("", text))
    if _LONG_KEY.search(bare):
        raise ValueError(f"a key has more than {KEY_PARTS_MAX} parts")
    return tomllib.loads(text)


def one_line(failure: BaseException) -> str:
    """Return the text of a foreign exception, for the middle of a message."""
    text = " ".join("".join(sign if sign.isprintable() else " " for sign in str(failure)).split())
    if isinstance(failure, RecursionError):
        return "it is nested too deeply"
    if "set_int_max_str_digits" in text:
        return "a whole number has thousands of digits"
    return text[:SHOWN_MAX].rstrip(".")


# ---- messages about broken rules ----


def _sentence(model: type[Any], error: ValidationError, advice: str = "", whole: str = "the file") -> str:
    """Return rule, value and advice for the first broken rule; an unknown key comes before all others."""
    found = error.errors(include_url=False)
    first = next((each for each in found if each["type"] in _UNKNOWN), found[0])
    kind, given = first["type"], first["input"]
    path, place = _place(model, first["loc"])
    name = _named(model, path) or whole
    if kind in _UNKNOWN:
        key, known = str(first["loc"][-1]), list(_hints(place.base))
        rule = f"{name} must have known keys only, but it has {shown(key)}."
        return f"{rule}{nearest(key, known)} Known are {', '.join(known)}."
    if kind == "value_error":
        # A rule that begins with 'must' is one of the field; any other names its keys itself, but not the entry.
        said, entry = str(first["ctx"]["error"]), _named(model, path[: _entry_depth(model, path)])
        return f"{name} {said}" if said.startswith("must ") else f"{entry}: {said}" if entry else said
    way_out = place.description or advice
    if kind == "missing":
        return f"{name} must be given, but it is missing. {way_out}".rstrip()
    if isinstance(given, str) and (names := _names(place)):
        way_out = f"{nearest(given, names)} {way_out}".lstrip()
    if kind == "union_tag_invalid":
        tags = [bound.tag for each in _alternatives(place.base) for bound in each.bounds if isinstance(bound, Tag)]
        way_out = f"{nearest(first['ctx']['tag'], tags)} {way_out}".lstrip()
    return f"{name} must be {_rule(place)}, but it was {shown(given)}. {way_out}".rstrip()


_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")


class _Place(NamedTuple):
    """The declaration at a place of a model: type, bounds and description."""

    base: Any
    bounds: tuple[Any, ...]
    description: str


def _place(model: Any, loc: tuple[int | str, ...]) -> tuple[tuple[int | str, ...], _Place]:
    """Return the place of a broken rule, without the names of alternatives that pydantic adds, and its declaration."""
    here = _declared(model)
    path: list[int | str] = []
    for part in loc:
        hints = _hints(here.base)
        if isinstance(part, int) and part < len(hints):
            # An argument without its name.
            part = list(hints)[part]
        if part in hints:
            here = _declared(hints[str(part)])
        elif isinstance(part, int) and get_origin(here.base) is tuple:
            inner = _declared(get_args(here.base)[0])
            here = inner._replace(description=inner.description or here.description)
        elif get_origin(here.base) is dict:
            here, part = _declared(get_args(here.base)["[key]" not in loc]), str(part)[: SHOWN_MAX // 4]
        else:
            # pydantic names the alternative that it has taken.
            tagged = (each for each in _alternatives(here.base) if Tag(str(part)) in each.bounds)
            here = next(tagged, here)
            continue
        path.append(part)
    return tuple(path), here


def _declared(hint: Any) -> _Place:
    """Return the declaration of an annotation; for an optional one, that of its value."""
    if get_origin(hint) in (Union, types.UnionType):
        parts = [part for part in get_args(hint) if part is not type(None)]
        if len(parts) == 1:
            return _declared(parts[0])
    if get_origin(hint) is not Annotated:
        return _Place(hint, (), "")
    inner = _declared(get_args(hint)[0])
    bounds, description = list(inner.bounds), inner.description
    for said in get_args(hint)[1:]:
        bounds += said.metadata if isinstance(said, FieldInfo) else [said]
        description = getattr(said, "description", None) or description
    return _Place(inner.base, tuple(bounds), description)


def _alternatives(hint: Any) -> list[_Place]:
    is_union = get_origin(hint) in (Union, types.UnionType)
    return [_declared(part) for part in get_args(hint)] if is_union else []


@cache
def _hints(kind: Any) -> dict[str, Any]:
    """Return the fields of a record or a named tuple with their annotations."""
    if not isinstance(kind, type) or not (dataclasses.is_dataclass(kind) or hasattr(kind, "_fields")):
        return {}
    return get_type_hints(kind, include_extras=True)


def _named(model: Any, path: tuple[int | str, ...]) -> str:
    """Return the name of a place in messages: 'body.diameter_mm', 'proximity.gain[4]', 'start 2: at_mm'."""
    text = ""
    for depth, part in enumerate(path, start=1):
        if isinstance(part, str):
            text += part if not text or text.endswith(" ") else f".{part}"
        elif _hints(_place(model, path[:depth])[1].base):
            text += f" {part + 1}" + (": " if depth < len(path) else "")
        else:
            text += f"[{part}]"
    return text


def _entry_depth(model: Any, path: tuple[int | str, ...]) -> int:
    """Return the number of parts of a path up to the innermost entry of a list of tables; 0 without one."""
    depths = [depth for depth, part in enumerate(path, start=1) if isinstance(part, int)]
    return max((depth for depth in depths if _hints(_place(model, path[:depth])[1].base)), default=0)


def _names(place: _Place) -> list[str]:
    """Return the names to choose from, if the declaration is a choice."""
    if get_origin(place.base) is Literal:
        return [str(each) for each in get_args(place.base)]
    return [name for bound in place.bounds if isinstance(bound, OneOf) for name in bound.names]


def _rule(place: _Place) -> str:
    """Return the rule of a value as text."""
    base, bounds, _ = place
    said = next((bound.text for bound in bounds if isinstance(bound, Rule)), None)
    if said is not None:
        return said
    if names := _names(place):
        if len(names) == 1:
            return names[0]
        return f"one of {', '.join(map(repr, names))}"
    limits = {name: getattr(bound, name) for bound in bounds for name in _LIMITS if hasattr(bound, name)}
    if get_origin(base) is tuple:
        inner = _declared(get_args(base)[0])
        low, high = limits.get("min_length", 0), limits.get("max_length")
        count = f"{low} " if low == high else f"{low} to {high} " if high else f"{low} or more " if low else ""
        is_table = _hints(inner.base) and not any(isinstance(bound, Rule) for bound in inner.bounds)
        of = "" if is_table else f", each {_rule(inner)}"
        return f"a list of {count}{'tables' if not of else 'values'}{of}"
    if base is str:
        count = f"{'1 to' if 'min_length' in limits else 'up to'} {limits.get('max_length', TEXT_MAX)}"
        return f"a text of {count} characters"
    if base is bool:
        return "true or false"
    if base in (int, float):
        span = _span(limits)
        return f"a {'whole ' if base is int else '' if span else 'finite '}number{span}"
    if base is Callable or get_origin(base) is Callable:
        return "a function"
    is_other = isinstance(base, type) and base.__module__.startswith("kiks.") and not _hints(base)
    return f"a kiks.{base.__name__}" if is_other else "a table"


_LIMITS = ("ge", "gt", "le", "lt", "min_length", "max_length")


def _span(limits: Mapping[str, Any]) -> str:
    low, high = limits.get("ge", limits.get("gt")), limits.get("le", limits.get("lt"))
    above, below = "gt" in limits, "lt" in limits
    if low is None and high is None:
        return ""
    if high is None:
        return f" above {low:g}" if above else f" of at least {low:g}"
    if low is None:
        return f" below {high:g}" if below else f" of at most {high:g}"
    if not above and not below:
        return f" from {figure(low)} to {figure(high)}"
    return f" {'above' if above else 'of at least'} {figure(low)} and {'below' if below else 'at most'} {figure(high)}"
