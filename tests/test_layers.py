"""Imports point down only, folder by folder and file by file (docs/explanation/design.md, section 2)."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import kiks

ROOT = Path(kiks.__file__).parent

# Each folder or file may import those that stand before it, and itself.
LAYERS = [
    "version",
    "upwards",
    "errors",
    "units",
    "ending",
    "model",
    "engine",
    "control",
    "firmware",
    "clock",
    "sim",
    "recording",
    "ports",
    "script",
    "client",
    "batch",
    "export",
    "learn",
    "controllers",
    "measures",
    "tasks",
    "fit",
    "trials",
    "desk",
    "toolbox",
    "cli",
]

# What of the standard library only some layers may touch.
CLOCKS = {"time", "datetime"}
MAY_SEE_THE_WALL_CLOCK = {"clock", "recording", "script", "client", "learn", "trials", "desk", "toolbox", "cli"}
RANDOM = {"random", "secrets"}
MAY_HAVE_SECRETS = {"desk", "toolbox"}

SOURCES = sorted(ROOT.rglob("*.py"))


def layer(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def imports(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_down(path: Path) -> None:
    here = layer(path)
    if here in ("__init__", "__main__"):
        return
    assert here in LAYERS, f"{path} lies in no layer: give it a place in LAYERS and in docs/explanation/design.md"
    for name in imports(path):
        parts = name.split(".")
        if parts[0] != "kiks" or len(parts) < 2 or parts[1] not in LAYERS:
            continue
        there = parts[1]
        assert LAYERS.index(there) <= LAYERS.index(here), f"{path} imports {name}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_clocks_and_chance_come_from_outside(path: Path) -> None:
    here = layer(path)
    roots = {name.split(".")[0] for name in imports(path)}
    if path.name == "chance.py":
        return  # of programs and libraries that draw from Python's own library, with a seed from outside
    assert not roots & (RANDOM - {"secrets"} if here in MAY_HAVE_SECRETS else RANDOM), (
        f"{path}: random numbers are counter-based (engine/numbers.py)"
    )
    if here not in MAY_SEE_THE_WALL_CLOCK:
        assert not roots & CLOCKS, f"{path} must not see the wall clock"


def module(path: Path) -> str:
    return ".".join(("kiks", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def modules_needed(path: Path, modules: set[str]) -> set[str]:
    """Return the modules of KiKS that a file imports: at the top, in functions, or for types alone."""
    needed = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            needed |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            # What a package is asked for is a module in it, or a name of its own.
            full = {f"{node.module}.{alias.name}" for alias in node.names}
            needed |= full & modules or {node.module}
    return needed & modules - {module(path)}


def test_no_files_import_each_other() -> None:
    modules = {module(path): path for path in SOURCES}
    try:
        TopologicalSorter({name: modules_needed(path, set(modules)) for name, path in modules.items()}).prepare()
    except CycleError as error:
        pytest.fail(f"imports must lead downwards, but these files form a cycle: {' -> '.join(error.args[1])}")


def test_each_public_name_is_there_and_shown() -> None:
    names = dir(kiks)
    assert {"Arena", "Khepera", "Simulation", "measures", "tasks", "__version__"} <= set(names)
    assert all(getattr(kiks, name) is not None for name in names)
