"""Which programs may start in a world: asked where they start, whoever names them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath

from kiks.errors import ParameterError
from kiks.model.files import inside
from kiks.ports.process import Command


class Permission:
    """What programs may start.

    The person at the terminal may start anything. What a browser or a file names must be a Python program in one of
    some folders, and starts only where that was allowed.

    Args:
        granted: What the person at the terminal has named.
        folders: Where other programs may lie, there or below.
        may_start_others: Whether they may start at all.
    """

    def __init__(
        self, granted: Iterable[Command | None] = (), *, folders: Sequence[Path] = (), may_start_others: bool = False
    ) -> None:
        self._granted = [command for command in granted if command is not None]
        self._folders = [folder.resolve() for folder in folders]
        self.may_start_others = may_start_others

    def check(self, command: Command) -> None:
        """Check that a program may start.

        Raises:
            ParameterError: If it may not.
        """
        if command in self._granted:
            return
        name = command.program.name[:80]
        if not self.may_start_others:
            raise ParameterError(
                f"{name!r} must be started at the terminal of this desk, but a page or a file asked for it. kiks desk "
                "--run-programs allows that: then everybody who sees the page can run anything on that computer."
            )
        path = command.program.resolve()
        for folder in self._folders:
            if path.is_relative_to(folder):
                program_in(folder, path.relative_to(folder).as_posix())
                return
        raise ParameterError(f"{name!r} must lie in the desk's folder, but it is elsewhere. Copy it there.")


class Anything(Permission):
    """The permission of a person at a terminal, and of a program that uses KiKS."""

    def check(self, command: Command) -> None:
        """Let it start."""


def program_in(folder: Path, name: str) -> Path:
    """Return the path of a program that a file or a browser names.

    Args:
        folder: The folder in which it must lie, there or below.
        name: Its path from there, with / between its parts.

    Raises:
        ParameterError: If it leads elsewhere, is no .py file, or lies in a folder whose name begins with a dot.
    """
    path = inside(folder, name, "program")
    for parts in (PurePosixPath(name).parts, path.relative_to(folder.resolve()).parts):
        if not parts[-1].endswith(".py") or any(part.startswith(".") for part in parts):
            raise ParameterError(
                f"program must be a .py file in no folder whose name begins with a dot, but it was {name[:80]!r}. "
                "Rename it, or start it at a terminal."
            )
    return path
