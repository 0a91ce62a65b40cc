"""Recipes of a user's own controllers: tables in files that name a function in a module or in a Python file."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from kiks.errors import ParameterError, nearest, shown
from kiks.model.atomic_files import program_in
from kiks.model.data_file import Rule, Text, record


@record
class InModule:
    """A user's own controller, found by importing a module."""

    function: Annotated[Text, Field(pattern=r"^[\w.]+:[\w.]+$"), Rule("'package.module:name'")]


@record
class InFile:
    """A user's own controller, found by running a file that lies in the folder of the recipe's file or below."""

    file: Annotated[Text, Field(pattern=r"\.py$"), Rule("a Python file, *.py, in the folder of this file")]
    name: Annotated[Text, Field(min_length=1)]


def recipe_of(function: Callable[..., Any]) -> dict[str, Any] | None:
    """Return the recipe of a function: by its module if others can import that, else by its file.

    None if it cannot be imported: it was defined in another function, or typed into a console.
    """
    name = function.__qualname__
    if "<" in name:
        return None
    module = sys.modules.get(function.__module__)
    if module is not None and function.__module__ != "__main__":
        return {"function": f"{function.__module__}:{name}"}
    path = Path(function.__code__.co_filename)
    return {"file": str(path.absolute()), "name": name} if path.is_file() else None


def relative_to(recipe: Mapping[str, Any], folder: str | Path) -> dict[str, Any]:
    """Return a recipe with its file as seen from a folder, if it lies in there."""
    if "file" not in recipe:
        return dict(recipe)
    path, root = Path(recipe["file"]).absolute(), Path(folder).absolute()
    return {**recipe, "file": path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)}


def find(recipe: InModule | InFile, folder: str | Path) -> Any:
    """Return what a recipe of a user's own controller names. The module or file is run, as by `import`."""
    if isinstance(recipe, InFile):
        path = program_in(Path(folder), recipe.file, "the recipe's file")
        return _named(module_in(path), recipe.name, f"file {str(path)!r}")
    module_name, _, name = recipe.function.partition(":")
    try:
        module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise ParameterError(
            f"the recipe's module {shown(module_name)} must be one that Python can import, but: {shown(str(error))}. "
            "Start Python where it lies, or name its file instead."
        ) from None
    return _named(module, name, f"module {shown(module_name)}")


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


def _named(module: Any, name: str, where: str) -> Any:
    """Return the object with a dotted name in a module."""
    found = module
    for part in name.split("."):
        if not hasattr(found, part):
            known = tuple(vars(module))
            raise ParameterError(f"the {where} must define {shown(name)}, but does not.{nearest(name, known)}")
        found = getattr(found, part)
    return found
