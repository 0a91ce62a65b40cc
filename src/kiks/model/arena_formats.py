"""The files that an arena can be read from, by their suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from kiks.model.arena import Arena
from kiks.model.arena_file import load_arena
from kiks.model.kad import load_kad
from kiks.model.project import Project

_READERS: dict[str, Callable[[Path], Arena]] = {
    ".toml": load_arena,
    ".kiks": lambda path: Project.load(path).arena,
    ".kad": load_kad,
}


def load_arena_file(path: Path) -> Arena:
    """Read an arena file, a project's arena, a `.kad` file of the Matlab KiKS, or a picture of 1 mm cells."""
    return _READERS.get(path.suffix.lower(), Arena.from_image)(path)
