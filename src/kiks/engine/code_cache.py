"""Machine code on the disk, in files that are checked before they are believed.

Need: Numba keeps machine code as pickles. A damaged one raises anything in the middle of a call, or ends the process,
and one that another user has written runs that user's code.
Method: each file holds one function for one signature, and the digests of what is in it. It is read only if it and its
folder belong to this user or the superuser and others cannot write there. A damaged file is deleted and its function
compiled again; damaged is what has not its digests, and nothing else.
The name of the folder is a digest of all that the code depends on, so files of another version are never read. Neither
paths nor times are part of it: the files fit the same sources on another computer. A wheel can bring some. Of the
sources it has the syntax trees without docstrings, so a changed comment compiles nothing again.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import logging
import os
import pickle
import re
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import serialize
from numba.core.compiler import CompileResult

from kiks.engine.processor import processor
from kiks.errors import ParameterError
from kiks.model.atomic_files import PLAINLY, replace_file

KERNEL_FOLDERS = ("engine", "control", "batch")
"""Folders beside one another whose files hold kernels."""

CONSTANT_FILES = ("units.py", "model/*.py", "firmware/*.py")
"""Other files of the package, in which kernels find constants."""

SHIPPED = Path(__file__).parent / "compiled"
"""Folder of what a wheel brings (`make wheel`), with a folder for each version; most installations have none."""

# Numba has no types for these.
_numba: Any = serialize
_Result: Any = CompileResult

_FORMAT = b"kiks-code-1"
_HEAD = re.compile(_FORMAT + rb" ([0-9]{1,12}) ([0-9a-f]{64}) ([0-9a-f]{64})")
_DIGEST = re.compile(rb"[0-9a-f]{64}")
_ENDING = ".code"

_ANNOTATION = 6
"""Where Numba puts the annotated source among the parts of a compiled function."""


class CodeCache:
    """The cache that Numba asks for the machine code of a function, in place of its own."""

    cache_path = ""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._name = f"{function.__module__}.{function.__qualname__}"

    def enable(self) -> None:
        """Do nothing; Numba asks for it."""

    disable = flush = enable

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return what was compiled for a signature; None if it has to be compiled."""
        context.refresh()
        key = _key(signature, context.codegen())
        for path in _files(self._name):
            if (payload := _payload(path, key)) is not None:
                return _Result._rebuild(context, *payload)
        return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep what was compiled for a signature, where there is room for it."""
        if compiled.library.has_dynamic_globals:
            return
        key = _numba.dumps(_key(signature, compiled.library.codegen))
        parts = list(compiled._reduce())
        parts[_ANNOTATION] = ""  # a text for people, which names the folder of the sources
        payload = _numba.dumps(tuple(parts))
        head = b" ".join((_FORMAT, str(len(key)).encode(), _digest(key), _digest(payload)))
        data, name = head + b"\n" + key + payload, f"{self._name}-{_digest(key)[:16].decode()}{_ENDING}"
        troubles = []
        for folder in cache_folders():
            try:
                _make_own(folder)
                # Others may read it, so that one user can compile for all, whatever the umask.
                replace_file(folder / name, data, rights=0o644)
            except (OSError, ParameterError) as error:
                cause = error.__cause__ or error
                if not (isinstance(cause, ParameterError) or getattr(cause, "strerror", None)):
                    raise cause from None  # of the handler of a signal
                troubles.append(f"{str(folder)!r} ({getattr(cause, 'strerror', cause)})")
            else:
                result = f"it is in {str(folder)!r}"
                break
        else:
            result = "each start compiles it"
        if troubles:
            _tell(
                f"The compiled engine cannot be kept in {' or '.join(troubles)}, so {result}. "
                "Set NUMBA_CACHE_DIR to a folder of yours with room."
            )


def is_compiled(name: str) -> bool:
    """Return whether there is machine code of a function on the disk, so that its first call is quick."""
    return any(_files(f"*.{name}"))


def cache_folders() -> Iterator[Path]:
    """Yield the folders for the compiled engine: the user's, then one among temporary files for when that fails."""
    for root in _roots():
        yield root / _version()
    with _IfAllowed():
        yield Path(tempfile.gettempdir(), f"kiks-code-{_user()}-{_version()}")


def _roots() -> Iterator[Path]:
    """Yield the folder in which the user's folders for compiled engines lie, if there is one."""
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        if root := os.environ.get(name):
            yield Path(root).absolute() / "kiks"
            return
    # A user may have none, or one that leads nowhere.
    with contextlib.suppress(RuntimeError):
        yield Path.home().absolute() / ".cache" / "kiks"


@functools.cache
def _version() -> str:
    """Return a digest of all that machine code depends on: sources, compilers, Python, processor."""
    config: Any = numba.config
    settings = processor(), config.OPT, bool(config.BOUNDSCHECK)
    versions = numba.__version__, llvmlite.__version__, np.__version__, sys.implementation.cache_tag
    return _digest(repr((_syntax_digest(), settings, versions)).encode())[:16].decode()


def _syntax_digest() -> bytes:
    """Return a digest of the syntax trees of all sources of kernels and of their constants.

    To parse the sources takes a fifth of a second. So the digest lies in a file beside the folders of code, under the
    digest of the sources' bytes.
    """
    package = Path(__file__).parent.parent
    globs = (*(f"{folder}/**/*.py" for folder in KERNEL_FOLDERS), *CONSTANT_FILES)
    paths = [path for each in globs for path in sorted(package.glob(each))]
    sources = {".".join(path.relative_to(package.parent).with_suffix("").parts): path.read_bytes() for path in paths}
    # Each version of Python writes syntax trees in its own way.
    name = f"sources-{_digest(repr((sys.version_info, sources)).encode())[:32].decode()}"
    for file in (root / name for root in (SHIPPED, *_roots())):
        with _IfAllowed():
            if _is_believed(file.parent) and _is_safe(file.lstat()) and _DIGEST.fullmatch(digest := file.read_bytes()):
                return digest
    digest = _digest(_syntax(sources).encode())
    for root in _roots():
        with contextlib.suppress(ParameterError), _IfAllowed():
            _make_own(root)
            replace_file(root / name, digest, rights=0o644)
    return digest


def _syntax(sources: dict[str, bytes]) -> str:
    """Return what kernels are compiled from as text: syntax trees without docstrings and places.

    Args:
        sources: Those of the kernels and of their constants, by the names of their modules.
    """
    trees = {name: ast.parse(source) for name, source in sources.items()}
    found: dict[tuple[str, str], ast.stmt] = {}

    def find(module: str, name: str) -> None:
        """Find the constant of a module, and those that it is made of."""
        for statement in trees[module].body if module in trees and (module, name) not in found else ():
            if isinstance(statement, ast.ImportFrom) and name in (each.name for each in statement.names):
                find(statement.module or "", name)
            elif isinstance(statement, ast.Assign) and name in _names(*statement.targets):
                found[module, name] = statement
                for other in _names(statement.value):
                    find(module, other)

    kernels = [tree for name, tree in trees.items() if name.split(".")[1] in KERNEL_FOLDERS]
    for node in (node for tree in kernels for node in ast.walk(tree)):
        if isinstance(node, ast.ImportFrom):
            for each in node.names:
                find(node.module or "", each.name)
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [each for each in body if not _is_text(each)]  # type: ignore[attr-defined]
    return "".join(map(ast.dump, [*kernels, *(found[key] for key in sorted(found))]))


def _names(*trees: ast.AST) -> set[str]:
    return {node.id for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Name)}


def _is_text(statement: ast.stmt) -> bool:
    value = getattr(statement, "value", None)
    return isinstance(statement, ast.Expr) and isinstance(value, ast.Constant) and isinstance(value.value, str)


def _key(signature: Any, codegen: Any) -> tuple[Any, ...]:
    """Return what distinguishes machine code of a function: the types, the system, the processor."""
    # Numba reads its settings again when the environment changes, but its compiler stays as it was made.
    triple, _, features = codegen.magic_tuple()
    return signature, (triple, processor()[0], features)


def _files(name: str) -> Iterator[Path]:
    """Yield the files of a function."""
    for folder in (SHIPPED / _version(), *cache_folders()):
        found: list[Path] = []
        with _IfAllowed():
            found = sorted(folder.glob(f"{name}-*{_ENDING}"))
        yield from found


def _payload(path: Path, key: object) -> Any:
    """Return what a file holds; None if it is of another key, cannot be read, or is not believed.

    A damaged file is deleted, unless it came with KiKS.
    """
    folder, is_own = str(path.parent), path.parent.parent != SHIPPED
    with _IfAllowed(), open(os.open(path, os.O_RDONLY | PLAINLY), "rb") as file:
        if not (_is_safe(os.fstat(file.fileno())) and _is_believed(path.parent)):
            if is_own:
                _tell(
                    "The compiled engine must be in files that you alone can write, but others can write those in "
                    f"{folder!r}. It is compiled again; set NUMBA_CACHE_DIR to a folder of yours."
                )
            return None
        line, _, rest = file.read().partition(b"\n")
        head = _HEAD.fullmatch(line)
        own_key, payload = (rest[: int(head[1])], rest[int(head[1]) :]) if head else (b"", b"")
        if head is not None and (_digest(own_key), _digest(payload)) == head.groups()[1:]:
            # Only now it is sure that these are pickles of ours.
            return pickle.loads(payload) if pickle.loads(own_key) == key else None
        if is_own:
            _tell(f"Damaged files in {folder!r} are thrown away; what they held is compiled again.")
            path.unlink()
    return None


class _IfAllowed:
    """Lets something be done as far as the system allows it. A TimeoutError of the handler of a signal goes on."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: object, trace: object) -> bool:
        return isinstance(error, OSError) and error.strerror is not None


def _is_safe(about: os.stat_result) -> bool:
    """Return whether no other user but the superuser can write something."""
    # Windows keeps the homes of users apart by other means than these bits.
    return _user() is None or (about.st_uid in (0, _user()) and not about.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _is_believed(folder: Path) -> bool:
    """Return whether there is a folder whose files no other user but the superuser can replace."""
    with _IfAllowed():
        # A link of another user could lead to a folder of ours that holds files of theirs.
        return all(each.lstat().st_uid in (0, _user() or 0) and _is_safe(each.stat()) for each in _made(folder))
    return False


def _make_own(folder: Path) -> None:
    """Make a folder that no other user can write to.

    Raises:
        OSError: If the folder cannot be made.
    """
    made = _made(folder)
    made[0].parent.mkdir(parents=True, exist_ok=True)
    for each in made:
        each.mkdir(mode=0o700 if str(each.parent) == tempfile.gettempdir() else 0o755, exist_ok=True)
    if not _is_believed(folder):
        raise PermissionError(None, "others may write there")


def _made(folder: Path) -> list[Path]:
    """Return which folders KiKS makes for a folder: itself, and above it the one that has the name of KiKS."""
    return [each for each in (folder.parent, folder) if each is folder or each.name == "kiks"]


def _user() -> int | None:
    """Return the number of this user; None on a system without such."""
    return os.geteuid() if hasattr(os, "geteuid") else None


def _digest(data: bytes) -> bytes:
    return hashlib.sha256(data).hexdigest().encode()


@functools.cache
def _tell(text: str) -> None:
    """Say something once, not for each function."""
    logging.getLogger("kiks.engine").warning(text)
