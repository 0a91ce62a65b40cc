"""Each name of a library that `src` uses is there, private ones too, whatever its version."""

import ast
import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec

from tests.test_layers import ROOT, SOURCES


def path_of(node: ast.AST | None, known: dict[str, str]) -> str | None:
    """Return the path of an expression such as `cgutils.is_null`, if it begins with something of a library."""
    if isinstance(node, ast.Attribute) and (owner := path_of(node.value, known)):
        return f"{owner}.{node.attr}"
    return known.get(node.id) if isinstance(node, ast.Name) else None


def used_names(source: str) -> Iterator[str]:
    """Yield the paths of what a file takes from libraries that are here, such as `numba.core.cgutils.is_null`."""
    nodes, known = list(ast.walk(ast.parse(source))), dict[str, str]()
    for node in nodes:
        for each in node.names if isinstance(node, ast.Import | ast.ImportFrom) else ():
            path = f"{node.module}.{each.name}" if isinstance(node, ast.ImportFrom) else each.name
            root = path.partition(".")[0]
            if root not in ("kiks", *sys.stdlib_module_names) and find_spec(root):
                yield path
                # `import a.b` makes the name a; all other ways make the last name.
                is_root = isinstance(node, ast.Import) and not each.asname
                known[root if is_root else each.asname or each.name] = root if is_root else path
    for node in nodes:
        # `_Result: Any = CompileResult` is the same under a name that has no types.
        if isinstance(node, ast.AnnAssign) and (path := path_of(node.value, known)):
            known[ast.unparse(node.target)] = path
    yield from filter(None, (path_of(node, known) for node in nodes))
    for node in nodes:
        bases = [path for each in getattr(node, "bases", ()) if (path := path_of(each, known))]
        for each in ast.walk(node) if len(bases) == 1 else ():
            # A method that is replaced must call the library's: one with a new name would never be called.
            if isinstance(each, ast.Attribute) and ast.unparse(each.value) == "super()":
                yield f"{bases[0]}.{each.attr}"


def is_there(path: str) -> bool:
    """Return whether a library has a name, as `import` and a dot look for it."""
    root, *names = path.split(".")
    found, so_far = import_module(root), root
    for name in names:
        so_far += f".{name}"
        try:
            found = getattr(found, name) if hasattr(found, name) else import_module(so_far)
        except ImportError:
            return False
        except RuntimeError:
            return True  # it has a value while a page is open only
    return True


def test_libraries_have_all_names_that_are_used() -> None:
    used = {path: file for file in SOURCES for path in used_names(file.read_text())}
    # The rarest kinds: an alias, a private name, a method behind super(), a name that NiceGUI makes itself.
    assert used.keys() >= {
        "numba.core.compiler.CompileResult._rebuild",
        "numba.config._config_fname",
        "numba.core.codegen.JITCodeLibrary._optimize_final_module",
        "nicegui.app.remove_route",
    }
    missing = [f"{path} ({file.relative_to(ROOT)})" for path, file in used.items() if not is_there(path)]
    assert not missing, "these versions of libraries lack " + ", ".join(missing)
    assert not is_there("numba.core.compiler.CompileResult._rebuild_of_another_version")
