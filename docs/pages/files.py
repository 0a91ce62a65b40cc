"""Makes the page `reference/files.md` from the schemas that `kiks schema` prints."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from typing import Any

from kiks.cli.schema import schema_of
from kiks.model.project import Project

INTRODUCTION = """# Files

Users write four kinds of files, all in [TOML](https://toml.io). This page is made from the rules by which KiKS checks
them; `kiks schema KIND` prints these rules, and [an editor can use them](../howto/editor.md). A key may be left out
unless it is **required**.
"""

KINDS = {
    "arena": "[Arenas](../howto/arenas.md) explains them.",
    "project": "[Projects](../howto/projects.md) explains them.",
    "task": "[Evolution](../howto/evolution.md#a-task-of-your-own) explains them.",
    "robot": "The file of the Khepera, at the end of this page, says what its numbers mean: copy and change it. "
    'Or name what differs alone: a file that is `like = "khepera"` needs no more than a name.',
}

PLAIN = {
    "integer": "whole number",
    "number": "number",
    "string": "text",
    "boolean": "`true` or `false`",
    "object": "table",
}

ARGUMENT = re.compile(r"^    (\w+): (.*(?:\n {5,}.*)*)", re.MULTILINE)
"""A line of a docstring's `Args:`."""


def limits(rule: dict[str, Any]) -> str:
    """Return the range of a number: `, 0 to 1023`."""
    least, most = rule.get("minimum", rule.get("ge")), rule.get("maximum", rule.get("le"))
    above, below = rule.get("exclusiveMinimum"), rule.get("exclusiveMaximum")
    # Limits that only keep arithmetic within its bounds tell a reader nothing.
    most = None if most is not None and most >= 1e9 else most
    least = None if least is not None and least <= -1e9 else least
    if least is not None and most is not None:
        return f", {least:.10g} to {most:.10g}"
    words = [(above, "above"), (least, "at least"), (below, "below"), (most, "at most")]
    return "".join(f", {word} {bound:.10g}" for bound, word in words if bound is not None)


def kind_of(rule: dict[str, Any]) -> str:
    """Return in words what a value must be."""
    if "const" in rule:
        return f"`{json.dumps(rule['const'])}`"
    if "enum" in rule:
        return ", ".join(f"`{json.dumps(each)}`" for each in rule["enum"])
    for several in ("anyOf", "oneOf"):
        if several in rule:
            return " or ".join(kind_of(each) for each in rule[several]) + limits(rule)
    if "$ref" in rule:
        name = title(rule["$ref"].rpartition("/")[2])
        return f"[{name}](#{name.lower()})"
    if rule.get("type") == "array":
        if "prefixItems" in rule:
            return f"list of {len(rule['prefixItems'])}: " + ", ".join(kind_of(each) for each in rule["prefixItems"])
        least, most = rule.get("minItems"), rule.get("maxItems")
        what = kind_of(rule.get("items", {})) or "values"
        many = what.replace("number", "numbers", 1) if what.startswith(("number", "whole number")) else what
        if rule.get("items", {}).get("type") == "array":
            many = f"lists of {what.removeprefix('list of ')}"
        return f"{least} {many}" if least == most and least else f"list of {many}"
    return PLAIN.get(rule.get("type", ""), "") + limits(rule)


def cell(text: str) -> str:
    """Return text as it stands in a cell of a table."""
    return " ".join(text.split()).replace("|", r"\|").replace("<", r"\<")


def table(model: dict[str, Any], more: str = "") -> Iterator[str]:
    """Yield the table of a model's keys; `more` is a docstring that tells of them, too."""
    yield "| key | value | meaning |"
    yield "|---|---|---|"
    texts = dict(ARGUMENT.findall(model.get("description", "") + inspect.cleandoc(more)))
    for key, rule in model["properties"].items():
        note = "; **required**" if key in model.get("required", ()) else ""
        default = rule.get("default")
        if isinstance(default, int | float) or (isinstance(default, str) and default):
            note = f"; `{json.dumps(default)}` if left out"
        meaning = texts.get(key) or rule.get("description", "")
        yield f"| `{key}` | {cell(kind_of(rule))}{note} | {cell(meaning)} |"
    yield ""


def title(name: str) -> str:
    """Return the heading of a model's section."""
    return name.removesuffix("Entry")


def first(text: str) -> str:
    """Return a description without its sections."""
    return re.split(r"\n\n(?:Args|Attributes|Example):", text)[0]


def page() -> str:
    """Return the page."""
    lines, seen = [INTRODUCTION], set()
    for kind, explained in KINDS.items():
        schema = schema_of(kind)
        # What a robot file needs that is like no other.
        whole = schema.pop("then", {"properties": {}})
        parts = whole.pop("properties")
        needed = {schema["properties"][key]["$ref"].rpartition("/")[2]: part for key, part in parts.items()}
        lines += [
            f"## {kind.capitalize()}",
            "",
            f"{first(schema['description'])} {explained}",
            "",
            *table(schema | whole, (Project.__doc__ or "") if kind == "project" else ""),
        ]
        for name, model in schema.get("$defs", {}).items():
            if "properties" in model and name not in seen:
                seen.add(name)
                lines += [
                    f"### {title(name)}",
                    "",
                    first(model.get("description", "")),
                    "",
                    *table(model | needed.get(name, {})),
                ]
    lines += ["## The robot file of the Khepera", ""]
    lines += ["```{literalinclude} ../../src/kiks/model/robots/khepera.toml", ":language: toml", "```", ""]
    return "\n".join(lines)
