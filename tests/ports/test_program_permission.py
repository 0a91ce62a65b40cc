"""Which programs a desk starts, whoever asks, and how: a project, another world, a restart, the page."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from kiks.desk.server.desk import Desk
from kiks.desk.server.scripts import EXAMPLES
from kiks.errors import ParameterError
from kiks.model.arena import Arena
from kiks.model.project import Project, ProjectRobot
from kiks.ports.program_process import Command, Permission, commands_of
from kiks.sim.from_project import simulation_of

TRACE = "import sys, pathlib; pathlib.Path(sys.argv[1]).touch()"


@contextmanager
def desk_of(folder: Path, *, may_run_programs: bool, granted: tuple[Command | None, ...] = ()) -> Iterator[Desk]:
    project = Project(Arena.box(300, 300))
    desk = Desk(
        simulation_of(project, folder),
        project=project,
        folder=folder,
        owns_world=True,
        may_run_programs=may_run_programs,
        commands=granted,
    )
    try:
        yield desk
    finally:
        desk.close()


def program(folder: Path, name: str = "x.py") -> tuple[Path, Path]:
    """Write a program that leaves a trace; return it, and where the trace is."""
    path = folder / name
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text(TRACE)
    return path, folder / "trace"


def project_with(path: str, trace: Path) -> Project:
    return Project(Arena.box(300, 300), robots=(ProjectRobot(program=path, arguments=(str(trace),)),))


def end_of_all(desk: Desk) -> None:
    """Let all programs that have started come to their ends."""
    for handle in desk.programs.handles:
        handle.process.wait()


def upload(desk: Desk, project: Project) -> None:
    asyncio.run(desk.replace(Project.from_bytes(project.to_bytes())))


def restart(desk: Desk, project: Project) -> None:
    upload(desk, project)
    asyncio.run(desk.start_over())


def draw(desk: Desk, project: Project) -> None:
    """Do what the page does that draws another robot."""
    upload(desk, project)
    asyncio.run(desk.replace(replace(desk.project, seed=2)))


def craft(desk: Desk, project: Project) -> None:
    """Start it as the panel of programs would."""
    (robot,) = project.robots
    assert robot.program is not None
    command = Command(desk.folder / robot.program, list(robot.arguments))
    if desk.may_run_programs:
        desk.programs.start(command)
    else:
        with pytest.raises(ParameterError, match="must be started at the terminal of this desk"):
            desk.programs.start(command)


WAYS: tuple[Callable[[Desk, Project], None], ...] = (upload, restart, draw, craft)


@pytest.mark.parametrize("way", WAYS)
def test_a_desk_that_may_not_starts_no_program(way: Callable[[Desk, Project], None], tmp_path: Path) -> None:
    _, trace = program(tmp_path)
    with desk_of(tmp_path, may_run_programs=False) as desk:
        way(desk, project_with("x.py", trace))
        assert not desk.programs.handles
        _, said = desk.news.since(0)
        assert way is craft or said[0].startswith("A program was left out: 'x.py' must be started at the terminal")
    assert not trace.exists()


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_a_desk_that_may_starts_it(way: Callable[[Desk, Project], None], tmp_path: Path) -> None:
    _, trace = program(tmp_path)
    with desk_of(tmp_path, may_run_programs=True) as desk:
        way(desk, project_with("x.py", trace))
        end_of_all(desk)
    assert trace.exists()


@pytest.mark.slow
def test_what_the_person_at_the_terminal_has_named_starts_over(tmp_path: Path) -> None:
    path, trace = program(tmp_path, ".hidden/tool")
    with desk_of(tmp_path, may_run_programs=False, granted=(Command(path, [str(trace)]),)) as desk:
        end_of_all(desk)
        trace.unlink()
        asyncio.run(desk.start_over())
        end_of_all(desk)
        assert trace.exists()
        with pytest.raises(ParameterError, match="must be started at the terminal"):
            desk.programs.start(Command(path, [str(trace), "more"]))


@pytest.mark.parametrize(
    "name", ["x.txt", "x", ".ssh/x.py", "a/.b/x.py", ".x.py", ".py", "x.py/secret", "x.PY", "link.py", "deep/link.py"]
)
def test_a_program_is_a_python_file_in_plain_sight(name: str, tmp_path: Path) -> None:
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    (home / "deep").mkdir(parents=True)
    program(elsewhere)
    program(home, ".secret/x.py")
    (home / "link.py").symlink_to(elsewhere / "x.py")
    (home / "deep/link.py").symlink_to(home / ".secret/x.py")
    with pytest.raises(ParameterError, match=r"^program must"):
        commands_of(project_with(name, tmp_path), home)
    with pytest.raises(ParameterError):
        Permission(folders=[home], may_start_others=True).check(Command(home / name))


def test_programs_lie_in_the_folder_or_among_the_examples(tmp_path: Path) -> None:
    permission = Permission(folders=[tmp_path, EXAMPLES], may_start_others=True)
    path, _ = program(tmp_path, "a/x.py")
    permission.check(Command(path))
    permission.check(Command(next(EXAMPLES.glob("[!_]*.py"))))
    for other in (tmp_path.parent / "x.py", Path("/usr/lib/x.py"), tmp_path / "../x.py"):
        with pytest.raises(ParameterError, match="must lie in the desk's folder"):
            permission.check(Command(other))


def test_a_world_that_cannot_begin_leaves_the_one_that_is_there(tmp_path: Path) -> None:
    _, trace = program(tmp_path)
    with desk_of(tmp_path, may_run_programs=True) as desk:
        before = desk.sim, desk.gate, desk.programs, desk.project
        bad = replace(project_with("x.py", trace), thinking="replay:missing")
        with pytest.raises(Exception, match="missing"):
            asyncio.run(desk.replace(bad))
        assert (desk.sim, desk.gate, desk.programs, desk.project) == before
