"""Imports point down only, folder by folder and file by file (docs/explanation/design.md, section 2)."""

import ast
import functools
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from tools import house_figures

import kiks

ROOT = Path(kiks.__file__).parent

# Each folder or file may import those that stand before it, and itself.
LAYERS = [
    *(
        "version",
        "upwards",
        "errors",
        "meant",
        "unknown_names",
        "units",
        "table",
        "ending",
        "model",
        "engine",
        "firmware",
        "control",
        "clock",
        "sim",
    ),
    *("recording", "ports", "script", "client", "batch", "export", "learn", "controllers", "measures", "tasks", "fit"),
    *("run", "debug", "trials", "desk", "toolbox", "cli"),
]

# What of the standard library only some layers may touch.
CLOCKS = {"time", "datetime"}
MAY_SEE_THE_WALL_CLOCK = {
    "ending",
    "clock",
    "recording",
    "script",
    "client",
    "learn",
    "trials",
    "desk",
    "toolbox",
    "cli",
}
RANDOM = {"random", "secrets"}
MAY_HAVE_SECRETS = {"desk", "toolbox"}

SOURCES = sorted(ROOT.rglob("*.py"))


def layer(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


@functools.cache
def imports(path: Path) -> list[tuple[str, frozenset[str]]]:
    """Return each module that a file imports, at the top, in functions or for types alone, and the names out of it."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(alias.name, frozenset[str]()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.append((node.module, frozenset(f"{node.module}.{alias.name}" for alias in node.names)))
    return found


def test_imports_point_down_and_clocks_and_chance_come_from_outside() -> None:
    wrong = []
    for path in SOURCES:
        here = layer(path)
        roots = {start.split(".")[0] for start, _ in imports(path)}
        # `chance.py` is of programs and libraries that draw from Python's own library, with a seed from outside.
        if path.name != "chance.py":
            if roots & (RANDOM - {"secrets"} if here in MAY_HAVE_SECRETS else RANDOM):
                wrong.append(f"{path}: random numbers are counter-based (engine/numbers.py)")
            if here not in MAY_SEE_THE_WALL_CLOCK and roots & CLOCKS:
                wrong.append(f"{path} must not see the wall clock")
        if here in ("__init__", "__main__"):
            continue
        if here not in LAYERS:
            wrong.append(f"{path} lies in no layer: give it a place in LAYERS and in docs/explanation/design.md")
            continue
        above = set(LAYERS[LAYERS.index(here) + 1 :])
        for name in {name for start, names in imports(path) for name in (start, *names)}:
            if name.startswith("kiks.") and name.split(".")[1] in above:
                wrong.append(f"{path} imports {name}")
    assert not wrong, "\n".join(wrong)


def module(path: Path) -> str:
    return ".".join(("kiks", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def test_no_files_import_each_other() -> None:
    modules = {module(path): path for path in SOURCES}
    needed = {}
    for here, path in modules.items():
        # What a package is asked for is a module in it, or a name of its own.
        names = {name for start, names in imports(path) for name in (names & modules.keys() or {start})}
        needed[here] = names & modules.keys() - {here}
    try:
        TopologicalSorter(needed).prepare()
    except CycleError as error:
        pytest.fail(f"imports must lead downwards, but these files form a cycle: {' -> '.join(error.args[1])}")


def test_a_name_of_a_class_means_one_thing() -> None:
    places = {name: [str(path) for path, _ in found] for name, found in house_figures.classes().items()}
    assert len(places) > 400
    assert not [f"{name}: {', '.join(paths)}" for name, paths in places.items() if len(paths) > 1]
