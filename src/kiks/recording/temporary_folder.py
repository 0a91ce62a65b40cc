"""A folder for temporary recordings, which the next process removes if its own was killed.

Method: a process holds a lock on its folder, which the system releases however the process ends. A lock counts only if
the folder still has its name when it is taken, so that of two processes that begin at once, neither deletes the other's
folder. Programs that clean up temporary files leave a locked folder alone, too.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

from kiks.model.atomic_files import lock

PREFIX = "kiks-recording-"


class TemporaryFolder:
    """A folder of this user alone; it is deleted with its files by `delete`, or at the end of the process.

    Attributes:
        path: The folder.

    Raises:
        OSError: If it cannot be made.
    """

    def __init__(self) -> None:
        for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
            with suppress(OSError):
                folder = _locked(path)
                shutil.rmtree(path, ignore_errors=True)
                os.close(folder)
        self._lock: int | None = None
        while True:
            self._folder = tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True)
            self.path = Path(self._folder.name)
            try:
                self._lock = _locked(self.path)
            except (BlockingIOError, FileNotFoundError):
                # Another process takes it for an abandoned one, and deletes it.
                self._folder.cleanup()
                continue
            except OSError:  # a network drive without locks
                pass
            break

    def delete(self) -> None:
        """Delete it with its files."""
        self._folder.cleanup()
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def _locked(path: Path) -> int:
    """Lock a folder of this user, and return its descriptor.

    Raises:
        BlockingIOError: If another process has locked it.
        FileNotFoundError: If it has been deleted.
        OSError: If it is a link or a file, belongs to another user, or cannot be locked.
    """
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        if os.fstat(folder).st_uid != os.geteuid():
            raise PermissionError
        if not lock(folder, path):
            raise FileNotFoundError
    except OSError:
        os.close(folder)
        raise
    return folder
