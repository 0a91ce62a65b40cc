"""Another user of this computer, that runs untrusted programs where no sandbox can be made.

In a container, such as that of Gradescope's autograder, bubblewrap can mostly make no namespaces. There root grades,
and the programs run as a user who can read neither the exercise nor the results. None of its processes outlives them.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, shown
from kiks.ports.program_process import python_line

_READABLE = "import os, sys; sys.exit(any(os.access(path, os.R_OK) for path in sys.argv[1:]))"


class OtherUser:
    """A user who is not this one.

    Args:
        name: The user's name.

    Raises:
        ParameterError: If there is none, or this process is not the superuser's.

    Example:
        >>> OtherUser("student").check_unreadable([Path("/autograder/source")])  # doctest: +SKIP
    """

    def __init__(self, name: str) -> None:
        import pwd  # here, for systems without it

        try:
            found = pwd.getpwnam(name)
        except (KeyError, ValueError):
            raise ParameterError(
                f"--user must be a user of this computer, but there is no {shown(name)}. Make one: useradd {name}."
            ) from None
        if os.geteuid() != 0 or found.pw_uid == 0:
            raise ParameterError(
                "--user must be given by root, and name another user, for the programs must reach nothing of it. Where "
                "there is bubblewrap, leave it out: then programs run in a sandbox."
            )
        self.name, self._user, self._group = name, found.pw_uid, found.pw_gid

    @property
    def options(self) -> dict[str, Any]:
        """Options of `subprocess.Popen` for a process of this user."""
        return {"user": self._user, "group": self._group, "extra_groups": [], "cwd": "/"}

    def give(self, folder: str) -> None:
        """Let a folder be this user's."""
        os.chown(folder, self._user, self._group)

    def let_read(self, folder: Path) -> None:
        """Let this user read all below a folder, and pass through the one above it, but look into nothing else."""
        for path in (folder.parent, folder):
            path.chmod(0o711)
        for path in folder.rglob("*"):
            path.chmod(0o755 if path.is_dir() else 0o644)

    def check_unreadable(self, paths: Sequence[Path]) -> None:
        """Check that this user can read none of some files and folders.

        Raises:
            ParameterError: If it can, or cannot run Python at all.
        """
        words = python_line("-c", _READABLE, *(str(path.absolute()) for path in paths))
        try:
            can_read = subprocess.run(words, check=False, **self.options).returncode
        except OSError:
            raise ParameterError(
                f"the user {self.name} must be able to run {shown(sys.executable)}, but cannot. Install KiKS where all "
                "users can read it, such as in /opt."
            ) from None
        if can_read:
            which = " and ".join(shown(str(path)) for path in paths)
            raise ParameterError(
                f"{which} must be out of reach of the user {self.name}, as it would find the hidden cases there, but "
                "it can read them. Say chmod 700 to their folder."
            )

    def end_all(self) -> None:
        """Kill all processes of this user, at once: none of them can start another one meanwhile."""
        process = os.fork()
        if not process:
            try:
                os.setgroups([])
                os.setresgid(self._group, self._group, self._group)
                os.setresuid(self._user, self._user, self._user)
                os.kill(-1, signal.SIGKILL)
            finally:
                os._exit(0)
        os.waitpid(process, 0)
