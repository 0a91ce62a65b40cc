"""A program and its arguments, as a command line or a project names it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, shown
from kiks.meant import nearest_file
from kiks.model.atomic_files import program_in
from kiks.model.program_files import ProgramFiles
from kiks.model.program_kinds import A_PROGRAM, ENDINGS, ProgramKind, program_kind
from kiks.model.project import Project
from kiks.ports.messages import Start


@dataclass(frozen=True)
class ProgramCommand:
    """A program and its arguments in `sys.argv`.

    Attributes:
        program: Its file, or a folder or an archive with a `__main__.py`.
        arguments: The arguments.
        module: Name of the module or package whose file that is, to be run as `python -m` does; empty for none.
    """

    program: Path
    arguments: list[str] = field(default_factory=list)
    module: str = ""

    @property
    def name(self) -> str:
        """Its name for people."""
        return self.module or self.program.name

    @property
    def title(self) -> str:
        """The same without the ending of its file."""
        return self.program.stem if self.name.endswith(tuple(ENDINGS)) else self.name

    @property
    def runs_here(self) -> bool:
        """Whether it can run in this process: Octave has one of its own."""
        return program_kind(self.program) is not ProgramKind.OCTAVE

    @property
    def file(self) -> Path:
        """The file that Python reads first."""
        return self.program / "__main__.py" if self.program.is_dir() else self.program

    def added_to(self, start: Start) -> Start:
        """Return what a process gets at its start, with this program in it."""
        return start._replace(module=self.module, program=str(self.program), arguments=list(self.arguments))

    def files(self) -> ProgramFiles:
        """Return all files that belong to it, as they are now."""
        return ProgramFiles(self.program, self.module, self.arguments)

    def check_file(self) -> None:
        """Check that the program's file exists."""
        if not self.file.is_file():
            raise ParameterError(
                f"a program must be {A_PROGRAM}, but there is none at {str(self.program)!r}. Save it first."
                f"{nearest_file(self.file)}"
            )


def project_commands(project: Project, folder: Path) -> list[ProgramCommand | None]:
    """Return the program of each robot of a project in a folder; None for a robot without one."""
    return [
        None if robot.program is None else ProgramCommand(program_in(folder, robot.program), list(robot.arguments))
        for robot in project.robots
    ]


def project_supervisor(project: Project, folder: Path) -> Path | None:
    """Return the file of the supervisor of a project in a folder; None if it has none."""
    name = project.supervisor
    return None if name is None else program_in(folder, name, "supervisor", [ProgramKind.PYTHON])


def module_command(module: str, arguments: Sequence[str]) -> ProgramCommand:
    """Return the program that `python -m` would run; nothing is imported to find its file."""
    path: Sequence[str] | None = [os.getcwd(), *sys.path]
    for part in module.split("."):
        spec = None if path is None else _find_spec(part, path)
        if spec is None:
            raise ParameterError(
                f"a program after -m must be a module that Python finds from {os.getcwd()}, but there is no "
                f"{shown(module)}. Give its name without .py, such as package.program."
            )
        path = spec.submodule_search_locations
    main = spec if path is None else _find_spec("__main__", path)
    if main is None or main.origin is None:
        raise ParameterError(
            f"a package after -m must have a file __main__.py, but {shown(module)} has none. Name a module in it."
        )
    return ProgramCommand(Path(main.origin), list(arguments), module)


def _find_spec(name: str, path: Sequence[str]) -> ModuleSpec | None:
    # Other finders, such as those of packages that are installed editable, do not heed the path: they come last.
    finders: list[Any] = [PathFinder, *sys.meta_path]
    return next(filter(None, (finder.find_spec(name, path) for finder in finders)), None)
