"""Recipes: what a file says of a user's own controller, so that it can be found again.

{"function": "package.module:name"}     a name in a module that Python can import
{"file": "shy.py", "name": "shy"}       a name in a file, which lies relative to the recipe's folder
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, nearest


def recipe_of(function: Callable[..., Any]) -> dict[str, Any] | None:
    """Return the recipe of a function: by its module if others can import that, else by its file.

    None if nobody can find it again: it was defined in another function, or typed into a console.
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


def find(recipe: Mapping[str, Any], folder: str | Path) -> Any:
    """Return what a recipe of the above two kinds names. The module or file is run, as by `import`.

    Raises:
        ParameterError: If it is no such recipe, or there is no such module, file or name.
    """
    keys = set(recipe)
    if not all(isinstance(value, str) for value in recipe.values()):
        raise ParameterError(f"a recipe must have texts for function, file and name, but it was {dict(recipe)!r}.")
    if keys == {"function"}:
        module_name, colon, name = recipe["function"].partition(":")
        if not (module_name and colon and name):
            raise ParameterError(
                f"function in a recipe must be 'module:name', but it was {recipe['function']!r}. "
                "Write the module's full name, a colon and the controller's name."
            )
        try:
            module = importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            raise ParameterError(
                f"the recipe's module {module_name!r} must be one that Python can import, but: {error}. "
                "Start Python where it lies, or name its file instead."
            ) from None
        return _named(module, name, f"module {module_name!r}")
    if keys == {"file", "name"}:
        path = (Path(folder) / recipe["file"]).absolute()
        if not path.is_file():
            raise ParameterError(f"the recipe's file must exist, but there was none at {path}. Put it there.")
        return _named(_module_in(path, path.stat().st_mtime_ns), recipe["name"], f"file {path}")
    raise ParameterError(
        "a recipe must have a kind, or a function, or a file and a name, but it had "
        f"{', '.join(sorted(keys)) or 'nothing'}."
    )


def _named(module: Any, name: str, where: str) -> Any:
    """Return what a dotted name stands for in a module."""
    found = module
    for part in name.split("."):
        if not hasattr(found, part):
            raise ParameterError(f"the {where} must define {name!r}, but does not.{nearest(name, tuple(vars(module)))}")
        found = getattr(found, part)
    return found


@functools.lru_cache(maxsize=256)
def _module_in(path: Path, changed_ns: int) -> Any:
    """Run a file as a module of its own; once, until it has changed."""
    spec = importlib.util.spec_from_file_location(f"kiks recipe {path.stem}", path)
    if spec is None or spec.loader is None:
        raise ParameterError(f"the recipe's file must be a Python program, *.py, but it was {path}.")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
