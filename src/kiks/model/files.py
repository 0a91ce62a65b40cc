"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from kiks.errors import ArenaError


def replace_file(path: Path, data: bytes) -> None:
    """Write a file; an earlier one of that name is replaced in one step.

    Raises:
        ArenaError: If it cannot be written.
    """
    fresh: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=".kiks-", dir=path.parent)
        fresh = Path(name)
        with open(handle, "wb") as file:
            file.write(data)
        fresh.chmod(0o644)
        os.replace(fresh, path)
    except (OSError, ValueError) as error:
        raise ArenaError(f"The file {str(path)!r} must be writable, but: {error}. Choose another folder.") from None
    finally:
        if fresh is not None:
            fresh.unlink(missing_ok=True)
