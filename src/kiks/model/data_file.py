"""Data files: read within a limit of size, checked against a declared model, rejected in one line.

A file that users write or receive is read completely or not at all. For any error, one line names the file, the key,
the rule, the value and what to do. No file takes much more memory than its size. A model is a class under `record`,
with the rules beside its fields (pydantic). `check` creates one from a table. Messages are pydantic's, with a field's
description as the advice. `what` is what they call the file, and `error` is the class that is raised.
"""

from __future__ import annotations

import dataclasses
import json
import os
import re
import tomllib
import types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar, Union, dataclass_transform, get_args, get_origin, get_type_hints

import numpy as np
import pydantic.dataclasses
from pydantic import ConfigDict, Field, Strict, Tag, TypeAdapter, ValidationError
from pydantic_core import core_schema

from kiks.errors import SHOWN_MAX, KiksError, ParameterError, printable, shown
from kiks.meant import nearest, nearest_file
from kiks.model.limits import DATA_FILE_BYTES_MAX
from kiks.model.package import where_from

TEXT_MAX = 1000
"""Most characters of a text in a file."""

KEY_PARTS_MAX = 16
"""Most parts of a dotted key; tomllib's memory grows with their square."""

COORDINATE_MAX = 1e9
"""Largest magnitude of a number that is a coordinate or a length [mm]."""


class Rule(NamedTuple):
    """The words for a field's rule, if those of pydantic do not say it well."""

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


def table_of(made: Any) -> dict[str, Any]:
    """Return what a file says of a record: all values that are not the default.

    Example:
        >>> @record
        ... class Circle:
        ...     radius_mm: float = 1.0
        ...     name: str = ""
        >>> table_of(Circle(radius_mm=2.0))
        {'radius_mm': 2.0}
    """
    values = ((each, getattr(made, each.name)) for each in dataclasses.fields(made))
    return {each.name: _plain(value) for each, value in values if value != each.default}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return table_of(value) if dataclasses.is_dataclass(value) else value


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
    """Return a record of the values of a file; messages end with `advice` where the field says nothing."""
    try:
        made: _Model = adapter(model).validate_python(values)  # type: ignore[arg-type] # a class can be hashed
    except ValidationError as broken:
        raise error(f"{what}: {_sentence(model, broken, advice)}") from None
    return made


@cache
def adapter(model: Any) -> TypeAdapter[Any]:
    """Return the object that validates a model and describes it as a JSON schema."""
    return TypeAdapter(model)


def as_list(values: object) -> object:
    """Return an array as a list, anything else unchanged: records hold no arrays."""
    return values.tolist() if isinstance(values, np.ndarray) else values


# ---- bytes ----


def read_file(
    path: Path, what: str, *, bytes_max: int = DATA_FILE_BYTES_MAX, error: type[KiksError] = ParameterError
) -> bytes:
    """Return the bytes of a file, of which there may be at most `bytes_max`."""
    try:
        if path.is_dir():
            raise error(f"{what} must be a file, but it is a folder. Name a file in it.")
        if not path.is_file():
            folder = "" if path.is_absolute() else f" and the folder {str(Path.cwd())!r}"
            advice = where_from(path, f"Check the name{folder}.{nearest_file(path)}")
            raise error(f"{what} must exist, but there is no such file. {advice}")
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


def parse_json(data: bytes, what: str) -> Any:
    """Return the content of a JSON file."""
    return _parsed(data, "JSON", json.loads, what, ParameterError)


def _parsed(data: bytes, kind: str, load: Callable[[str], Any], what: str, error: type[KiksError]) -> Any:
    try:
        return load(data.decode("utf-8"))
    except (ValueError, RecursionError, OverflowError) as failure:
        raise error(
            f"{what} must be {kind} in UTF-8, but: {one_line(failure)}. Correct the file at that place."
        ) from None


# Python 3.11.2, that of Debian 12, matches a possessive group wrongly: only single characters are repeated so.
_STRINGS_AND_COMMENTS = re.compile(
    r"""
    \"{3}(?:[^\\"]++|\\.|"(?!""))*\"{3} | '{3}(?:[^']++|'(?!''))*'{3}
    | "(?:[^"\\\n]++|\\.)*" | '[^'\n]*+' | \#[^\n]*+
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
    text = " ".join(printable(str(failure)).split())
    if isinstance(failure, RecursionError):
        return "it is nested too deeply"
    if "set_int_max_str_digits" in text:
        return "a whole number has thousands of digits"
    return text[:SHOWN_MAX].rstrip(".")


# ---- messages about broken rules: pydantic's own, with the place before it, the value and the advice after it ----

_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")

_WORDS = {
    r"^\w+ should ": "",
    r" after validation.*": "",
    r"a dictionary or an instance of \w+|a valid dictionary": "a table",
    r"an instance of (\w+)": r"a kiks.\1",
    "a valid tuple": "a list",
    "a valid string": "a text",
    "a valid integer": "a whole number",
    "a valid boolean": "true or false",
    "a valid number": "a number",
    "greater than or equal to": "at least",
    "less than or equal to": "at most",
}
"""What stands in place of Python's words: files are TOML and JSON."""


def _sentence(model: type[Any], error: ValidationError, advice: str = "", whole: str = "the file") -> str:
    """Return rule, value and advice for the first broken rule; an unknown key comes before all others."""
    found = error.errors(include_url=False)
    first = next((each for each in found if each["type"] in _UNKNOWN), found[0])
    kind, given = first["type"], first["input"]
    place, hint, description = _place(model, first["loc"])
    name, way_out = place.rstrip(":") or whole, description or advice
    if kind in _UNKNOWN:
        key, known = str(first["loc"][-1]), list(_fields(hint))
        rule = f"{name} must have known keys only, but it has {shown(key)}."
        return f"{rule}{nearest(key, known)} Known are {', '.join(known)}."
    if kind == "value_error":
        # A rule that begins with 'must' is one of the field; any other names its keys itself, but not the entry.
        said, entry = str(first["ctx"]["error"]), place[: place.rfind(":") + 1]
        return f"{name} {said}" if said.startswith("must ") else f"{entry} {said}".lstrip()
    if kind.startswith("missing"):
        return f"{name} must be given, but it is missing. {way_out}".rstrip()
    if kind == "union_tag_invalid":
        rules, given = [f"be one of {first['ctx']['expected_tags']}"], first["ctx"]["tag"]
    else:
        # Of a value that may be one of several things each one's rule is broken.
        alike = [each for each in found if _place(model, each["loc"])[0] == place]
        rules = [_own_rule(hint)] if _own_rule(hint) else [_rule(each["msg"]) for each in alike]
    choices = re.findall(r"'([^']*)'", " ".join(rules))
    hint_text = nearest(given, choices) if isinstance(given, str) else ""
    return f"{name} must {' or '.join(dict.fromkeys(rules))}, but it was {shown(given)}.{hint_text} {way_out}".rstrip()


def _own_rule(hint: Any) -> str:
    return next((f"be {each.text}" for each in _metadata(hint) if isinstance(each, Rule)), "")


def _rule(message: str) -> str:
    for words, ours in _WORDS.items():
        message = re.sub(words, ours, message)
    return message


def _place(model: Any, loc: tuple[int | str, ...]) -> tuple[str, Any, str]:
    """Return the place of a broken rule: its name ('body.diameter_mm', 'gain[4]', 'start 2:'), type and description."""
    name, hint, description = "", model, ""
    for part in loc:
        if isinstance(part, int) and isinstance(hint, type):
            part = list(_fields(hint))[part]  # an argument without its name
        tagged = [each for each in _parts(hint) if Tag(str(part)) in getattr(each, "__metadata__", ())]
        if tagged:
            hint = get_args(tagged[0])[0]  # pydantic names the alternative that it has taken
            continue
        fields, inner = _fields(hint), {get_origin(each): get_args(each) for each in reversed(list(_parts(hint)))}
        if part in fields:
            hint, description = fields[str(part)], ""
        elif isinstance(part, int) and tuple in inner:
            hint = inner[tuple][0]
            part = f" {part + 1}:" if _fields(hint) else f"[{part}]"
        elif dict in inner:
            hint, part = inner[dict]["[key]" not in loc], str(part)[: SHOWN_MAX // 4]
        else:
            continue  # the name of an alternative without a tag
        description = next(filter(None, (getattr(each, "description", "") for each in _metadata(hint))), description)
        name += part if not name or part.startswith((" ", "[")) else f" {part}" if name.endswith(":") else f".{part}"
    return name, hint, description


def _parts(hint: Any) -> Iterator[Any]:
    """Yield an annotation and all annotations in it, from outside to inside."""
    yield hint
    for each in get_args(hint):
        yield from _parts(each)


def _metadata(hint: Any) -> list[Any]:
    """Return what is said about a type beside it, the last word first; of an optional one what is said of its value."""
    if get_origin(hint) is Annotated:
        return [*reversed(hint.__metadata__), *_metadata(get_args(hint)[0])]
    optional = [each for each in get_args(hint) if each is not type(None)]
    return _metadata(optional[0]) if get_origin(hint) in (Union, types.UnionType) and len(optional) == 1 else []


@cache
def _hints(kind: type) -> dict[str, Any]:
    if dataclasses.is_dataclass(kind):
        # In the order of its arguments: annotations of a base that is no record would come first.
        names = [each.name for each in dataclasses.fields(kind)]
    else:
        names = getattr(kind, "_fields", [])
    hints = get_type_hints(kind, include_extras=True) if names else {}
    return {name: hints[name] for name in names}


def _fields(hint: Any) -> dict[str, Any]:
    """Return the fields of all records in an annotation with their annotations."""
    kinds = (each for each in _parts(hint) if isinstance(each, type))
    return {name: each for kind in kinds for name, each in _hints(kind).items()}
