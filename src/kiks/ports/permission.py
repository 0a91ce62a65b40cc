"""Which programs may start in a world: asked where they start, whoever names them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from kiks.errors import ParameterError
from kiks.model.files import program_in
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
