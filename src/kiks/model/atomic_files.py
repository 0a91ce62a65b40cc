"""Atomic writing of files: completely or not at all. `what` is what messages call a file."""

from __future__ import annotations

import importlib
import os
import stat
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import IO, Any, BinaryIO, cast

from kiks.errors import KiksError, ParameterError, shown
from kiks.meant import nearest
from kiks.model.program_kinds import ENDINGS, ProgramKind

fcntl: Any = None
with suppress(ModuleNotFoundError):  # Windows has none: there files are written as on a drive without locks
    fcntl = importlib.import_module("fcntl")

NO_LINK_NO_WAIT = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""How a file is opened that may be anything: not where a link leads, and without a wait for the other end of a pipe."""

NAME_BYTES_MAX, PATH_BYTES_MAX = 255, 4000
"""Most bytes of a file's name, and of a path, less than Linux allows."""

_PREFIX = ".kiks-"


def replace_file(path: str | Path, data: bytes | str, what: str = "The file", *, rights: int | None = None) -> None:
    """Write a file in one step, and see that it is on the disk: whatever happens, it is the old or the new one.

    A link stays one, an earlier file's rights stay; what is no file (a pipe, a terminal) is written to as it is.

    Args:
        path: The file.
        data: Its content; text becomes UTF-8.
        what: Its name in messages.
        rights: Its permissions, at most; those of the earlier file, or those of the umask, if left out.
    """
    replace_files({path: data}, what, rights=rights)


def replace_files(files: dict[str | Path, bytes | str], what: str = "The file", *, rights: int | None = None) -> None:
    """Write files that belong together like `replace_file`: none is replaced before all are on the disk."""
    with ExitStack() as stack:
        for path, data in reversed(files.items()):  # the stack ends with the first one, which takes its place first
            beside = stack.enter_context(writing(path, what, rights=rights))
            beside.file.write(data.encode() if isinstance(data, str) else data)
            beside.settle()


@contextmanager
def writing(path: str | Path, what: str, *, rights: int | None = None) -> Iterator[FileBeside]:
    """Yield a file in the making, which takes the place of another one if no error ends it; see `replace_file`."""
    with explained(path, what):
        target = target_of(path_of(path, what))
        with closing(FileBeside(target, 0o666 if rights is None else rights)) as beside:
            yield beside
            beside.take_place(keeps_rights=rights is None)


class FileBeside:
    """A new file beside another, whose place it takes when it is told to; if it never is, it goes.

    What is no file (a pipe, a terminal) is written to as it is. A lock tells that a living process writes it. What a
    killed one has left in the folder goes when the next begins.

    Args:
        target: The file whose place it takes, which may not be there; no link.
        mode: Its permissions, at most.
        is_only: Whether no other file that is the only one may wait for this place, or grow in it, until `close`.

    Attributes:
        path: Where it begins.
        file: Its content.
        has_earlier: Whether the target holds something; known if it is the only one.
        is_in_place: Whether it has taken the place.

    Raises:
        OSError: If it cannot be written, or another is the only one.
    """

    def __init__(self, target: Path, mode: int = 0o666, *, is_only: bool = False) -> None:
        for path in target.parent.glob(_PREFIX + "[0-9a-f]" * 16):
            with suppress(OSError), open(os.open(path, os.O_RDWR | NO_LINK_NO_WAIT), "rb") as file:
                if lock(file.fileno(), path):
                    path.unlink()
        self._target = target
        self._error: OSError | None = None
        self.has_earlier, self._claim = False, None
        self.is_in_place = target.exists() and not target.is_file()
        if self.is_in_place:
            self.path, self.file = target, cast(BinaryIO, target.open("wb"))
            return
        # While the target is locked, only the owner of that lock replaces it.
        self._claim = locked_file(target, os.O_CREAT, 0o666) if is_only else None
        try:
            self.has_earlier = self._claim is not None and os.fstat(self._claim.fileno()).st_size > 0
            self.path = target.with_name(f"{_PREFIX}{os.urandom(8).hex()}")
            self.file = locked_file(self.path, os.O_CREAT | os.O_EXCL, mode)
        except OSError:
            self._end_claim()
            raise

    @property
    def has_failed(self) -> bool:
        """Whether an attempt has failed; then no other is made."""
        return self._error is not None

    def attempt(self, write: Callable[[], object]) -> None:
        """Write something; an error is raised by `close`."""
        if self._error is None:
            try:
                write()
            except OSError as error:
                self._error = error

    def settle(self) -> None:
        """See that all of it is on the disk."""
        self.file.flush()
        if not self.is_in_place:
            os.fsync(self.file.fileno())

    def take_place(self, *, keeps_rights: bool = True) -> None:
        """Replace the target, and take the permissions of an earlier one; it may go on to grow."""
        self.settle()
        if self.is_in_place:
            return
        if keeps_rights and self._target.exists():
            self.path.chmod(stat.S_IMODE(self._target.stat().st_mode))
        os.replace(self.path, self._target)
        self.is_in_place = True
        self._end_claim()
        _settle(self._target.parent)

    def close(self) -> None:
        """End it; unless it has taken the place, it is removed.

        Raises:
            OSError: If an attempt has failed.
        """
        if not self.is_in_place:
            with suppress(OSError):
                self.path.unlink()
        _release(self.file)
        self._end_claim()
        if self._error is not None:
            raise self._error

    def _end_claim(self) -> None:
        if self._claim is not None:
            if not (self.has_earlier or self.is_in_place):
                with suppress(OSError):
                    self._target.unlink()  # it is empty, and was made for the lock
            _release(self._claim)
            self._claim = None


def locked_file(path: Path, flags: int, mode: int) -> BinaryIO:
    """Open a file to be written, and lock it.

    Raises:
        OSError: If it cannot be written, or another process holds the lock of a file that was there.
    """
    is_new = bool(flags & os.O_EXCL)
    while True:
        file = open(os.open(path, os.O_RDWR | flags, mode), "wb")  # noqa: SIM115
        try:
            # Another process may take the new file for an abandoned one: it locks the file briefly and removes it.
            if lock(file.fileno(), path, waits=is_new):
                return file
        except BlockingIOError:
            file.close()
            raise BlockingIOError(None, "another run is writing it") from None
        except OSError:  # a network drive without locks
            return file
        file.close()


def lock(file: int, path: Path, *, waits: bool = False) -> bool:
    """Lock an open file or folder by its descriptor, and return whether it still has its name.

    Raises:
        BlockingIOError: If it is locked already.
        OSError: If it cannot be locked.
    """
    if fcntl is None:
        raise OSError(None, "this system has no such locks")
    fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
    with suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(file), os.lstat(path))
    return False


def _release(file: IO[bytes]) -> None:
    """Close a file without its lock, which a process that was forked meanwhile may hold, too."""
    with suppress(OSError), file:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_UN)


def check_writable(path: str | Path, what: str, *, is_new: bool = False) -> None:
    """Raise if a file could not be written; for use before a long computation whose result goes there.

    A file is made beside it and removed: rights do not tell of disks that are full or can be read only.
    """
    if is_new and os.path.lexists(path):
        raise ParameterError(f"{what} must name a new file, but {str(path)!r} exists. Choose another name.")
    with explained(path, what):
        target = target_of(path_of(path, what))
        if not target.exists() or target.is_file():
            FileBeside(target, 0o600).close()


def make_folder(path: str | Path, what: str) -> None:
    """Make a folder, if it is not there, in which files can be written."""
    with explained(path, what, "folder"):
        path_of(path, what).mkdir(parents=True, exist_ok=True)
        FileBeside(Path(path, "file"), 0o600).close()


@contextmanager
def alone_in(folder: Path, what: str, mark: str) -> Iterator[None]:
    """Make a folder if it is not there, and lock it meanwhile against other runs that write into it.

    Args:
        folder: The folder.
        what: What messages call it.
        mark: Name of a file in it that tells that all files there are of such runs, which may replace them.

    Raises:
        ParameterError: If another run writes into it, or it has files of others.
    """
    make_folder(folder, what)
    others = sorted(each.name for each in folder.iterdir() if not each.name.startswith("."))
    if others and not (folder / mark).exists():
        raise ParameterError(
            f"{what} must be a new folder, an empty one, or that of an earlier run, but {str(folder)!r} has other "
            f"files, such as {shown(others[0])}. Choose another name."
        )
    with explained(folder / mark, what):
        (folder / mark).touch()
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            lock(descriptor, folder)
        except BlockingIOError:
            raise ParameterError(
                f"{what} must belong to one run, but another one writes into {str(folder)!r}. Wait for its end, or "
                "choose another folder."
            ) from None
        except OSError:
            pass  # a network drive without locks
        yield
    finally:
        os.close(descriptor)


def target_of(path: str | Path) -> Path:
    """Return the target of a path, through links; it may not exist.

    Raises:
        OSError: If it is a folder, or a file that is protected from being written.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(None, "it is a folder")
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(None, "it is write-protected")
    return target


def _settle(folder: Path) -> None:
    """Flush a folder's entries to the disk, if the system supports that."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextmanager
def explained(path: str | Path, what: str, kind: str = "file") -> Iterator[None]:
    """Say which file or folder cannot be written, and why."""
    try:
        yield
    except KiksError:  # one may be an OSError, too
        raise
    except (OSError, UnicodeEncodeError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise ParameterError(
            f"{what} must go to a {kind} that can be written, but {str(path)!r} cannot ({why}). Choose another place."
        ) from error


def path_of(path: object, what: str = "path") -> Path:
    """Return a file's name, a text or a path, as a path."""
    with suppress(UnicodeEncodeError):
        if isinstance(path, str | Path) and "\0" not in str(path):
            parts = os.fsencode(path).split(b"/")
            if any(parts) and max(map(len, parts)) <= NAME_BYTES_MAX and sum(map(len, parts)) <= PATH_BYTES_MAX:
                return Path(path)
    raise ParameterError(
        f"{what} must be the name of a file, of at most {NAME_BYTES_MAX} bytes, but it was {shown(path)}."
    )


def ending_of(path: object, what: str, endings: Iterable[str]) -> str:
    """Return the ending of a file's name, in small letters, after a check that it is a known one."""
    ending = path_of(path, what).suffix.lower()
    if ending not in endings:
        *others, last = endings
        known = f"{', '.join(others)} or {last}" if others else last
        raise ParameterError(f"{what} must end in {known}, but it was {shown(str(path))}.{nearest(ending, endings)}")
    return ending


def check_relative(text: str, what: str) -> str:
    """Return the text of a path, with / between its parts, if it stays within a folder on any computer."""
    parts = text.split("/") if isinstance(text, str) else []
    is_clean = isinstance(text, str) and text.isprintable() and not set(text) & set('\\:*?"<>|') and len(text) <= 1000
    if not is_clean or not all(part not in ("", ".", "..") for part in parts):
        raise ParameterError(
            f"{what} must lead to a file in the project's folder or below it, with / between folders, but it was "
            f"{shown(text)}. Copy the file into that folder."
        )
    return text


def inside(folder: Path, text: str, what: str) -> Path:
    """Return the path of a file in a project's folder or below it, if its text suits any computer."""
    return within(folder, check_relative(text, what), what)


def within(folder: Path, text: str, what: str) -> Path:
    """Return the path of a file in a folder or below it, after following links."""
    try:
        home = folder.resolve()
        path = (home / text).resolve()
    except (OSError, ValueError, RuntimeError):
        # A NUL character, or links that lead in a circle.
        home, path = folder, folder.parent
    if not path.is_relative_to(home) or path == home:
        raise ParameterError(
            f"{what} must lie in the folder of the file that names it, or below, but {shown(text)} leads elsewhere. "
            "Copy it there."
        )
    return path


def program_in(
    folder: Path, name: str, what: str = "program", kinds: Collection[ProgramKind] = tuple(ProgramKind)
) -> Path:
    """Return the path of a program, of one of some kinds, in a folder or below that a file or a browser names."""
    endings = [ending for ending, kind in ENDINGS.items() if kind in kinds]
    path = inside(folder, name, what)
    for parts in (PurePosixPath(name).parts, path.relative_to(folder.resolve()).parts):
        if PurePosixPath(parts[-1]).suffix not in endings or any(part.startswith(".") for part in parts):
            raise ParameterError(
                f"{what} must be a {' or '.join(endings)} file in no folder whose name begins with a dot, but it was "
                f"{shown(name)}. Rename it, or start it at a terminal."
            )
    return path
