"""What belongs to a program: of its folder, the modules that it imports and the files that it names.

Need: a program is often more than a file. What belongs to it is handed in with it, seen in its sandbox, kept in its
recording and saved with its project; and where one of these files has changed, earlier outcomes do not count. All of
its folder would be too much: there are the programs of others, solutions, results. Method: its text is read, and that
of its modules. To it belong the modules beside it or below that it imports (in Octave, functions whose names it has);
the files there that a text in it names (`"table.csv"`, `"*.csv"`, `f"map{n}.txt"`); and all files in a folder there
that a text names (`"data"`). So the answer is there before the first run, and the same in each place. A folder with a
`__main__.py` is a program with all that is in it.
"""

from __future__ import annotations

import ast
import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path, PurePosixPath

from kiks.errors import ParameterError, shown
from kiks.model.notebook import code_cells
from kiks.model.program_kinds import ENDINGS, ProgramKind, program_kind

MAIN = "__main__.py"
"""The file that runs of a folder that is a program."""

FILES_MAX = 200
"""Most files of a program that is handed in."""

BYTES_MAX = 10 << 20
"""Most bytes of these. A larger file counts as changed by its size and date, not by its content."""

_SEEN_MAX = 5000
"""Most files that are looked at. If there are more, no outcome of the program is taken from earlier."""

_NAME_MAX = 200
_GAP = re.compile(r"%[-+ #0-9.]*[a-zA-Z]|\{[^{}]*\}|\*+|\?")
"""Where a text leaves a part of a name open: a conversion, a field, a wildcard."""


class ProgramFiles:
    """The files of a program.

    Args:
        program: Its file, or a folder with a `__main__.py`; a supervisor is one, too.
        module: The name under which `python -m` runs it; empty for none.
        arguments: Its arguments, which may name files, too.

    Attributes:
        main: The file that runs.
        folder: The folder from which its files are named.
        files: Its files by their names, the one that runs first.

    Example:
        >>> import tempfile
        >>> home = Path(tempfile.mkdtemp())
        >>> for name, text in {"drive.py": "import speeds", "speeds.py": "open('table.csv')", "table.csv": "1"}.items():
        ...     _ = (home / name).write_text(text)
        >>> list(ProgramFiles(home / "drive.py").files)
        ['drive.py', 'speeds.py', 'table.csv']
    """

    def __init__(self, program: Path, module: str = "", arguments: Iterable[str] = ()) -> None:
        program = Path(os.path.abspath(program))
        self.main = program / MAIN if program.is_dir() else program
        above = self.main.parents
        depth = module.count(".") + (self.main.name == MAIN) if module else 0
        self.folder = above[min(depth, len(above) - 1)]
        self._home = self.folder.resolve()
        self.files: dict[str, Path] = {}
        self._is_whole = True
        if self.main.name == MAIN:
            self._add(self.main)
            for path in self._all_in(self.main.parent):
                self._add(path)
        elif self.folder.name in ("site-packages", "dist-packages"):
            self._add(self.main)  # beside an installed module lie those of others
        else:
            self._add_named(self.main)
            self._add_texts(self.folder, [name for text in arguments for name in _file_names(text)])

    @property
    def digest(self) -> str:
        """A digest of their names and contents, which is another one when anything has changed."""
        made = hashlib.sha256(b"" if self._is_whole else os.urandom(32))
        for name, path in self.files.items():
            data = _content_of(path)
            made.update(b"%d %d\0" % (len(name), len(data)) + name.encode("utf-8", "surrogateescape") + data)
        return made.hexdigest()

    @property
    def shown(self) -> list[Path]:
        """The files and folders that a sandbox has to show."""
        return [self.main.parent] if self.main.name == MAIN else list(self.files.values())

    def pack(self) -> dict[str, bytes]:
        """Return their contents by their names, the one that runs first; `unpack` makes a program of them again.

        Raises:
            ParameterError: If there are too many, or one cannot be read.
        """
        packed: dict[str, bytes] = {}
        left = BYTES_MAX
        for name, path in self.files.items():
            try:
                with path.open("rb") as file:
                    packed[name] = file.read(left + 1)
            except OSError as error:
                raise ParameterError(
                    f"a file of a program must be one that can be read, but {shown(str(path))} cannot "
                    f"({error.strerror}). Save it first."
                ) from None
            left -= len(packed[name])
            if left < 0 or len(packed) > FILES_MAX:
                raise ParameterError(
                    f"a program must have at most {FILES_MAX} files and {BYTES_MAX >> 20} MiB, but {self.main.name} "
                    "has more with the files and folders that it names. Name fewer in it."
                )
        return packed

    @staticmethod
    def unpack(packed: Mapping[str, bytes], folder: Path) -> Path:
        """Write a program into a folder and return its path: that of its file, or of the folder if there are several.

        Args:
            packed: Contents by names, the file that runs first.
            folder: The folder, which is made.

        Raises:
            OSError: If a file cannot be written.
            ValueError: If a name cannot be that of a file.
        """
        main = next(iter(packed))
        # Python runs a folder; a notebook and a program of Octave stay what they are.
        is_folder = main == MAIN or (len(packed) > 1 and main.endswith(".py"))
        for name, data in packed.items():
            path = folder / (MAIN if name == main and is_folder else name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        return folder if is_folder else folder / main

    # ---- inside ----

    def _add(self, path: Path) -> bool:
        """Add a file; return whether it is new."""
        name = path.relative_to(self.folder).as_posix()
        if name in self.files or len(self.files) >= _SEEN_MAX:
            self._is_whole &= name in self.files
            return False
        self.files[name] = path
        return True

    def _all_in(self, folder: Path) -> Iterator[Path]:
        """Yield all files in a folder and below, unless there are too many."""
        for home, folders, names in os.walk(folder):
            folders[:] = sorted(filter(_is_wanted, folders)) if self._is_whole else []
            yield from (path for name in sorted(names) if (path := Path(home, name)).is_file() and self._is_here(path))

    def _add_named(self, path: Path) -> None:
        """Add a file, and what it imports and names."""
        if not self._add(path) or path.suffix.lower() not in ENDINGS:
            return
        source = b""
        with suppress(OSError):
            source = path.read_bytes()
        modules, texts = _names_in(program_kind(path), source)
        package = path.parent.relative_to(self.folder).parts
        for level, module in modules:
            parts = module.split(".") if module else []
            parts = [*package[: len(package) - level + 1], *parts] if level else parts
            for count in range(1, len(parts) + 1):
                here = self.folder.joinpath(*parts[:count])
                for found in (here.with_suffix(".py"), here / "__init__.py"):
                    if found.is_file() and self._is_here(found):
                        self._add_named(found)
        for home in {self.folder: 0, path.parent: 0}:
            self._add_texts(home, texts)

    def _add_texts(self, home: Path, texts: Iterable[str]) -> None:
        """Add the files that texts name from a folder."""
        for found in (path for text in texts for path in _matching(home, text) if self._is_here(path)):
            for path in self._all_in(found) if found.is_dir() else [found] if found.is_file() else []:
                self._add_named(path)

    def _is_here(self, path: Path) -> bool:
        """Return whether a path leads into the folder, through links, too, and is not hidden."""
        with suppress(OSError, ValueError, RuntimeError):
            parts = path.relative_to(self.folder).parts
            return bool(parts) and all(map(_is_wanted, parts)) and path.resolve().is_relative_to(self._home)
        return False


def _is_wanted(name: str) -> bool:
    return not (name.startswith(".") or name == "__pycache__" or name.endswith(".pyc"))


def _content_of(path: Path) -> bytes:
    try:
        about = path.stat()
        if about.st_size > BYTES_MAX:
            return f"{about.st_size} {about.st_mtime_ns}".encode()
        return path.read_bytes()
    except OSError:
        return b""  # reported when the program runs


def _matching(home: Path, text: str) -> list[Path]:
    """Return the files and folders that a text names from a folder; if it leaves parts open, only files."""
    if "*" not in text:
        return [path] if os.path.lexists(path := home / text) else []
    try:
        return [path for path in sorted(home.glob(text)) if path.is_file()]
    except (OSError, ValueError, NotImplementedError):
        return []


@lru_cache(maxsize=256)
def _names_in(kind: ProgramKind, source: bytes) -> tuple[list[tuple[int, str]], list[str]]:
    """Return what a program imports, each with its level of relative imports, and what may name files."""
    if kind is ProgramKind.OCTAVE:
        text = source.decode("utf-8", "replace")
        # A quote may transpose, so each piece between two of them may be a text; commands need none: load table.txt
        pieces = [*re.split(r"['\"\n]", text), *re.findall(r"[\w./-]+\.\w+", text)]
        functions = {f"{folder}{name}.m" for name in re.findall(r"\b[A-Za-z]\w*", text) for folder in ("", "private/")}
        return [], sorted(functions.union(*map(_file_names, pieces)))
    if kind is ProgramKind.NOTEBOOK:
        with suppress(ParameterError):
            source = re.sub(r"(?m)^\s*[%!].*", "", "\n".join(code_cells(source, ""))).encode("utf-8", "replace")
    modules: dict[tuple[int, str], None] = {}
    texts: dict[str, None] = {}
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return [], []
    loads_by_name = b"import_module" in source or b"__import__" in source
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            modules |= dict.fromkeys((0, each.name) for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = f"{node.module}." if node.module else ""
            modules |= dict.fromkeys((node.level, f"{start}{each.name}") for each in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts |= dict.fromkeys(_file_names(node.value))
            if loads_by_name and re.fullmatch(r"\w+(\.\w+)*", node.value):
                modules[0, node.value] = None
        elif isinstance(node, ast.JoinedStr):
            parts = [each.value if isinstance(each, ast.Constant) else "*" for each in node.values]
            texts |= dict.fromkeys(_file_names("".join(map(str, parts))))
    return list(modules), list(texts)


def _file_names(text: str) -> Iterator[str]:
    """Yield a text, if it may name a file or a folder, with a wildcard for each part that it leaves open."""
    if not 0 < len(text) <= _NAME_MAX or not text.isprintable():
        return
    pattern = _GAP.sub("*", text.replace("\\", "/"))
    # A folder is put before a name as in HERE + "/table.csv" or f"{HERE}/table.csv".
    for each in {text.lstrip("/"): 0, pattern.lstrip("/"): 0, pattern.lstrip("*/"): 0}:
        path = PurePosixPath(each)
        # A pattern must say something of the name: that of print(f"{x}.{y}") would be any file.
        is_name = "*" not in each or (re.search(r"\w", path.name) and "." in path.name)
        if is_name and path.parts and ".." not in path.parts:
            yield str(path)
