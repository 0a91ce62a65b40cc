"""The files that a project names and that are no programs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from kiks.errors import shown
from kiks.model.atomic_files import inside
from kiks.model.data_file import parse_toml, read_file
from kiks.model.limits import PICTURE_FILE_BYTES_MAX
from kiks.model.project import Project
from kiks.model.thinking_policy import split_thinking


def files_named(project: Project, folder: Path) -> Iterator[str]:
    """Yield the names of the files of a project's folder that are no programs: robots, replays, arenas of cases.

    Args:
        project: The project.
        folder: Where it lies.

    Example:
        >>> list(files_named(Project(thinking="replay:times.json"), Path()))
        ['times.json']
    """
    yield from sorted({each.kind for each in project.robots if each.kind.lower().endswith(".toml")})
    if isinstance(replay := split_thinking(project.thinking)[1], str):
        yield replay
    for name in sorted({arena for cases in project.cases for arena in cases.arena if PurePosixPath(arena).suffix}):
        yield name
        if name.lower().endswith(".toml"):
            arena = parse_toml(bytes_of(inside(folder, name, "arena")), name)
            pictures = [arena[key] for key in ("picture", "floor") if isinstance(arena.get(key), str)]
            yield from ((PurePosixPath(name).parent / each).as_posix() for each in pictures)


def bytes_of(path: Path) -> bytes:
    """Return the content of a file of a project, which is at most that of the largest picture."""
    return read_file(path, f"The file {shown(str(path))}", bytes_max=PICTURE_FILE_BYTES_MAX)
