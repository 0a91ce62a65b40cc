"""What students have handed in: programs in files, folders and archives, such as a platform exports.

Need: each hand-in is a row of the grades, whatever it is, and costs its own row only. Method: each entry of a folder or
an archive is a submission; `file_tree` reads it, and it is written into a folder of its own. What cannot be graded
stays in the table, with a line that says why.
"""

from __future__ import annotations

import re
import shutil
import tempfile
import unicodedata
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any

from kiks.errors import ParameterError, printable, shown
from kiks.meant import nearest_file
from kiks.model.atomic_files import explained
from kiks.model.notebook import code_cells
from kiks.model.program_files import BYTES_MAX, FILES_MAX, MAIN, ProgramFiles
from kiks.model.program_kinds import ENDINGS, ProgramKind, program_kind, program_text, why_not
from kiks.ports.program_command import ProgramCommand
from kiks.trials.file_tree import (
    File,
    Folder,
    UnreadableError,
    archive_ending,
    as_unreadable,
    descended,
    file_at,
    files_in,
    tree_of_archive,
    tree_of_folder,
)
from kiks.trials.hand_in import HAND_IN_BYTES_MAX, OF_THE_RUN, PROGRAM

SUBMISSIONS_MAX = 2000
"""Most submissions."""

NAME_MAX = 80
"""Most characters of a submission's name, and most bytes of its word in paths."""

_MARK = "ABOUT.txt"
"""File of a folder of copies, which may be deleted."""

_MAINS = [f"{name}{ending}" for ending in ENDINGS for name in ("__main__", "program", "main")]
"""Names of the file that runs, the first one that is there; of several kinds of programs, the first one counts."""

_MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?P<kind>[a-z]+)_?(?P<file>.*)", re.DOTALL)
"""How Moodle names what it exports: folders or files, for each student one for each kind of hand-in."""

_GRADESCOPE = re.compile(r"submission_metadata\.ya?ml")
"""The file in which Gradescope exports who has handed in what."""


@dataclass(frozen=True)
class Student:
    """What is known of a student, from a list or from what was handed in.

    Attributes:
        name: The name.
        participant: The number in Moodle; empty if it is not known.
        email: The address; empty if it is not known.
        time_s: When the student handed in last, in seconds since 1970; None if that is not known.
        last_graded: When Moodle has last changed the grade, as Moodle writes it; empty if that is not known.
        line: The number of the line on the list; 0 without one.
    """

    name: str
    participant: str = ""
    email: str = ""
    time_s: float | None = None
    last_graded: str = ""
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class Submission(Student):
    """A program that was handed in, or that a student has not handed in.

    Attributes:
        id: A word for it in paths, which no other submission has.
        command: The program; None if there is none to be graded.
        files: Texts of its programs' files, by their names.
        problem: Why it cannot be graded; empty if it can.
    """

    id: str
    command: ProgramCommand | None = None
    files: dict[str, str] = field(default_factory=dict)
    problem: str = ""


@dataclass
class _Found:
    """A submission whose files are not copied yet."""

    who: Student
    tree: Folder
    problem: str = ""


def submissions_in(paths: Sequence[Path], folder: Path, what: str = "SUBMISSIONS") -> list[Submission]:
    """Return the submissions in files, folders and archives; their files are copied below a folder.

    Args:
        paths: Programs; folders, each a program if it has a `__main__.py`, else with a submission in each entry;
            archives (.zip, .tar.gz) of the same, such as Moodle and Gradescope export, or one that the desk's page
            hands in.
        folder: Where the copies go: `ID/` for each submission.
        what: What messages call the paths.

    Example:
        >>> import tempfile
        >>> home = Path(tempfile.mkdtemp())
        >>> _ = (home / "ann.py").write_text("print(1)")
        >>> [(each.name, each.command.name) for each in submissions_in([home / "ann.py"], home / "copies")]
        [('ann', 'ann.py')]
    """
    found: list[_Found] = []
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
    return [_submission(each, folder, taken) for each in found]


def word_for(name: str, taken: set[str]) -> str:
    """Return a word for a name that is short in paths, which none of those taken is; then it is taken, too.

    Example:
        >>> word_for("Zoë O'Hara", {"zoë-o-hara"})
        'Zoë-O-Hara-2'
    """
    word = base = cut_to_bytes(re.sub(r"[^\w-]+", "-", unicodedata.normalize("NFC", name)).strip("-")) or "nameless"
    number = 1
    while word.lower() in taken:
        word = f"{base}-{(number := number + 1)}"
    taken.add(word.lower())
    return word


def cut_to_bytes(name: str) -> str:
    """Return as much of a name as a path takes in any file system."""
    return name.encode("utf-8", "ignore")[:NAME_MAX].decode("utf-8", "ignore")


def _found_in(path: Path, what: str) -> list[_Found]:
    """Return the submissions in a path."""
    if path.is_dir():
        tree = tree_of_folder(path)
        return [_Found(Student(path.name), tree)] if MAIN in tree else _split(tree)
    if not path.is_file():
        raise ParameterError(
            f"{what} must be files or folders, but there is no {shown(str(path))}.{nearest_file(path)}"
        )
    file = file_at(path)
    found = _Found(Student(_stem(path.name), time_s=file.time_s), {path.name: file})
    if not archive_ending(path.name):
        return [found]
    try:
        # As bytes it needs no open file.
        tree = tree_of_archive(path.read_bytes() if path.stat().st_size <= BYTES_MAX else path)
    except UnreadableError as problem:
        found.problem = str(problem)
        return [found]
    is_one = not tree or any(name in tree for name in _MAINS)
    return [found] if is_one else _split(tree)


def _stem(name: str) -> str:
    ending = archive_ending(name)
    return name[: -len(ending)] if ending else PurePosixPath(name).stem


def _split(tree: Folder) -> list[_Found]:
    """Return the submissions in a tree: one for each entry, but those that Moodle marks as one student's."""
    tree = descended(tree, _MOODLE.fullmatch)
    listed: dict[str, Student] = {}
    for name in [each for each in tree if _GRADESCOPE.fullmatch(each)]:
        listed |= _listed_by_gradescope(tree.pop(name))
    found: dict[str, _Found] = {}
    for name, entry in sorted(tree.items()):
        if moodle := _MOODLE.fullmatch(name):
            student = found.setdefault(f"participant/{moodle['id']}", _Found(Student(moodle["name"], moodle["id"]), {}))
            if moodle["kind"] != "file":
                # A text that was written beside the files; as an id cannot have it, the row is the student's.
                student.problem = student.problem or "it has a text that was written online, and no file"
                continue
            student.tree.update({moodle["file"] or PROGRAM: entry} if isinstance(entry, File) else entry)
        elif isinstance(entry, File):
            found[name] = _Found(Student(_stem(name)), {name: entry})
        else:
            found[name] = _Found(listed.get(name) or Student(name), entry)
    for each in found.values():
        each.problem = "" if each.tree else each.problem
    return [*found.values()]


def _listed_by_gradescope(file: File | Folder) -> dict[str, Student]:
    """Return the students of a list that Gradescope exports, by their folders; nothing of an entry that is none."""
    import yaml

    class Loader(yaml.SafeLoader):  # type: ignore[misc, unused-ignore]
        """A loader of plain values: what says to be an object of Ruby is a table."""

    Loader.add_multi_constructor("!ruby/", lambda loader, _, node: loader.construct_mapping(node, deep=True))
    found: dict[str, Student] = {}
    with suppress(Exception):  # the folders are graded without their names
        assert isinstance(file, File)
        table: dict[str, Any] = yaml.load(file.read(BYTES_MAX), Loader)
        for folder, entry in table.items():
            with suppress(Exception):
                people = entry[":submitters"]
                names, emails = (", ".join(str(each.get(key) or "") for each in people) for key in (":name", ":email"))
                time = entry.get(":created_at")
                time_s = time.timestamp() if isinstance(time, datetime) else None
                found[folder] = Student(names, email=emails, time_s=time_s)
    return found


def _submission(found: _Found, folder: Path, taken: set[str]) -> Submission:
    """Return a submission, its files copied into a folder of its own."""
    name = " ".join(printable(found.who.name).split())[:NAME_MAX] or "nameless"
    word = word_for(name, taken)
    problem, time_s = found.problem, found.who.time_s
    command: ProgramCommand | None = None
    texts: dict[str, str] = {}
    if not problem:
        try:
            with as_unreadable("it"):  # whatever a stranger has found out, it costs this row only
                times = [file.time_s for _, file in files_in(found.tree) if file.time_s is not None]
                time_s = max(times, default=None) if time_s is None else time_s
                data = _read(found.tree)
                programs = [path for path in data if path.suffix.lower() in ENDINGS]
                texts = {printable(str(path), "_"): program_text(path, data[path]) for path in programs}
                main = next(iter(data))
                if program_kind(main) is ProgramKind.NOTEBOOK:
                    code_cells(data[main], main.name)
                problem = why_not(main) if program_text(main, data[main]).strip() else f"{main} has no code"
                command = None if problem else ProgramCommand(_written(data, folder / word))
        except UnreadableError as error:
            problem = str(error)
    who = vars(found.who) | {"name": name, "time_s": time_s}
    return Submission(**who, id=word, command=command, files=texts, problem=problem)


def _read(tree: Folder, *, is_nested: bool = False) -> dict[PurePosixPath, bytes]:
    """Return the files of a submission, within bounds, the one that runs first."""
    tree = descended(tree)
    here = {name: each for name, each in tree.items() if isinstance(each, File)}
    programs = [name for name in here if Path(name).suffix.lower() in ENDINGS]
    archives = [name for name in here if archive_ending(name)]
    if not programs and len(archives) == 1 and not is_nested:
        return _read(tree_of_archive(here[archives[0]].read(HAND_IN_BYTES_MAX)), is_nested=True)
    main = PurePosixPath(_main_program(programs, tree))
    files = dict(files_in(tree))
    if main.stem == PurePosixPath(PROGRAM).stem:
        files = {path: file for path, file in files.items() if str(path) not in OF_THE_RUN}
    if len(files) > FILES_MAX:
        raise UnreadableError(f"it has more than {FILES_MAX} files")
    left, data = BYTES_MAX, {}
    for path in sorted(files, key=lambda path: path != main):
        data[path] = files[path].read(left)
        left -= len(data[path])
    return data


def _main_program(programs: Sequence[str], tree: Folder) -> str:
    """Return which of the programs of a submission runs."""
    if mains := [each for name in _MAINS for each in programs if each.lower() == name]:
        return mains[0]
    for ending in ENDINGS:
        kind = [name for name in programs if name.lower().endswith(ending)]
        first = kind if len(kind) < 2 else _independent(kind, tree)
        if len(first) == 1:
            return first[0]
        if kind:
            raise UnreadableError(
                f"it must have one program, but it has {_listed(kind)}; the one that runs is called __main__{ending}"
            )
    for each in tree.values():
        if isinstance(each, File):
            each.read(HAND_IN_BYTES_MAX)  # what cannot be read says why
    raise UnreadableError(
        f"it has no program, a file that ends in {', '.join(ENDINGS)}: "
        + (f"there is {_listed(tree)}" if tree else "its folder is empty")
    )


def _independent(programs: Sequence[str], tree: Folder) -> list[str]:
    """Return those of several programs that belong to no other one; tests are none."""
    programs = [name for name in programs if not name.startswith("test_")]
    with tempfile.TemporaryDirectory() as home:
        for name in programs:
            if isinstance(file := tree[name], File):
                Path(home, name).write_bytes(file.read(BYTES_MAX))
        used = {each for name in programs for each in ProgramFiles(Path(home, name)).files if each != name}
    return [name for name in programs if name not in used]


def _listed(names: Iterable[str]) -> str:
    names = sorted(map(printable, names))
    return ", ".join(names[:5]) + (" and more" if len(names) > 5 else "")


def _written(data: dict[PurePosixPath, bytes], folder: Path) -> Path:
    """Write the files of a program below a folder; return the program."""
    try:
        # A name that is no text would end a run that records it.
        return ProgramFiles.unpack({printable(str(path), "_"): text for path, text in data.items()}, folder)
    except (OSError, ValueError) as error:
        raise UnreadableError(f"its files cannot be written ({error})") from None
