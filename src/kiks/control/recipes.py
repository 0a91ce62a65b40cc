"""Recipes of a user's own controllers: texts in files that name a function in a module or in a Python file."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from kiks.errors import ParameterError, shown
from kiks.meant import nearest
from kiks.model.atomic_files import path_of, program_in
from kiks.model.data_file import Rule, Text, record
from kiks.model.package import shipped
from kiks.model.program_kinds import ProgramKind

_CLASSICS = {
    "predator": "floreano_nolfi_1997",
    "prey": "floreano_nolfi_1997",
    "homing_network": "floreano_mondada_1996",
}
"""Files in `examples/classics/tasks` of controllers that older files of champions name in a module of KiKS."""


@record
class FunctionRecipe:
    """A user's own controller, found by importing a module, or by running a file in the recipe's folder or below."""

    function: Annotated[Text, Field(pattern=r"^.+:[\w.]+$"), Rule("'package.module:name' or 'file.py:name'")]


def file_of(recipe: Mapping[str, Any]) -> tuple[str, str]:
    """Return the Python file that a recipe names, and the name in it; the file is empty if there is none."""
    place, _, name = recipe.get("function", "").rpartition(":")
    return place if place.endswith(".py") else "", name


def recipe_of(function: Callable[..., Any]) -> dict[str, Any] | None:
    """Return the recipe of a function: by its module if others can import that, else by its file.

    None if it cannot be imported: it was defined in another function, or typed into a console.
    """
    name = function.__qualname__
    if "<" in name:
        return None
    if function.__module__ != "__main__" and function.__module__ in sys.modules:
        return {"function": f"{function.__module__}:{name}"}
    path = Path(function.__code__.co_filename)
    return {"function": f"{path.absolute()}:{name}"} if path.is_file() else None


def relative_to(recipe: Mapping[str, Any], folder: str | Path) -> dict[str, Any]:
    """Return a recipe with its file as seen from a folder, if it lies in there."""
    file, name = file_of(recipe)
    path, root = Path(file).absolute(), path_of(folder, "folder").absolute()
    return {"function": f"{path.relative_to(root)}:{name}"} if file and path.is_relative_to(root) else dict(recipe)


def find(recipe: FunctionRecipe, folder: str | Path) -> Any:
    """Return what a recipe of a user's own controller names. The module or file is run, as by `import`."""
    place, _, name = recipe.function.rpartition(":")
    if place == "kiks.learn.classic_tasks" and name in _CLASSICS:
        path = shipped(f"examples/classics/tasks/{_CLASSICS[name]}.py")
        found, where = module_in(path), f"file {str(path)!r}"
    elif place.endswith(".py"):
        path = program_in(Path(folder), place, "the recipe's file", [ProgramKind.PYTHON])
        found, where = module_in(path), f"file {str(path)!r}"
    else:
        where = f"module {shown(place)}"
        try:
            found = importlib.import_module(place)
        except (Exception, SystemExit) as error:
            raise ParameterError(
                f"the recipe's {where} must be one that Python can import, but: {shown(str(error))}. "
                "Start Python where it lies, or name its file instead."
            ) from None
    for part in name.split("."):
        if not hasattr(found, part):
            raise ParameterError(f"the {where} must define {shown(name)}, but does not.{nearest(part, dir(found))}")
        found = getattr(found, part)
    return found


def module_in(path: Path) -> Any:
    """Run a Python file as a module of its own; once, until it has changed."""
    try:
        return _run(path, path.stat().st_mtime_ns)
    except (Exception, SystemExit) as error:
        raise ParameterError(f"{str(path)!r} must be a Python file that runs, but it raised {shown(error)}.") from error


@functools.lru_cache(maxsize=256)
def _run(path: Path, changed_ns: int) -> Any:
    spec = importlib.util.spec_from_file_location(f"kiks file {path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
