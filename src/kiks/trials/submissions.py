"""What students have handed in: programs in files, folders and archives, such as a platform exports.

Need: an archive may come from anybody. It may claim any size, name files elsewhere and hold links. Method: nothing is
unpacked where it says. Files are read into memory within bounds, each under a name that was checked, and written into
a folder of the submission's own. What cannot be graded stays in the table, with a line that says why.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import stat
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from kiks.errors import ParameterError, printable, shown
from kiks.meant import nearest_file
from kiks.model.atomic_files import explained
from kiks.model.program_files import BYTES_MAX, FILES_MAX, MAIN, ProgramFiles
from kiks.ports.program_process import Command
from kiks.trials.hand_in import HAND_IN_BYTES_MAX, OF_THE_RUN, PROGRAM

ENTRIES_MAX = 20_000
"""Most files in an archive or a folder of submissions."""

SUBMISSIONS_MAX = 2000
"""Most submissions."""

NAME_MAX = 80
"""Most characters of a submission's name."""

_MARK = "ABOUT.txt"
"""File of a folder of copies, which may be deleted."""

_MAINS = (MAIN, PROGRAM, "main.py")
"""Names of the file that runs, the first one that is there."""

_MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_file_?(?P<file>.*)", re.DOTALL)
"""How Moodle names what it exports: a folder for each student, or files."""

_GRADESCOPE = re.compile(r"submission_metadata\.ya?ml")
"""The file in which Gradescope exports who has handed in what."""


@dataclass(frozen=True)
class Submission:
    """A program that was handed in.

    Attributes:
        name: Whose it is, from the name of its file or folder.
        id: A word for it in paths, which no other submission has.
        command: The program; None if there is none to be graded.
        files: Texts of its Python files, by their names.
        problem: Why it cannot be graded; empty if it can.
        participant: Its number in Moodle; empty if Moodle has not exported it.
        email: Its student's address, if the export says it.
    """

    name: str
    id: str
    command: Command | None
    files: dict[str, str] = field(default_factory=dict)
    problem: str = ""
    participant: str = ""
    email: str = ""


class _ProblemError(Exception):
    """A submission cannot be graded."""


_Tree = dict[PurePosixPath, Callable[[int], bytes]]
"""Files by their names, each with a function that reads it: at most some bytes, else it raises."""


def submissions_in(paths: Sequence[Path], folder: Path, what: str = "SUBMISSIONS") -> list[Submission]:
    """Return the submissions in files, folders and archives; their files are copied below a folder.

    Args:
        paths: Programs (.py); folders, each a program if it has a `__main__.py`, else with a submission in each entry;
            archives (.zip) of the same, such as Moodle and Gradescope export, or one that the desk's page hands in.
        folder: Where the copies go: `ID/` for each submission.
        what: What messages call the paths.

    Example:
        >>> import tempfile
        >>> home = Path(tempfile.mkdtemp())
        >>> _ = (home / "ann.py").write_text("print(1)")
        >>> [(each.name, each.command.name) for each in submissions_in([home / "ann.py"], home / "copies")]
        [('ann', 'ann.py')]
    """
    found: list[tuple[str, _Tree, str]] = []
    for path in paths:
        found += _found_in(path, what)
        if len(found) > SUBMISSIONS_MAX:
            raise ParameterError(
                f"{what} must be at most {SUBMISSIONS_MAX}, but there are more. Take some of them at once."
            )
    if not found:
        raise ParameterError(
            f"{what} must hold programs, but there is no .py, .zip or folder in them. Give files, or the folder or "
            "the archive in which they are."
        )
    with explained(folder, "the copies", "folder"):
        if folder.exists() and not (folder / _MARK).exists():
            raise ParameterError(
                f"the output folder must be new, or have earlier grades, but {shown(str(folder))} is there. Choose "
                "another one with --out."
            )
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        (folder / _MARK).write_text("KiKS copies programs here, and deletes this folder at its next start.\n")
        taken: set[str] = set()
        return [_submission(name, tree, problem, folder, taken) for name, tree, problem in found]


def _found_in(path: Path, what: str) -> list[tuple[str, _Tree, str]]:
    """Return name, files and problem of each submission in a path."""
    if path.is_dir():
        tree = _tree_of_folder(path)
        return [(path.name, tree, "")] if PurePosixPath(MAIN) in tree else [*_split(tree)]
    if not path.is_file():
        raise ParameterError(
            f"{what} must be files or folders, but there is no {shown(str(path))}.{nearest_file(path)}"
        )
    read = _reader(path)
    if not zipfile.is_zipfile(path):
        return [(path.stem, {PurePosixPath(path.name): read}, "")]
    try:
        tree = _tree_of_archive(path.read_bytes() if path.stat().st_size <= BYTES_MAX else path)
    except _ProblemError as problem:
        return [(path.stem, {}, str(problem))]
    is_one = any(PurePosixPath(name) in tree for name in _MAINS)
    found = [(path.stem, tree, "")] if is_one else [*_split(tree)]
    return found or [(path.stem, {}, "it has no program, a file that ends in .py")]


def _reader(path: Path) -> Callable[[int], bytes]:
    def read(most: int) -> bytes:
        with path.open("rb") as file:
            return _bounded(file.read(most + 1), most)

    return read


def _bounded(data: bytes, most: int) -> bytes:
    if len(data) > most:
        raise _ProblemError(f"it has more than {max(most, BYTES_MAX) >> 20} MiB")
    return data


def _tree_of_folder(folder: Path) -> _Tree:
    """Return the files in a folder and below, without links and what begins with a dot."""
    tree: _Tree = {}
    for home, folders, files in os.walk(folder):
        folders[:] = sorted(each for each in folders if _is_wanted(each) and not Path(home, each).is_symlink())
        for name in sorted(files):
            path = Path(home, name)
            if _is_wanted(name) and stat.S_ISREG(path.lstat().st_mode):
                tree[PurePosixPath(path.relative_to(folder).as_posix())] = _reader(path)
        if len(tree) > ENTRIES_MAX:
            raise ParameterError(
                f"a folder of submissions must have at most {ENTRIES_MAX} files, but {shown(str(folder))} has more. "
                "Give the folder in which the programs are."
            )
    return tree


def _is_wanted(name: str) -> bool:
    return not name.startswith(".") and name not in ("__pycache__", "__MACOSX")


def _tree_of_archive(source: Path | bytes) -> _Tree:
    """Return the files of an archive; nothing is unpacked yet."""
    try:
        archive = zipfile.ZipFile(source if isinstance(source, Path) else io.BytesIO(source))
        entries = archive.infolist()
    except (zipfile.BadZipFile, OSError, NotImplementedError, ValueError) as error:
        raise _ProblemError(f"its archive cannot be read ({error})") from None
    if len(entries) > ENTRIES_MAX:
        raise _ProblemError(f"its archive has more than {ENTRIES_MAX} files")
    tree: _Tree = {}
    for entry in entries:
        # Archives of Windows have backslashes.
        name = PurePosixPath(entry.filename.replace("\\", "/"))
        if entry.is_dir() or not name.parts:
            continue
        if name.is_absolute() or ".." in name.parts or ":" in name.parts[0]:
            raise _ProblemError(f"its archive names a file outside of it, {shown(entry.filename)}")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise _ProblemError(f"its archive has a link, {shown(entry.filename)}")
        if all(map(_is_wanted, name.parts)):
            tree[name] = _entry_reader(archive, entry)
    return tree


def _entry_reader(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Callable[[int], bytes]:
    def read(most: int) -> bytes:
        try:
            with archive.open(entry) as file:
                return _bounded(file.read(most + 1), most)
        except (zipfile.BadZipFile, OSError, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
            raise _ProblemError(f"{shown(entry.filename)} in its archive cannot be read ({error})") from None

    return read


def _split(tree: _Tree) -> Iterator[tuple[str, _Tree, str]]:
    """Yield the submissions in a tree: one for each entry, but those that Moodle marks as one student's."""
    tree = _descended(tree)
    groups: dict[str, _Tree] = {}
    for path, read in tree.items():
        top = path.parts[0]
        if len(path.parts) == 1 and path.suffix.lower() not in (".py", ".zip") and not _GRADESCOPE.fullmatch(top):
            continue
        moodle = _MOODLE.fullmatch(top)
        key, rest = (top, path.parts[1:]) if len(path.parts) > 1 else (top, (top,))
        if moodle is not None:
            key = f"{moodle['name']}_{moodle['id']}_assignsubmission_file"
            rest = rest if len(path.parts) > 1 else (moodle["file"] or PROGRAM,)
        groups.setdefault(key, {})[PurePosixPath(*rest)] = read
    names = _names_of_gradescope(groups)
    for key in sorted(groups):
        if key not in names:
            is_file = len(groups[key]) == 1 and PurePosixPath(key) in groups[key]
            yield PurePosixPath(key).stem if is_file else key, groups[key], ""
            continue
        yield names[key], groups[key], ""


def _descended(tree: _Tree) -> _Tree:
    """Return the tree without folders that hold all of it."""
    while tree and all(len(path.parts) > 1 for path in tree) and len({path.parts[0] for path in tree}) == 1:
        (top,) = {path.parts[0] for path in tree}
        if _MOODLE.fullmatch(top):
            break
        tree = {PurePosixPath(*path.parts[1:]): read for path, read in tree.items()}
    return tree


def _names_of_gradescope(groups: dict[str, _Tree]) -> dict[str, str]:
    """Take the list of students of an export of Gradescope out of some groups; return their names, by folders."""
    file = next((key for key in groups if _GRADESCOPE.fullmatch(key)), None)
    if file is None:
        return {}
    (read,) = groups.pop(file).values()
    try:
        text = read(BYTES_MAX).decode("utf-8", "replace")
    except _ProblemError:
        return {}
    names: dict[str, list[str]] = {}
    folder = ""
    for line in text.splitlines():
        if found := re.fullmatch(r"(submission_\d+):\s*", line):
            folder = found[1]
        elif folder and (found := re.fullmatch(r"\s+(?:- )?:(name|email): (.+)", line)):
            names.setdefault(folder, []).append(found[2].strip("'\" "))
    # Name and address of each student, side by side.
    return {key: ", ".join(values[::2]) + f" <{', '.join(values[1::2])}>" for key, values in names.items() if values}


def _submission(name: str, tree: _Tree, problem: str, folder: Path, taken: set[str]) -> Submission:
    """Return a submission, its files copied into a folder of its own."""
    moodle = _MOODLE.fullmatch(name)
    participant = moodle["id"] if moodle else ""
    email = found[1] if (found := re.search(r" <([^<>]*)>$", name)) else ""
    plain = moodle["name"] if moodle else name.removesuffix(f" <{email}>")
    plain = " ".join(printable(plain).split())[:NAME_MAX] or "nameless"
    word = base = re.sub(r"[^\w-]+", "-", plain).strip("-")[:NAME_MAX] or "nameless"
    number = 1
    while word.lower() in taken:
        word = f"{base}-{(number := number + 1)}"
    taken.add(word.lower())
    files: dict[str, str] = {}
    command = None
    if not problem:
        try:
            data = _read(tree)
            files = {
                str(path): text.decode("utf-8", "replace")
                for path, text in data.items()
                if path.suffix.lower() == ".py"
            }
            command = Command(_written(data, folder / word))
        except _ProblemError as error:
            problem = str(error)
    return Submission(plain, word, command, files, problem, participant, email)


def _read(tree: _Tree, *, is_nested: bool = False) -> dict[PurePosixPath, bytes]:
    """Return the files of a submission, within bounds, the one that runs first."""
    tree = _descended(tree)
    programs = [path for path in tree if path.suffix.lower() == ".py"]
    archives = [path for path in tree if path.suffix.lower() == ".zip"]
    if not programs and len(archives) == 1 and not is_nested:
        return _read(_tree_of_archive(tree[archives[0]](HAND_IN_BYTES_MAX)), is_nested=True)
    main = next((path for name in _MAINS if (path := PurePosixPath(name)) in tree), None)
    if main is None:
        here = [path for path in programs if len(path.parts) == 1]
        if len(here) != 1:
            raise _ProblemError(
                f"it must have one program, but it has {_listed(here)}; the one that runs is called {MAIN}"
                if here
                else "it has no program, a file that ends in .py"
            )
        (main,) = here
    if main.name == PROGRAM:
        tree = {path: read for path, read in tree.items() if str(path) not in OF_THE_RUN}
    if len(tree) > FILES_MAX:
        raise _ProblemError(f"it has more than {FILES_MAX} files")
    left, data = BYTES_MAX, {}
    for path in sorted(tree, key=lambda path: path != main):
        data[path] = tree[path](left)
        left -= len(data[path])
    return data


def _listed(paths: Iterable[PurePosixPath]) -> str:
    names = sorted(str(path) for path in paths)
    return ", ".join(names[:5]) + (" and more" if len(names) > 5 else "")


def _written(data: dict[PurePosixPath, bytes], folder: Path) -> Path:
    """Write the files of a program below a folder; return the program."""
    try:
        return ProgramFiles.unpack({str(path): text for path, text in data.items()}, folder)
    except (OSError, ValueError) as error:
        raise _ProblemError(f"its files cannot be written ({error})") from None
