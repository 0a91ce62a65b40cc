"""The permission to start a program."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from kiks.errors import ParameterError
from kiks.model.atomic_files import program_in
from kiks.ports.program_command import ProgramCommand


class Permission:
    """Decides which programs may start.

    The person at the terminal may start anything. A program that a browser or a file names must be a Python program in
    one of the folders, and starts only if that is allowed.

    Args:
        granted: Programs that the person at the terminal has named; None for any.
        folders: Folders of other programs, with all below.
        may_start_others: Whether other programs may start.
    """

    def __init__(
        self,
        granted: Iterable[ProgramCommand | None] | None = (),
        *,
        folders: Sequence[Path] = (),
        may_start_others: bool = False,
    ) -> None:
        self._granted = None if granted is None else list(granted)
        self._folders = [folder.resolve() for folder in folders]
        self.may_start_others = may_start_others

    def check(self, command: ProgramCommand) -> None:
        """Check that a program may start."""
        if self._granted is None or command in self._granted:
            return
        name = command.name[:80]
        if not self.may_start_others:
            raise ParameterError(
                f"{name!r} must be started at the terminal of this desk, but a page or a file asked for it. kiks desk "
                "--run-programs allows that: then every user of the page can run anything on that computer."
            )
        path = command.program.resolve()
        for folder in self._folders:
            if path.is_relative_to(folder):
                program_in(folder, path.relative_to(folder).as_posix())
                return
        raise ParameterError(f"{name!r} must lie in the desk's folder, but it is elsewhere. Copy it there.")
