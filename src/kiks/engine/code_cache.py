"""Machine code on the disk, in files that are checked before they are believed.

Need: Numba keeps machine code as pickles. A damaged one raises anything in the middle of a call, or ends the process,
and one that another user has written runs that user's code.
Method: each file holds one function for one signature, and the digests of what is in it. It is read only if it and its
folder belong to this user or the superuser and others cannot write there. A damaged file is deleted and its function
compiled again; damaged is what has not its digests, and nothing else.
The name of the folder is a digest of compilers and processor, and the name of a file has one of the sources that its
function is compiled from, so files of another version are never read. Neither paths nor times are part of them: the
files fit the same sources on another computer. A wheel can bring some. Of the sources they have the syntax trees
without docstrings: a changed comment compiles nothing again, and a changed kernel only what it is compiled into.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import gc
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
from kiks.model.atomic_files import NO_LINK_NO_WAIT, replace_file

KERNEL_FOLDERS = ("engine", "control", "batch")
"""Folders beside one another whose files hold kernels."""

CONSTANT_FILES = ("units.py", "model/*.py", "firmware/*.py")
"""Other files of the package, in which kernels find constants."""

SHIPPED = Path(__file__).parent / "compiled"
"""Folder of what a wheel brings (`make wheel`), with a folder for each version; most installations have none."""

# Numba has no types for these.
_numba: Any = serialize
_Result: Any = CompileResult

_FORMAT = b"kiks-code-2"
_HEAD = re.compile(_FORMAT + rb" ([0-9]{1,12}) ([0-9a-f]{64}) ([0-9a-f]{64})")
_DIGESTS = re.compile(r"(?:[\w.]+ [0-9a-f]{16}\n)+")
_ENDING = ".code"

_EVERYWHERE = ("kiks.engine.__init__", "kiks.engine.compiling", "kiks.engine.simd.")
"""Modules of which kernels are made that do not import them: they say how to compile, and what operators do."""

_ANNOTATION = 6
"""Where Numba puts the annotated source among the parts of a compiled function."""


class CodeCache:
    """The cache that Numba asks for the machine code of a function, in place of its own."""

    cache_path = ""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._module, self._name = function.__module__, f"{function.__module__}.{function.__qualname__}"

    def enable(self) -> None:
        """Do nothing; Numba asks for it."""

    disable = flush = enable

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return what was compiled for a signature; None if it has to be compiled."""
        with _no_garbage():
            context.refresh()
        key = _key(signature, context.codegen())
        for path in _files(self._name):
            if (payload := _payload(path, key)) is not None:
                parts, linked = payload
                if any(name not in _AT_LOAD for name in linked):
                    continue  # it calls a kernel with other arguments than the kernel takes by now
                for name in linked:
                    _AT_LOAD[name]()
                return _Result._rebuild(context, *parts)
        return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep what was compiled for a signature, where there is room for it."""
        if compiled.library.has_dynamic_globals:
            return
        key = _numba.dumps(_key(signature, compiled.library.codegen))
        parts = list(compiled._reduce())
        parts[_ANNOTATION] = ""  # a text for people, which names the folder of the sources
        payload = _numba.dumps((tuple(parts), _linked_in(compiled.library)))
        head = b" ".join((_FORMAT, str(len(key)).encode(), _digest(key), _digest(payload)))
        name = f"{self._name}-{digest_of(self._module)}-{_digest(key)[:16].decode()}{_ENDING}"
        data = head + b"\n" + key + payload
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
            tell(
                f"The compiled engine cannot be kept in {' or '.join(troubles)}, so {result}. "
                "Set NUMBA_CACHE_DIR to a folder of yours with room."
            )


@contextlib.contextmanager
def _no_garbage() -> Iterator[None]:
    """Let no garbage be looked for: to look through all that Numba makes as it starts takes a third of that time."""
    had_garbage_collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if had_garbage_collected:
            gc.enable()


_AT_LOAD: dict[str, Callable[[], None]] = {}


def at_load(name: str, ready: Callable[[], None]) -> None:
    """Call a function before machine code is loaded that refers to a symbol of this name."""
    _AT_LOAD[name] = ready


def _linked_in(library: Any) -> list[str]:
    """Return the symbols among those of `at_load` that machine code refers to."""
    return [each.name for each in library._final_module.global_variables if each.name in _AT_LOAD]


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
    """Return a digest of what all machine code depends on beside the sources: compilers, Python, processor."""
    config: Any = numba.config
    settings = processor(), config.OPT, bool(config.BOUNDSCHECK)
    versions = numba.__version__, llvmlite.__version__, np.__version__, sys.implementation.cache_tag
    return _digest(repr((settings, versions)).encode())[:16].decode()


def digest_of(module: str) -> str:
    """Return a digest of the sources that the kernels of a module are compiled from.

    For a module of others, these are its own source and those of all kernels.
    """
    digests = _digests()
    if module in digests:
        return digests[module]
    source = b""
    with _IfAllowed():
        source = Path(getattr(sys.modules.get(module), "__file__", None) or os.devnull).read_bytes()
    return _digest(repr(digests).encode() + source)[:16].decode()


@functools.cache
def _digests() -> dict[str, str]:
    """Return the digests of all modules of kernels.

    To parse the sources takes a fifth of a second. So the digests lie in a file beside the folders of code, under the
    digest of the sources' bytes.
    """
    sources = _sources()
    # Each version of Python writes syntax trees in its own way.
    name = f"sources-{_digest(repr((sys.version_info, sources)).encode())[:32].decode()}"
    for file in (root / name for root in (SHIPPED, *_roots())):
        with _IfAllowed():
            is_believed = _is_believed(file.parent) and _is_safe(file.lstat())
            if is_believed and _DIGESTS.fullmatch(text := file.read_bytes().decode(errors="replace")):
                return dict(line.split() for line in text.splitlines())
    syntax = _syntax(sources)
    digests = {module: _digest(text.encode())[:16].decode() for module, text in syntax.items()}
    data = "".join(f"{module} {digest}\n" for module, digest in digests.items()).encode()
    for root in _roots():
        with contextlib.suppress(ParameterError), _IfAllowed():
            _make_own(root)
            replace_file(root / name, data, rights=0o644)
    return digests


def _sources() -> dict[str, bytes]:
    """Return the sources of the kernels and of their constants, by the names of their modules."""
    package = Path(__file__).parent.parent
    globs = (*(f"{folder}/**/*.py" for folder in KERNEL_FOLDERS), *CONSTANT_FILES)
    paths = [path for each in globs for path in sorted(package.glob(each))]
    return {".".join(path.relative_to(package.parent).with_suffix("").parts): path.read_bytes() for path in paths}


def _syntax(sources: dict[str, bytes]) -> dict[str, str]:
    """Return what the kernels of each module are compiled from, as text: syntax trees without docstrings and places.

    These are its tree, those of the modules from which it imports more than linked kernels, and so on; those that give
    operators another meaning without being imported; and the constants that all of them import from elsewhere.

    Args:
        sources: Those of the kernels and of their constants, by the names of their modules.
    """
    trees = {name: ast.parse(source) for name, source in sources.items()}
    kernels = [name for name in trees if name.split(".")[1] in KERNEL_FOLDERS]
    functions = [(name, each) for name in kernels for each in trees[name].body if isinstance(each, ast.FunctionDef)]
    linked = {(name, each.name) for name, each in functions if "linked" in _names(*each.decorator_list)}
    needs: dict[str, set[str]] = {name: {name} for name in kernels}
    constants: dict[str, dict[tuple[str, str], ast.stmt]] = {name: {} for name in kernels}

    def find(found: dict[tuple[str, str], ast.stmt], module: str, name: str) -> None:
        """Find the constant of a module, and those that it is made of."""
        for statement in trees[module].body if module in trees and (module, name) not in found else ():
            if isinstance(statement, ast.ImportFrom) and name in (each.name for each in statement.names):
                find(found, statement.module or "", name)
            elif isinstance(statement, ast.Assign) and name in _names(*statement.targets):
                found[module, name] = statement
                for other in _names(statement.value):
                    find(found, module, other)

    for name in kernels:
        for node in ast.walk(trees[name]):
            if isinstance(node, ast.Import):
                needs[name].update(each.name for each in node.names)
            if isinstance(node, ast.ImportFrom):
                for each in node.names:
                    find(constants[name], node.module or "", each.name)
                    if (node.module, each.name) not in linked:
                        needs[name] |= {node.module or "", f"{node.module}.{each.name}"}
            if isinstance(body := getattr(node, "body", None), list):
                node.body = [each for each in body if not _is_text(each)]  # type: ignore[attr-defined]
    texts = {
        name: "".join(map(ast.dump, [trees[name], *(constants[name][key] for key in sorted(constants[name]))]))
        for name in kernels
    }
    everywhere = {name for name in kernels if name.startswith(_EVERYWHERE)}
    return {name: "".join(texts[each] for each in sorted(_closure(everywhere | {name}, needs))) for name in kernels}


def _closure(names: set[str], needs: dict[str, set[str]]) -> set[str]:
    """Return names with those that they need, directly or not."""
    new = names
    while new:
        new = {other for name in new for other in needs[name] if other in needs} - names
        names = names | new
    return names


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
    """Yield the files of a function that fit the sources."""
    for folder in (SHIPPED / _version(), *cache_folders()):
        found: list[Path] = []
        with _IfAllowed():
            found = sorted(folder.glob(f"{name}-*-*{_ENDING}"))
        for path in found:
            whole, digest, _ = path.name.rsplit("-", 2)
            if digest == digest_of(whole.rpartition(".")[0]):
                yield path


def _payload(path: Path, key: object) -> Any:
    """Return what a file holds; None if it is of another key, cannot be read, or is not believed.

    A damaged file is deleted, unless it came with KiKS.
    """
    folder, is_own = str(path.parent), path.parent.parent != SHIPPED
    with _IfAllowed(), open(os.open(path, os.O_RDONLY | NO_LINK_NO_WAIT), "rb") as file:
        if not (_is_safe(os.fstat(file.fileno())) and _is_believed(path.parent)):
            if is_own:
                tell(
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
            tell(f"Damaged files in {folder!r} are thrown away; what they held is compiled again.")
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
def tell(text: str) -> None:
    """Say something once, not for each function."""
    logging.getLogger("kiks.engine").warning(text)
