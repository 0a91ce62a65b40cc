"""Files that come with KiKS: in the installed package, or beside `src` in a checkout."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from kiks.model.arena import Arena
from kiks.model.package import shipped


@cache
def shipped_arena(name: str) -> Arena:
    """Return an arena that comes with KiKS, such as 'maze' or 'training/rooms'; the same object each time."""
    return Arena.load(shipped_arenas()[name])


@cache
def shipped_arenas() -> dict[str, Path]:
    """Return the files of the arenas that come with KiKS, by name; those for training are in a folder of their own."""
    root = shipped("examples/arenas")
    return {path.relative_to(root).with_suffix("").as_posix(): path for path in sorted(root.rglob("*.toml"))}


def demonstrations() -> dict[str, Path]:
    """Return the projects that come with KiKS, by name."""
    return {path.stem: path for path in sorted(shipped("examples").glob("*/*.kiks"))}
