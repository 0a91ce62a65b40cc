"""The files of a desk. It opens and saves files in one folder only, whatever name a person or browser gives."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from kiks.errors import ArenaError, ParameterError
from kiks.model.arena import Arena
from kiks.model.arena_file import decode_arena
from kiks.model.atomic_files import check_relative, ending_of, inside, make_folder, replace_file
from kiks.model.kad import decode_kad, encode_kad
from kiks.model.limits import UPLOAD_BYTES_MAX
from kiks.model.package import PACKAGE
from kiks.model.picture import decode_picture
from kiks.model.project import Project

PICTURES = (".png", ".tif", ".tiff", ".pgm", ".pbm", ".ppm", ".bmp")
"""Endings of pictures."""

OPENED = (".kiks", ".toml", ".kad", *PICTURES)
"""Endings of files that can be opened or uploaded."""

SAVED = (".kiks", ".kad")
"""Endings of files that can be saved; the first one is the default."""

LISTED_MAX = 500
"""Maximum number of files in the list."""

_NAME_MAX = 120
_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(1, 10))}


class Folder:
    """The folder in which a desk opens and saves files.

    Args:
        path: The folder.

    Attributes:
        opened: Endings of files that can be opened.
        saved: Endings of files that can be saved; the first one is the default.
        depth_max: How deep its subfolders may lie; 0 for files of the folder alone.
        count_max: Most files that it may have, to save another one; None for no limit.
    """

    opened: tuple[str, ...] = OPENED
    saved: tuple[str, ...] = SAVED
    depth_max = 3
    count_max: int | None = None

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._known = {name: self._version(name) for name in self.names()}

    def names(self) -> list[str]:
        """Return the names of the files that can be opened, including subfolders, in alphabetical order."""
        found: list[str] = []
        waiting = [(self.path, 0)]
        while waiting and len(found) < LISTED_MAX:
            folder, depth = waiting.pop()
            try:
                entries = sorted(folder.iterdir())
            except OSError:
                continue
            for entry in entries:
                name = entry.relative_to(self.path).as_posix()
                if entry.name.startswith(".") or not self._is_inside(name):
                    continue
                if entry.is_dir() and not entry.is_symlink() and depth < self.depth_max:
                    waiting.append((entry, depth + 1))
                elif entry.suffix.lower() in self.opened and entry.is_file():
                    found.append(name)
        return sorted(found, key=str.lower)[:LISTED_MAX]

    def open(self, name: str) -> Path:
        """Return the path of a file that is read now."""
        path = self._path(name, self.opened)
        self._known[name] = self._version(name)
        return path

    def save(
        self, data: bytes, name: str, what: str, *, may_replace: bool = False, beside: Mapping[str, bytes] | None = None
    ) -> str:
        """Write a file, the files beside it that it names first; return its name with its ending.

        Args:
            data: What it holds.
            name: Name of the file, with the default ending if it has none.
            what: What messages call it.
            may_replace: Whether to replace an existing file as it was when it was opened, saved or asked about here.
            beside: What else has to be in its folder, by names there; it replaces nothing.
        """
        full = self.full_name(name)
        path = self._path(full, self.saved)
        if path.is_relative_to(PACKAGE):
            raise ParameterError(
                f"{what} must be saved outside of KiKS itself, but {str(self.path)!r} belongs to it. Start the desk in "
                "a folder of yours, or name one with --folder."
            )
        if path.exists() and not (may_replace and self.is_known(full)):
            raise ParameterError(f"The name must be new, but {full!r} exists. Choose another one, or replace it.")
        if self.count_max is not None and not path.exists() and len(self.names()) >= self.count_max:
            raise ParameterError(
                f"The folder must have at most {self.count_max} files. Save under the name of another."
            )
        for other, content in (beside or {}).items():
            place = inside(path.parent, other, "The name")
            make_folder(place.parent, what)
            if not place.exists():
                replace_file(place, content, what)
        replace_file(path, data, what)
        self._known[full] = self._version(full)
        return full

    def question(self, name: str) -> str:
        """Return what a person is to be asked before a file is saved under a name; nothing if it would be a new one."""
        full = self.full_name(name)
        if not self._path(full, self.saved).exists():
            return ""
        was_known, self._known[full] = self.is_known(full), self._version(full)
        fact = "exists" if was_known else "was changed elsewhere since you opened or saved it here"
        return f"{full} {fact}. Replace it?"

    def is_known(self, name: str) -> bool:
        """Return whether a file is as it was when it was opened, saved or asked about here."""
        return name in self._known and self._known[name] == self._version(name)

    def _version(self, name: str) -> object:
        """Return what is another after a file was written; None without one."""
        try:
            found = (self.path / name).stat()
        except OSError:
            return None
        return found.st_ino, found.st_size, found.st_mtime_ns

    def full_name(self, name: str) -> str:
        """Add the default ending to a name without a known ending."""
        if not (typed := name.strip()):
            raise ParameterError("The name must have a letter or more, but it was empty. Write one first.")
        return typed if PurePosixPath(typed).suffix.lower() in self.opened else f"{typed}{self.saved[0]}"

    def _path(self, name: str, endings: tuple[str, ...]) -> Path:
        check_name(name, endings)
        if name.count("/") > self.depth_max:
            raise ParameterError(f"The name must lead less deep into folders, but it was {name!r}. Leave some out.")
        path = inside(self.path, name, "The name")
        if path.is_dir():
            raise ParameterError(f"The name must be that of a file, but {name!r} is a folder. Add a name to it.")
        return path

    def _is_inside(self, name: str) -> bool:
        try:
            inside(self.path, name, "The name")
        except ParameterError:
            return False
        return True


def check_name(name: str, endings: tuple[str, ...]) -> None:
    """Check that a name is valid on any operating system.

    Args:
        name: The name, with / between folders.
        endings: Permitted endings.
    """
    check_relative(name, "The name")
    for part in name.split("/"):
        stem = part.split(".")[0].strip().lower()
        is_odd = part.startswith((".", " ", "-", "~")) or part.endswith((".", " ")) or stem in _RESERVED
        if is_odd or len(part.encode()) > _NAME_MAX:
            raise ParameterError(
                f"The name must begin with a letter or digit, have at most {_NAME_MAX} characters and not be that of a "
                f"device, but it was {name!r}. Choose another one."
            )
    ending_of(name, "The name", endings)


def encode(project: Project, name: str) -> bytes:
    """Encode a project, or its arena alone if the name ends in .kad."""
    return encode_kad(project.arena) if name.lower().endswith(".kad") else project.to_bytes()


def decode(name: str, data: bytes, mm_per_pixel: float = 1.0) -> Project:
    """Decode an uploaded project, arena without a picture file, or picture.

    Args:
        name: Name of the file. Its ending tells the format; its stem becomes the name of the arena.
        data: The bytes of the file.
        mm_per_pixel: Size of a pixel of a picture [mm].
    """
    path = PurePosixPath(name.replace("\\", "/"))
    ending, stem = ending_of(path.name[-_NAME_MAX:], "A file", OPENED), path.stem[:_NAME_MAX] or "arena"
    if len(data) > UPLOAD_BYTES_MAX:
        raise ArenaError(
            f"A file must have at most {UPLOAD_BYTES_MAX >> 20} MiB, but it has {len(data) / 2**20:.1f}. "
            "Copy it into the desk's folder and open it there."
        )
    if ending == ".kiks":
        return Project.from_bytes(data, name=stem)
    if ending == ".kad":
        return Project.of_arena(decode_kad(data, stem))
    if ending == ".toml":
        return Project.of_arena(decode_arena(data, stem))
    raster = decode_picture(data, mm_per_pixel).brightness
    return Project.of_arena(Arena.from_array(raster, mm_per_pixel=mm_per_pixel, name=stem))
