"""Demonstrations on a desk: their programs and supervisors come with them, where that is allowed."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from tests import forked
from tests.at_length import cases
from tests.cli.test_cli import state_of
from tests.guard import GUARD_S, wait_until

from kiks.desk.server.desk import Desk
from kiks.desk.server.folder import Folder
from kiks.desk.server.home import Home
from kiks.desk.server.rights import Rights
from kiks.model.project import Project, ProjectRobot
from kiks.model.shipped import demonstrations
from kiks.ports.program_command import ProgramCommand
from kiks.run import Run
from kiks.sim.simulation import Simulation

CLEAN = demonstrations()["clean"]


@contextmanager
def desk_in(folder: Path, project: Project, home: Path | None = None, *, is_free: bool = True) -> Iterator[Desk]:
    """Open a desk, which may run programs if it is free, and a project on it."""
    desk = Desk(Run.in_world(Simulation(), folder), Rights(owns_world=True, may_run_programs=is_free), folder=folder)
    asyncio.run(desk.replace(project, home))
    yield desk
    desk.clear_away()
    desk.close()


def test_a_demonstration_begins_with_its_program_and_supervisor_also_again_and_after_a_change(tmp_path: Path) -> None:
    with desk_in(tmp_path, Project.load(CLEAN), CLEAN.parent) as desk:
        places = desk.sim.bodies()["x_mm"].tolist()
        assert (len(places), desk.has_beginners) == (12, True)
        asyncio.run(desk.start_over())
        assert desk.sim.bodies()["x_mm"].tolist() == places
        asyncio.run(desk.replace(asyncio.run(desk.present_project())))
        assert (desk.sim.bodies()["x_mm"].tolist(), desk.has_beginners) == (pytest.approx(places, abs=1e-3), True)
        saved, beside = asyncio.run(desk.project_to_save("mine.kiks"))
        assert (saved.supervisor, saved.robots[0].program, len(saved.arena.cylinders)) == (*sorted(beside)[::-1], 12)
        assert beside == {name: (CLEAN.parent / name).read_bytes() for name in ("clean.py", "supervisors/clean.py")}
        said: list[str] = []
        desk.say = said.append
        desk.attach(ProgramCommand(Path("this.py"), module="this"), 1)
        assert asyncio.run(desk.project_to_save("mine.kiks"))[0].robots[0].program is None
        assert [line.partition(". ")[0] for line in said] == ["Not saved with the project: this"]


@pytest.mark.parametrize("name", cases(["soccer", *sorted({*demonstrations()} - {"soccer"})]))
def test_a_demonstration_that_is_saved_elsewhere_runs_the_same_and_replaces_nothing(name: str, tmp_path: Path) -> None:
    path = demonstrations()[name]
    project = Project.load(path)
    taken = tmp_path / str(project.robots[0].program)
    taken.write_text("mine")
    for _ in "12":
        saved, beside = Home(path.parent).moved(project, tmp_path)
        Folder(tmp_path).save(saved.to_bytes(), "saved", "a project", beside=beside, may_replace=True)
    runs = [forked.run(*words, "--seconds", "1", cwd=tmp_path) for words in (("demo", name), ("run", "saved.kiks"))]
    assert state_of(runs[0].stderr) == state_of(runs[1].stderr)
    assert (taken.read_text(), saved.robots[0].program, beside) == ("mine", f"{taken.stem}_2.py", {})


def test_a_page_without_that_right_opens_the_world_alone(tmp_path: Path) -> None:
    with desk_in(tmp_path, Project.load(CLEAN), CLEAN.parent, is_free=False) as desk:
        assert (len(desk.sim.bodies()), desk.has_beginners) == (0, False)
        assert [text.partition(":")[0] for text in desk.news.since(0)[1]] == ["A program was left out"] * 2


@pytest.mark.parametrize("how", [{"supervisor": "ends.py"}, {"seconds": 0.5}])
def test_the_world_pauses_when_the_project_has_ended_and_may_go_on(how: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "ends.py").write_text("def supervise(sim):\n    yield 0.5\n")
    with desk_in(tmp_path, Project(**how)) as desk:
        running = threading.Thread(target=lambda: desk.sim.run(1.0))
        running.start()
        wait_until(lambda: desk.is_paused)
        assert desk.sim.time_s == 0.5
        assert "of simulated time" in desk.news.since(0)[1][-1]
        asyncio.run(desk.set_speed(None))
        asyncio.run(desk.go_on())
        running.join(GUARD_S)
        assert desk.sim.time_s == 1.0


def test_a_desk_that_closes_lets_its_supervisor_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    supervise = "def supervise(sim):\n    try:\n        yield 9.0\n    finally:\n        print('1:0')\n"
    (tmp_path / "referee.py").write_text(supervise)
    with desk_in(tmp_path, Project(supervisor="referee.py")) as desk:
        asyncio.run(desk.start_over())
        desk.clear_away()
        assert capsys.readouterr().out == "1:0\n"  # that of the world before
    assert capsys.readouterr().out == "1:0\n"


def test_a_score_calls_a_side_by_its_robot_or_else_by_its_program(tmp_path: Path) -> None:
    project = Project(robots=(ProjectRobot(name="Reds"), *(ProjectRobot() for _ in range(3))))
    commands = [ProgramCommand(tmp_path / f"{name}.py") for name in ("player", "player", "chaser")]
    desk = Desk(Run(project, tmp_path, commands))
    assert desk.sides() == ["Reds", "player", "chaser", "robot 4"]
    other = Desk(Run.in_world(Simulation(robots=2), commands=commands[:2]))
    assert other.sides() == ["player 1", "player 2"]
    for each in (desk, other):
        each.close()
