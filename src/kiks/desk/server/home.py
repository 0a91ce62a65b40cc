"""Where a desk's project lies, with what it names; what has to be beside the project to save it elsewhere."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path, PurePosixPath

from kiks.errors import ParameterError
from kiks.model.atomic_files import inside, program_in
from kiks.model.program_files import ProgramFiles
from kiks.model.program_kinds import ENDINGS
from kiks.model.project import Project, ProjectRobot
from kiks.model.project_files import bytes_of, files_named
from kiks.ports.program_command import ProgramCommand, project_commands, project_supervisor


class Home:
    """The folder of a desk's project, and its programs, which may lie elsewhere.

    The project of a desk names each of its programs. One that lies elsewhere, such as a program of the command line or
    one that a person has run, has a name that no file of the folder has.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self._elsewhere: dict[str, ProgramCommand] = {}

    def named(self, project: Project, commands: Sequence[ProgramCommand | None], supervisor: Path | None) -> Project:
        """Return a project that names these programs and this supervisor; None leaves what it names."""
        robots = list(project.robots)
        for number, (robot, command) in enumerate(zip(robots, commands, strict=False)):
            robots[number] = robot if command is None else self.with_program(robot, command)
        if supervisor is not None:
            project = replace(project, supervisor=self._name_of(ProgramCommand(supervisor)))
        return replace(project, robots=tuple(robots))

    def with_program(self, robot: ProjectRobot, command: ProgramCommand | None) -> ProjectRobot:
        """Return a robot of the project with another program; without one if no project can hold its arguments."""
        if command is not None:
            with suppress(ParameterError):
                return replace(robot, program=self._name_of(command), arguments=tuple(command.arguments))
        return replace(robot, program=None, arguments=())

    def commands(self, project: Project) -> list[ProgramCommand | None]:
        """Return the program of each robot of the project; None for a robot without one."""
        commands = project_commands(self.alone(project), self.folder)
        for number, robot in enumerate(project.robots):
            if (command := self._elsewhere.get(robot.program or "")) is not None:
                commands[number] = replace(command, arguments=list(robot.arguments))
        return commands

    def supervisor(self, project: Project) -> Path | None:
        """Return the file of the project's supervisor; None if it has none."""
        command = self._elsewhere.get(project.supervisor or "")
        return project_supervisor(project, self.folder) if command is None else command.program

    def alone(self, project: Project) -> Project:
        """Return the project without the programs that lie elsewhere."""
        robots = (self.with_program(each, None) if each.program in self._elsewhere else each for each in project.robots)
        return replace(project, robots=tuple(robots))

    def moved(self, project: Project, folder: Path) -> tuple[Project, dict[str, bytes]]:
        """Return the project as it is named in another folder, and the files that it needs there, by their names.

        A program whose name another file there has gets another name. A program that is no file, such as a module after
        `-m`, is left out.
        """
        files = _Copies(folder.resolve())
        if files.folder != self.folder:
            for name in files_named(project, self.folder):
                files.add(inside(self.folder, name, "file"), name)

        def name_there(command: ProgramCommand) -> str | None:
            path = command.program.resolve()
            if command.module or path.suffix not in ENDINGS or not path.is_file():
                return None
            return _name_in(files.folder, path) or files.add_program(path, _name_in(self.folder, path) or path.name)

        robots = []
        for robot, command in zip(project.robots, self.commands(project), strict=True):
            program = None if command is None else name_there(command)
            robots.append(replace(robot, program=program, arguments=robot.arguments if program else ()))
        supervisor = self.supervisor(project)
        judge = None if supervisor is None else name_there(ProgramCommand(supervisor))
        return replace(project, robots=tuple(robots), supervisor=judge), files.missing

    def _name_of(self, command: ProgramCommand) -> str:
        """Return the name of a program in the project."""
        if not command.module and (name := _name_in(self.folder, command.program.resolve())) is not None:
            return name
        for name, other in self._elsewhere.items():
            if (other.program, other.module) == (command.program, command.module):
                return name
        wanted = re.sub(r"[^\w.-]", "_", command.name)
        name = _free_name(wanted, lambda name: name not in self._elsewhere and not (self.folder / name).exists())
        self._elsewhere[name] = command
        return name


class _Copies:
    """Files that have to be in a folder.

    Args:
        folder: The folder.

    Attributes:
        missing: What is not there yet, by name.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.missing: dict[str, bytes] = {}

    def add(self, path: Path, name: str) -> None:
        """Add a file under its name."""
        if not self._takes(name, data := bytes_of(path)):
            raise ParameterError(
                f"{name} must be free for a file of the project, but another file in {str(self.folder)!r} has this "
                "name. Rename that one, or save into another folder."
            )
        self._take(name, data)

    def add_program(self, path: Path, wanted: str) -> str:
        """Add a program with all files that belong to it; return its name."""
        data = bytes_of(path)
        name = _free_name(wanted, lambda name: self._takes(name, data))
        self._take(name, data)
        for other, file in ProgramFiles(path).files.items():
            if file != path:
                self.add(file, (PurePosixPath(name).parent / other).as_posix())
        return name

    def _takes(self, name: str, data: bytes) -> bool:
        """Return whether a name is free, or stands for the same file already."""
        path = self.folder / name
        return self.missing[name] == data if name in self.missing else not path.exists() or bytes_of(path) == data

    def _take(self, name: str, data: bytes) -> None:
        if not (self.folder / name).exists():
            self.missing[name] = data


def _free_name(wanted: str, is_free: Callable[[str], bool]) -> str:
    """Return the name of a file, with a number if it is not free."""
    path = PurePosixPath(wanted)
    name, number = wanted, 1
    while not is_free(name):
        number += 1
        name = path.with_name(f"{path.stem}_{number}{path.suffix}").as_posix()
    return name


def _name_in(folder: Path, program: Path) -> str | None:
    """Return the name of a program in a folder, as a project in it names it; None if it lies elsewhere."""
    try:
        program_in(folder, name := program.relative_to(folder).as_posix())
        return name
    except ValueError:  # a ParameterError, too: a project cannot name it
        return None
