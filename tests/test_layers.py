"""Imports point down only (docs/design.md, section 2)."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import kiks

ROOT = Path(kiks.__file__).parent

# Each folder or file may import those that stand before it, and itself.
LAYERS = [
    "errors",
    "units",
    "ending",
    "model",
    "engine",
    "control",
    "firmware",
    "clock",
    "sim",
    "ports",
    "script",
    "client",
    "batch",
    "drawing",
    "learn",
    "demos",
    "fit",
    "desk",
    "toolbox",
    "cli",
]

# `sim.port(1)` hands out the port in memory, `sim.show()` the desk, and a notebook shows arenas and simulations as
# pictures: calls upwards, made when they are asked for.
ALLOWED = {("sim", "ports"), ("sim", "desk"), ("sim", "drawing"), ("model", "drawing")}

# What of the standard library only some layers may touch.
CLOCKS = {"time", "datetime"}
MAY_SEE_THE_WALL_CLOCK = {"clock", "script", "client", "learn", "desk", "toolbox", "cli"}
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
    assert here in LAYERS, f"{path} lies in no layer: give it a place in LAYERS and in docs/design.md"
    for name in imports(path):
        parts = name.split(".")
        if parts[0] != "kiks" or len(parts) < 2 or parts[1] not in LAYERS:
            continue
        there = parts[1]
        assert LAYERS.index(there) <= LAYERS.index(here) or (here, there) in ALLOWED, f"{path} imports {name}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_clocks_and_chance_come_from_outside(path: Path) -> None:
    here = layer(path)
    roots = {name.split(".")[0] for name in imports(path)}
    assert not roots & (RANDOM - {"secrets"} if here in MAY_HAVE_SECRETS else RANDOM), (
        f"{path}: random numbers are counter-based (engine/numbers.py)"
    )
    if here not in MAY_SEE_THE_WALL_CLOCK:
        assert not roots & CLOCKS, f"{path} must not see the wall clock"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_fits_in_a_head(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 420
