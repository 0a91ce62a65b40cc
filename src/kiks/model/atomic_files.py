"""Atomic writing of files: completely or not at all."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath

from kiks.errors import KiksError, ParameterError, shown

NAME_BYTES_MAX, PATH_BYTES_MAX = 255, 4000
"""Most bytes of a file's name, and of a path, less than Linux allows."""


def replace_file(path: str | Path, data: bytes | str, what: str = "The file", *, rights: int | None = None) -> None:
    """Write a file in one step, and see that it is on the disk: whatever happens, it is the old or the new one.

    A link stays one, an earlier file's rights stay; what is no file (a pipe, a terminal) is written to as it is.

    Args:
        path: The file.
        data: Its content; text becomes UTF-8.
        what: Its name in messages.
        rights: Its permissions, at most; those of the earlier file, or those of the umask, if left out.

    Raises:
        ParameterError: If it cannot be written; an earlier file is then as it was.
    """
    replace_files({path_of(path, what): data}, what, rights=rights)


def replace_files(files: Mapping[Path, bytes | str], what: str = "The file", *, rights: int | None = None) -> None:
    """Write files that belong together like `replace_file`: none is replaced before all are on the disk.

    Raises:
        ParameterError: If one of them cannot be written; the earlier ones are then as they were.
    """
    fresh: dict[Path, Path] = {}
    path = Path()
    try:
        for path, data in files.items():
            target = _target(path)
            content = data.encode() if isinstance(data, str) else data
            if target.exists() and not target.is_file():
                target.write_bytes(content)
                continue
            fresh[target] = _name_beside(target)
            _write(fresh[target], content, 0o666 if rights is None else rights)
            if rights is None:
                _take_rights(fresh[target], target)
        for path, beside in fresh.items():
            os.replace(beside, path)
            _settle(path.parent)
    except (OSError, ValueError) as error:
        raise _unwritable(what, "file", path, error) from error
    finally:
        for beside in fresh.values():
            with suppress(OSError):
                beside.unlink()


class GrowingFile:
    """A text file that grows beside the old one and replaces it when it is closed.

    If the disk is full, `write` raises nothing: `close` does.

    Args:
        path: The file, as for `replace_file`.
        what: Its name in messages.

    Raises:
        ParameterError: If it cannot be written.
    """

    def __init__(self, path: str | Path, what: str = "The file") -> None:
        self._path, self._what = path, what
        self._error: Exception | None = None
        try:
            self._target = self._beside = _target(path_of(path, what))
            flags = os.O_WRONLY
            if not self._target.exists() or self._target.is_file():
                self._beside = _name_beside(self._target)
                flags |= os.O_CREAT | os.O_EXCL
            self._file = open(os.open(self._beside, flags, 0o666), "w", encoding="utf-8", newline="\n")  # noqa: SIM115
        except OSError as error:
            raise _unwritable(what, "file", path, error) from error

    def write(self, text: str) -> None:
        """Append text."""
        if self._error is None:
            try:
                self._file.write(text)
            except OSError as error:
                self._error = error

    def close(self) -> None:
        """Replace the old file.

        Raises:
            ParameterError: If it could not be written; an earlier file is then as it was.
        """
        is_other = self._beside != self._target
        try:
            try:
                self._file.flush()
                if is_other:
                    os.fsync(self._file.fileno())
            finally:
                self._file.close()
            if self._error is not None:
                raise self._error
            if is_other:
                _take_rights(self._beside, self._target)
                os.replace(self._beside, self._target)
                _settle(self._target.parent)
        except OSError as error:
            raise _unwritable(self._what, "file", self._path, error) from error
        finally:
            if is_other:
                with suppress(OSError):
                    self._beside.unlink()


@contextmanager
def file_beside(path: str | Path, what: str) -> Iterator[Path]:
    """Yield the path of a file for a library to write, which replaces another when it is complete.

    Args:
        path: The file that it replaces, as for `replace_file`; no pipe.
        what: Its name in messages.

    Raises:
        ParameterError: If it cannot be written; an earlier file is then as it was.
    """
    beside: Path | None = None
    try:
        target = _target(path_of(path, what))
        if target.exists() and not target.is_file():
            raise OSError(None, "it is no file")
        beside = _name_beside(target)
        _write(beside, b"", 0o666)
        yield beside
        with beside.open("rb") as file:
            os.fsync(file.fileno())
        _take_rights(beside, target)
        os.replace(beside, target)
        _settle(target.parent)
    except KiksError:  # one may be an OSError, too
        raise
    except OSError as error:
        raise _unwritable(what, "file", path, error) from error
    finally:
        if beside is not None:
            with suppress(OSError):
                beside.unlink()


def check_writable(path: str | Path, what: str, *, is_new: bool = False) -> None:
    """Raise if a file could not be written; for use before a long computation whose result goes there.

    A file is made beside it and removed: rights do not tell of disks that are full or can be read only.

    Args:
        path: The file.
        what: Its name in messages.
        is_new: Whether the file must not exist yet.

    Raises:
        ParameterError: If it cannot be written.
    """
    if is_new and os.path.lexists(path):
        raise ParameterError(f"{what} must name a new file, but {str(path)!r} exists. Choose another name.")
    try:
        target = _target(path_of(path, what))
        if not target.exists() or target.is_file():
            beside = _name_beside(target)
            _write(beside, b"", 0o600)
            beside.unlink()
    except OSError as error:
        raise _unwritable(what, "file", path, error) from error


def make_folder(path: str | Path, what: str) -> None:
    """Make a folder, if it is not there, in which files can be written.

    Raises:
        ParameterError: If it cannot be one.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
        beside = _name_beside(Path(path, "file"))
        _write(beside, b"", 0o600)
        beside.unlink()
    except (OSError, ValueError) as error:
        raise _unwritable(what, "folder", path, error) from error


def _target(path: str | Path) -> Path:
    """Return the target of a path, through links; it may not exist.

    Raises:
        OSError: If it is a folder, or a file that is protected from being written.
        ValueError: If it has characters that paths cannot have.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(None, "it is a folder")
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(None, "it is write-protected")
    return target


def _name_beside(target: Path) -> Path:
    return target.with_name(f".kiks-{os.urandom(8).hex()}")


def _write(path: Path, data: bytes, mode: int) -> None:
    """Write a new file and flush it to the disk."""
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def _take_rights(beside: Path, target: Path) -> None:
    """Give a new file the permissions of the one that it replaces, if there is one."""
    if target.exists():
        beside.chmod(stat.S_IMODE(target.stat().st_mode))


def _settle(folder: Path) -> None:
    """Flush a folder's entries to the disk, if the system supports that."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _unwritable(what: str, kind: str, path: str | Path, error: Exception) -> ParameterError:
    why = error.strerror if isinstance(error, OSError) else error
    return ParameterError(
        f"{what} must go to a {kind} that can be written, but {str(path)!r} cannot ({why}). Choose another place."
    )


def path_of(path: object, what: str = "path") -> Path:
    """Return a file's name as a path.

    Args:
        path: A text or a path.
        what: What messages call it.

    Raises:
        ParameterError: If it is something else, or a text that no path can be.
    """
    with suppress(UnicodeEncodeError):
        if isinstance(path, str | Path) and "\0" not in str(path):
            parts = os.fsencode(path).split(b"/")
            if any(parts) and max(map(len, parts)) <= NAME_BYTES_MAX and sum(map(len, parts)) <= PATH_BYTES_MAX:
                return Path(path)
    raise ParameterError(
        f"{what} must be the name of a file, of at most {NAME_BYTES_MAX} bytes, but it was {shown(path)}."
    )


def check_relative(text: object, what: str) -> None:
    """Check by its text that a path stays within a folder, on any computer.

    Args:
        text: The path, with / between its parts.
        what: What messages call it.

    Raises:
        ParameterError: If it is empty, absolute, leads upwards, or has characters that paths cannot have.
    """
    parts = text.split("/") if isinstance(text, str) else []
    is_clean = isinstance(text, str) and text.isprintable() and not set(text) & set('\\:*?"<>|') and len(text) <= 1000
    if not is_clean or not all(part not in ("", ".", "..") for part in parts):
        raise ParameterError(
            f"{what} must lead to a file in the project's folder or below it, with / between folders, but it was "
            f"{shown(text)}. Copy the file into that folder."
        )


def inside(folder: Path, text: str, what: str) -> Path:
    """Return the path of a file in a project's folder or below it, if its text suits any computer.

    Args:
        folder: The folder.
        text: The path of the file from there, with / between its parts.
        what: What messages call it.

    Raises:
        ParameterError: If the text suits only some computers, or the file lies elsewhere.
    """
    check_relative(text, what)
    return within(folder, text, what)


def within(folder: Path, text: str, what: str) -> Path:
    """Return the path of a file in a folder or below it, after following links.

    Raises:
        ParameterError: If it lies elsewhere.
    """
    try:
        home = folder.resolve()
        path = (home / text).resolve()
    except (OSError, ValueError, RuntimeError):
        # A NUL character, or links that lead in a circle.
        home, path = folder, folder.parent
    if not path.is_relative_to(home) or path == home or Path(text).is_absolute():
        raise ParameterError(
            f"{what} must lie in the folder of the file that names it, or below, but {shown(text)} leads elsewhere. "
            "Copy it there."
        )
    return path


def program_in(folder: Path, name: str, what: str = "program") -> Path:
    """Return the path of a Python program that a file or a browser names.

    Args:
        folder: The folder in which it must lie, there or below.
        name: Its path from there, with / between its parts.
        what: What messages call it.

    Raises:
        ParameterError: If it leads elsewhere, is no .py file, or lies in a folder whose name begins with a dot.
    """
    path = inside(folder, name, what)
    for parts in (PurePosixPath(name).parts, path.relative_to(folder.resolve()).parts):
        if not parts[-1].endswith(".py") or any(part.startswith(".") for part in parts):
            raise ParameterError(
                f"{what} must be a .py file in no folder whose name begins with a dot, but it was {shown(name)}. "
                "Rename it, or start it at a terminal."
            )
    return path
