"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from kiks.errors import ArenaError, ParameterError


def replace_file(path: Path, data: bytes) -> None:
    """Write a file; an earlier one of that name is replaced in one step.

    Raises:
        ArenaError: If it cannot be written.
    """
    try:
        write_whole(path, data)
    except (OSError, ValueError) as error:
        raise ArenaError(f"The file {str(path)!r} must be writable, but: {error}. Choose another folder.") from None


def write_whole(path: Path, data: bytes) -> None:
    """Write a file in one step, and see that it is on the disk: whatever happens, it is the old or the new one.

    Raises:
        OSError: If it cannot be written.
        ValueError: If the path is none.
    """
    fresh: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=".kiks-", dir=path.parent)
        fresh = Path(name)
        with open(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        fresh.chmod(0o644)
        os.replace(fresh, path)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    finally:
        if fresh is not None:
            fresh.unlink(missing_ok=True)


def check_relative(text: object, what: str) -> None:
    """Check that a path is one within a folder, on any computer, as far as the text says.

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
            f"{text!r}. Copy the file into that folder."
        )


def inside(folder: Path, text: str, what: str) -> Path:
    """Return the path of a file in a folder or below it, wherever links may lead.

    Args:
        folder: The folder.
        text: The path of the file from there, with / between its parts.
        what: What messages call it.

    Raises:
        ParameterError: If it lies elsewhere.
    """
    check_relative(text, what)
    try:
        home = folder.resolve()
        path = (home / text).resolve()
    except (OSError, ValueError, RuntimeError):
        home, path = folder, folder.parent
    if not path.is_relative_to(home) or path == home:
        raise ParameterError(
            f"{what} must lie in the project's folder or below it, but {text!r} leads elsewhere. Copy it there."
        )
    return path
