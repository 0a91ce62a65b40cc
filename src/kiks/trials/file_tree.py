"""The files of a folder or an archive of somebody else, read into memory within bounds.

Need: an archive may come from anybody. It may claim any size, be damaged, name files elsewhere and hold links, and no
such file may cost another person anything. Method: nothing is unpacked. A file that cannot be had stays in its place in
the tree, and says why when it is read.
"""

from __future__ import annotations

import io
import stat
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path, PurePosixPath
from typing import NoReturn

from kiks.errors import ParameterError, shown
from kiks.model.program_files import BYTES_MAX
from kiks.trials.hand_in import HAND_IN_BYTES_MAX

ENTRIES_MAX = 20_000
"""Most files in an archive or a folder of submissions."""

UNPACKED_MAX = 256 << 20
"""Most bytes in an archive whose files have no places of their own (.tar.gz): all before a file must be unpacked."""

DEPTH_MAX = 100
"""Most folders in each other."""

ARCHIVES = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tbz2", ".tar.xz", ".txz")
"""Endings of the archives that are read."""

_OF_SYSTEMS = ("__pycache__", "__MACOSX", "Thumbs.db", "desktop.ini")
"""What operating systems and Python leave in folders, beside names with a dot."""


class UnreadableError(Exception):
    """What was handed in cannot be read; the text is a clause that says why."""


@dataclass(frozen=True)
class File:
    """A file of a tree.

    Attributes:
        read: Returns its bytes, if there are at most so many.
        time_s: When it was written, in seconds since 1970; None if that is not known.

    Raises:
        UnreadableError: By `read`, if it cannot be had, or has more bytes.
    """

    read: Callable[[int], bytes]
    time_s: float | None = None


Folder = dict[str, "File | Folder"]
"""What is in a folder, by name."""


def archive_ending(name: str) -> str:
    """Return the ending of the name of an archive; empty for other files.

    Example:
        >>> archive_ending("Ada.tar.gz"), archive_ending("ada.py")
        ('.tar.gz', '')
    """
    return next((each for each in ARCHIVES if name.lower().endswith(each)), "")


def file_at(path: Path) -> File:
    """Return a file of the disk."""

    def read(most: int) -> bytes:
        with as_unreadable(shown(path.name)), path.open("rb") as file:
            return _bounded(file.read(most + 1), most)

    return File(read, path.stat().st_mtime)


@contextmanager
def as_unreadable(what: str) -> Iterator[None]:
    """Let any error be one of what was handed in: each kind of damage has an exception of its own."""
    try:
        yield
    except UnreadableError:
        raise
    except Exception as error:
        why = str(error).partition("\n")[0].rstrip(":.") or type(error).__name__
        raise UnreadableError(f"{what} cannot be read ({why})") from None


def tree_of_folder(folder: Path) -> Folder:
    """Return what is in a folder and below, without what begins with a dot; links are not followed.

    Raises:
        ParameterError: If there is too much in it.
    """
    count = 0

    def found_in(home: Path) -> Folder:
        nonlocal count
        tree: Folder = {}
        for path in sorted(home.iterdir()):
            if _is_wanted(path.name):
                count += 1
                tree[path.name] = found_at(path)
        if count > ENTRIES_MAX:
            raise ParameterError(
                f"a folder of submissions must have at most {ENTRIES_MAX} files, but {shown(str(folder))} has more. "
                "Give the folder in which the programs are."
            )
        return tree

    def found_at(path: Path) -> File | Folder:
        try:
            mode = path.lstat().st_mode
            if stat.S_ISDIR(mode):
                return found_in(path)
            if stat.S_ISREG(mode):
                return file_at(path)
        except (OSError, RecursionError) as error:
            return _refused(f"{shown(path.name)} cannot be read ({error})")
        what = "a link, which is not followed" if stat.S_ISLNK(mode) else "no file"
        return _refused(f"{shown(path.name)} is {what}")

    try:
        return found_in(folder)
    except OSError as error:
        raise ParameterError(
            f"{shown(str(folder))} must be readable, but: {error.strerror}. Check its rights."
        ) from None


def tree_of_archive(source: Path | bytes) -> Folder:
    """Return what is in an archive; nothing is unpacked yet.

    Raises:
        UnreadableError: If it cannot be read as a whole.
    """
    tree: Folder = {}
    with as_unreadable("its archive"):
        file: Path | io.BytesIO = source if isinstance(source, Path) else io.BytesIO(source)
        is_zip = zipfile.is_zipfile(file)
        if isinstance(file, io.BytesIO):
            file.seek(0)
        for count, (name, each) in enumerate((_in_zip if is_zip else _in_tar)(file)):
            if count >= ENTRIES_MAX:
                raise UnreadableError(f"its archive has more than {ENTRIES_MAX} files")
            _insert(tree, name, each)
    return tree


def descended(tree: Folder, ends: Callable[[str], object] = lambda name: False) -> Folder:
    """Return a tree without folders that hold all of it.

    Args:
        tree: The tree.
        ends: Whether a folder of this name stays.
    """
    while len(tree) == 1:
        ((name, only),) = tree.items()
        if isinstance(only, File) or ends(name):
            break
        tree = only
    return tree


def files_in(tree: Folder) -> Iterator[tuple[PurePosixPath, File]]:
    """Yield the files of a tree with their paths."""
    for name, each in tree.items():
        if isinstance(each, File):
            yield PurePosixPath(name), each
        else:
            yield from ((PurePosixPath(name, path), file) for path, file in files_in(each))


def _is_wanted(name: str) -> bool:
    return not name.startswith(".") and name not in _OF_SYSTEMS


def _refused(why: str) -> File:
    def read(most: int) -> NoReturn:
        raise UnreadableError(why)

    return File(read)


def _bounded(data: bytes, most: int) -> bytes:
    if len(data) > most:
        raise UnreadableError(f"it has more than {max(most, BYTES_MAX) >> 20} MiB")
    return data


def _insert(tree: Folder, name: str, entry: File | Folder) -> None:
    """Put an entry of an archive into its place; one that leads out of the archive cannot be read."""
    # Archives of Windows have backslashes.
    path = name.replace("\\", "/")
    parts = [part for part in path.split("/") if part not in ("", ".")]
    if path.startswith("/") or ".." in parts or (parts and ":" in parts[0]):
        entry = _refused(f"its archive names a file outside of it, {shown(name)}")
        parts = [part for part in parts if part != ".."]
    if not parts or not all(part == ".." or _is_wanted(part) for part in parts):
        return
    if len(parts) > DEPTH_MAX:
        parts, entry = parts[:1], _refused(f"its archive has more than {DEPTH_MAX} folders in each other")
    for part in parts[:-1]:
        below = tree.setdefault(part, {})
        if isinstance(below, File):
            tree[part] = _refused(f"its archive has {shown(part)} as a file and as a folder")
            return
        tree = below
    if isinstance(entry, File) and parts[-1] in tree and not isinstance(tree[parts[-1]], File):
        entry = _refused(f"its archive has {shown(parts[-1])} as a file and as a folder")
    if isinstance(entry, File):
        tree[parts[-1]] = entry
    else:
        tree.setdefault(parts[-1], entry)


def _in_zip(file: Path | io.BytesIO) -> Iterator[tuple[str, File | Folder]]:
    archive = zipfile.ZipFile(file)

    def reader(entry: zipfile.ZipInfo) -> Callable[[int], bytes]:
        def read(most: int) -> bytes:
            with as_unreadable(f"{shown(entry.filename)} in its archive"), archive.open(entry) as opened:
                return _bounded(opened.read(most + 1), most)

        return read

    for entry in archive.infolist():
        if entry.is_dir():
            yield entry.filename, {}
        elif (is_link := stat.S_ISLNK(entry.external_attr >> 16)) or entry.flag_bits & 1:
            what = "a link" if is_link else "an encrypted file"
            yield entry.filename, _refused(f"its archive has {what}, {shown(entry.filename)}")
        else:
            yield entry.filename, File(reader(entry), _time_s(entry))


def _time_s(entry: zipfile.ZipInfo) -> float | None:
    """Return when an entry was written; archives that are made the same each time say 1980."""
    with suppress(ValueError, OverflowError, OSError):
        if entry.date_time[0] > 1980:
            return datetime(*entry.date_time).timestamp()
    return None


def _in_tar(file: Path | io.BytesIO) -> Iterator[tuple[str, File | Folder]]:
    unpacked = 0
    name, opened = (file, None) if isinstance(file, Path) else (None, file)
    with tarfile.open(name, fileobj=opened) as archive:
        for entry in archive:
            unpacked += entry.size
            if unpacked > UNPACKED_MAX:
                raise UnreadableError(f"its archive has more than {UNPACKED_MAX >> 20} MiB; a .zip may have more")
            content = archive.extractfile(entry) if entry.isfile() else None
            if content is not None:
                time_s = entry.mtime if 0 < entry.mtime < 1e11 else None  # it may say infinity
                yield entry.name, File(partial(_bounded, content.read(HAND_IN_BYTES_MAX + 1)), time_s)
            elif entry.isdir():
                yield entry.name, {}
            else:
                yield entry.name, _refused(f"its archive has a link, {shown(entry.name)}")
