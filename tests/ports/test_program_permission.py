"""Which programs a desk may start for a project, another world, a restart, or the page."""

import asyncio
from collections.abc import Callable
from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path

import pytest
from tests.ports.helpers import write

from kiks import Arena, ParameterError
from kiks.desk.server.desk import Desk
from kiks.desk.server.rights import Rights
from kiks.desk.server.scripts import EXAMPLES
from kiks.model.project import Project, ProjectRobot
from kiks.ports.program_command import ProgramCommand, project_commands
from kiks.ports.program_permission import Permission
from kiks.run import Run


def desk_of(folder: Path, *, may_run_programs: bool, granted: tuple[ProgramCommand | None, ...] = ()) -> closing[Desk]:
    project = Project(Arena.box(300, 300))
    desk = Desk(
        Run(project, folder, granted), Rights(owns_world=True, may_run_programs=may_run_programs), folder=folder
    )
    desk.begin()
    return closing(desk)


def program(folder: Path, name: str = "x.py") -> tuple[Path, Path]:
    """Write a program that creates a file; return the paths of both."""
    return write(folder / name, "import sys, pathlib; pathlib.Path(sys.argv[1]).touch()").program, folder / "trace"


def project_with(path: str, trace: Path) -> Project:
    return Project(Arena.box(300, 300), robots=(ProjectRobot(program=path, arguments=(str(trace),)),))


def wait_for_programs(desk: Desk) -> None:
    for handle in desk.programs.handles:
        handle.process.wait()


def upload(desk: Desk, project: Project) -> None:
    asyncio.run(desk.replace(Project.from_bytes(project.to_bytes())))


def restart(desk: Desk, project: Project) -> None:
    upload(desk, project)
    asyncio.run(desk.start_over())


def draw(desk: Desk, project: Project) -> None:
    """Replace the project, as the page does when it draws another robot."""
    upload(desk, project)
    asyncio.run(desk.replace(replace(desk.project, seed=2)))


def start_from_panel(desk: Desk, project: Project) -> None:
    (robot,) = project.robots
    assert robot.program is not None
    command = ProgramCommand(desk.folder / robot.program, list(robot.arguments))
    refused = pytest.raises(ParameterError, match="must be started at the terminal of this desk")
    with nullcontext() if desk.rights.may_run_programs else refused:
        desk.programs.start(command)


WAYS: tuple[Callable[[Desk, Project], None], ...] = (upload, restart, draw, start_from_panel)


@pytest.mark.slow
@pytest.mark.parametrize("may", [False, True], ids=["without", "with"])
@pytest.mark.parametrize("way", WAYS)
def test_desk_starts_programs_with_permission_only(way, may, tmp_path):
    _, trace = program(tmp_path)
    with desk_of(tmp_path, may_run_programs=may) as desk:
        way(desk, project_with("x.py", trace))
        assert may or not desk.programs.handles
        _, news = desk.news.since(0)
        left_out = "A program was left out: 'x.py' must be started at the terminal"
        assert may or way is start_from_panel or news[0].startswith(left_out)
        wait_for_programs(desk)
    assert trace.exists() == may


@pytest.mark.slow
def test_program_named_at_the_terminal_restarts(tmp_path: Path) -> None:
    path, trace = program(tmp_path, ".hidden/tool")
    with desk_of(tmp_path, may_run_programs=False, granted=(ProgramCommand(path, [str(trace)]),)) as desk:
        wait_for_programs(desk)
        trace.unlink()
        asyncio.run(desk.start_over())
        wait_for_programs(desk)
        assert trace.exists()
        with pytest.raises(ParameterError, match="must be started at the terminal"):
            desk.programs.start(ProgramCommand(path, [str(trace), "more"]))


@pytest.mark.parametrize(
    "name", ["x.txt", "x", ".ssh/x.py", "a/.b/x.py", ".x.py", ".py", "x.py/secret", "x.PY", "link.py", "deep/link.py"]
)
def test_program_must_be_a_visible_python_file(name: str, tmp_path: Path) -> None:
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    (home / "deep").mkdir(parents=True)
    program(elsewhere)
    program(home, ".secret/x.py")
    (home / "link.py").symlink_to(elsewhere / "x.py")
    (home / "deep/link.py").symlink_to(home / ".secret/x.py")
    with pytest.raises(ParameterError, match=r"^program must"):
        project_commands(project_with(name, tmp_path), home)
    with pytest.raises(ParameterError):
        Permission(folders=[home], may_start_others=True).check(ProgramCommand(home / name))


def test_programs_must_lie_in_the_folder_or_the_examples(tmp_path: Path) -> None:
    permission = Permission(folders=[tmp_path, EXAMPLES], may_start_others=True)
    path, _ = program(tmp_path, "a/x.py")
    permission.check(ProgramCommand(path))
    permission.check(ProgramCommand(next(EXAMPLES.glob("[!_]*.py"))))
    for other in (tmp_path.parent / "x.py", Path("/usr/lib/x.py"), tmp_path / "../x.py"):
        with pytest.raises(ParameterError, match="must lie in the desk's folder"):
            permission.check(ProgramCommand(other))


def test_failed_replacement_keeps_the_present_world(tmp_path: Path) -> None:
    _, trace = program(tmp_path)
    with desk_of(tmp_path, may_run_programs=True) as desk:
        before = desk.sim, desk.gate, desk.programs, desk.project
        bad = replace(project_with("x.py", trace), thinking="replay:missing")
        with pytest.raises(Exception, match="missing"):
            asyncio.run(desk.replace(bad))
        assert (desk.sim, desk.gate, desk.programs, desk.project) == before
