"""Robot files as they are written: every section and key of a `RobotSpec`, whole or not at all."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import fields
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError
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
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise ParameterError(
            f"a robot file must go to a folder that can be written, but it was {str(path)!r} ({error.strerror}). "
            "Choose another folder."
        ) from None
    fresh = Path(name)
    try:
        with open(handle, "w", encoding="utf-8") as file:
            file.write(robot_toml(spec, comment))
        fresh.chmod(0o644)
        RobotSpec.load(fresh)
        os.replace(fresh, target)
    except OSError as error:
        raise ParameterError(
            f"a robot file must go to a writable place, but {str(path)!r} is none ({error.strerror}). Choose another."
        ) from None
    finally:
        fresh.unlink(missing_ok=True)


def robot_toml(spec: RobotSpec, comment: str = "") -> str:
    """Return the text of a robot file.

    Example:
        >>> robot_toml(RobotSpec.load("khepera"), "mine").splitlines()[:5]
        ['# mine', 'name = "Khepera"', '', '[body]', 'diameter_mm = 55.0']
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    sections = []
    for entry in fields(spec):
        value = getattr(spec, entry.name)
        if hasattr(value, "__dataclass_fields__"):
            sections += ["", f"[{entry.name}]"]
            sections += [f"{key.name} = {_toml(getattr(value, key.name))}" for key in fields(value)]
        elif value is not None:
            lines.append(f"{entry.name} = {_toml(value)}")
    return "\n".join(lines + sections) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool | str):
        return json.dumps(value)
    return repr(value)
