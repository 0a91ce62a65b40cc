"""Robot files as they are written: every section and key of a `RobotSpec`, whole or not at all."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from kiks.model.arena_file import quoted
from kiks.model.files import replace_file
from kiks.model.robot import RobotSpec


def save_robot(spec: RobotSpec, path: str | Path, *, comment: str = "") -> None:
    """Write a robot file that `RobotSpec.load` reads; an earlier file of that name is replaced in one step.

    Args:
        spec: The robot.
        path: Where it goes, usually 'something.toml'.
        comment: What stands above it, line by line.

    Raises:
        ParameterError: If the file cannot be written.
    """
    replace_file(path, robot_toml(spec, comment), "a robot")


def robot_toml(spec: RobotSpec, comment: str = "") -> str:
    """Return the text of a robot file.

    Example:
        >>> robot_toml(RobotSpec.load("khepera"), "mine").splitlines()[:5]
        ['# mine', 'name = "Khepera"', '', '[body]', 'diameter_mm = 55.0']
    """
    lines = [f"# {_printable(line)}".rstrip() for line in comment.splitlines()]
    sections = []
    for entry in fields(spec):
        value = getattr(spec, entry.name)
        if hasattr(value, "__dataclass_fields__"):
            sections += ["", f"[{entry.name}]"]
            sections += [f"{key.name} = {_toml(getattr(value, key.name))}" for key in fields(value)]
        elif value is not None:
            lines.append(f"{entry.name} = {_toml(value)}")
    return "\n".join(lines + sections) + "\n"


def _printable(line: str) -> str:
    """Return a line without characters that TOML allows in no comment."""
    return "".join(character if character.isprintable() else "?" for character in line)


def _toml(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return quoted(value) if isinstance(value, str) else repr(value)
