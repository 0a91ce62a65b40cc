"""The files of a desk: opened and saved in one folder only, whatever name a person types or a browser sends."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from kiks.errors import ArenaError, ParameterError
from kiks.model.arena import Arena
from kiks.model.arena_file import decode_arena
from kiks.model.atomic_files import check_relative, inside, replace_file
from kiks.model.kad import decode_kad, encode_kad
from kiks.model.picture import decode_picture
from kiks.model.project import Project

UPLOAD_BYTES_MAX = 32 << 20
"""Most bytes of a file that a browser sends."""

PICTURES = (".png", ".tif", ".tiff", ".pgm", ".pbm", ".ppm", ".bmp")
"""Endings of pictures."""

OPENED = (".kiks", ".toml", ".kad", *PICTURES)
"""Endings of what can be opened or sent."""

SAVED = (".kiks", ".kad")
"""Endings of what can be saved; without one it is the first."""

LISTED_MAX = 500
"""Most files that are listed."""

_DEEPEST = 3
_NAME_MAX = 120
_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(1, 10))}


class Folder:
    """The folder in which a desk opens and saves files.

    Args:
        path: The folder.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def names(self) -> list[str]:
        """Return the files that can be opened, those of folders in it too, in the order of their names."""
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
                if entry.is_dir() and not entry.is_symlink() and depth < _DEEPEST:
                    waiting.append((entry, depth + 1))
                elif entry.suffix.lower() in OPENED and entry.is_file():
                    found.append(name)
        return sorted(found, key=str.lower)[:LISTED_MAX]

    def open(self, name: str) -> Project:
        """Read a project, an arena or a picture.

        Raises:
            ParameterError: If the name leads out of the folder.
            ArenaError: If the file is missing, damaged, or none of these.
        """
        return Project.load(self._path(name, OPENED))

    def save(self, project: Project, name: str, *, may_replace: bool = False) -> str:
        """Write a project, or its arena alone if the name ends in .kad; return the name with its ending.

        Args:
            project: The project.
            name: Name of the file, .kiks if it has no ending.
            may_replace: Whether an earlier file of that name may be replaced.

        Raises:
            ParameterError: If the name leads out of the folder, cannot be one, or is taken, or the file cannot be
                written.
            ArenaError: If the arena does not fit into the file.
        """
        full = self.full_name(name)
        path = self._path(full, SAVED)
        if path.exists() and not may_replace:
            raise ParameterError(f"The name must be new, but {full!r} is there. Choose another one, or replace it.")
        replace_file(path, encode(project, full), "a project")
        return full

    def has(self, name: str) -> bool:
        """Tell whether saving under a name would replace a file.

        Raises:
            ParameterError: If the name leads out of the folder or cannot be one.
        """
        return self._path(self.full_name(name), SAVED).exists()

    def full_name(self, name: str) -> str:
        """Return a name that a person has typed, with an ending.

        Raises:
            ParameterError: If it cannot be one.
        """
        typed = name.strip()
        return typed if PurePosixPath(typed).suffix.lower() in OPENED else f"{typed}{SAVED[0]}"

    def _path(self, name: str, endings: tuple[str, ...]) -> Path:
        check_name(name, endings)
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
    """Check that a file may have a name, on any computer.

    Args:
        name: The name, with / between folders.
        endings: Endings that it may have.

    Raises:
        ParameterError: If it may not.
    """
    check_relative(name, "The name")
    for part in name.split("/"):
        stem = part.split(".")[0].strip().lower()
        is_odd = part.startswith((".", " ", "-", "~")) or part.endswith((".", " ")) or stem in _RESERVED
        if is_odd or len(part.encode()) > _NAME_MAX:
            raise ParameterError(
                f"The name must begin with a letter or digit, have at most {_NAME_MAX} characters and mean no device, "
                f"but it was {name!r}. Choose another one."
            )
    if PurePosixPath(name).suffix.lower() not in endings:
        raise ParameterError(f"The name must end in one of {', '.join(endings)}, but it was {name!r}.")


def encode(project: Project, name: str) -> bytes:
    """Return the bytes of a file: of a project, or of its arena alone if the name ends in .kad.

    Raises:
        ArenaError: If the arena does not fit into a .kad file.
    """
    return encode_kad(project.arena) if name.lower().endswith(".kad") else project.to_bytes()


def decode(name: str, data: bytes) -> Project:
    """Return the project of a file that a browser sends: of a project, an arena without a picture, or a picture.

    Args:
        name: What the browser calls the file; only its ending counts, and its stem as a name of the arena.
        data: The bytes of the file.

    Raises:
        ParameterError: If the name has another ending.
        ArenaError: If the file is too large, damaged, or none of these.
    """
    path = PurePosixPath(name.replace("\\", "/"))
    ending, stem = path.suffix.lower(), path.stem[:_NAME_MAX] or "arena"
    if ending not in OPENED:
        raise ParameterError(f"A file must end in one of {', '.join(OPENED)}, but it was {path.name[:_NAME_MAX]!r}.")
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
    return Project.of_arena(Arena.from_array(decode_picture(data, 1.0), name=stem))
