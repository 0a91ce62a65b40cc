"""Goals, cases and exercises of projects: their way through files, what cases there are, and what is refused."""

import re
from dataclasses import replace
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from tests.model.refusals import refused

from kiks.errors import ArenaError, KiksError
from kiks.model.arena import Arena, Pose
from kiks.model.arena_file import StartEntry
from kiks.model.exercise import CASES_MAX, LONG_TEXT_MAX, Case, Cases, Exercise, cases_of
from kiks.model.goal import Goal
from kiks.model.project import EXERCISE_FILES, Project
from kiks.model.robot import RobotSpec
from kiks.sim.from_project import in_case, simulation_of

texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20)
formulas = st.sampled_from(["contacts > 0", 'score("laps") >= 3', "is_solved", "10 - min(contacts, 5)", "False"])
goals = st.builds(Goal, text=texts, solved=formulas, failed=formulas, points=formulas, robot=st.integers(1, 1000))
exercises = st.builds(Exercise, title=texts, text=texts, template=texts, is_locked=st.booleans())
seeds = st.lists(st.integers(0, 2**63 - 1), max_size=3).map(tuple)
starts = st.builds(StartEntry, st.tuples(st.floats(0, 1000), st.floats(0, 1000)), st.floats(-360, 360))
tables = st.builds(
    Cases,
    name=texts,
    seed=seeds,
    start=st.lists(starts, max_size=2).map(tuple),
    arena=st.lists(st.sampled_from(["maze", "rooms/a.toml"]), max_size=2).map(tuple),
    baud=st.lists(st.sampled_from([9600, 38400]), max_size=2).map(tuple),
    thinking=st.lists(st.sampled_from(["none", "fixed:5"]), max_size=2).map(tuple),
    family=st.lists(st.integers(0, 9), max_size=2).map(tuple),
    is_hidden=st.booleans(),
)


@given(goals, exercises, st.lists(tables, max_size=3).map(tuple))
def test_a_project_comes_back_from_its_file(goal: Goal, exercise: Exercise, cases: tuple[Cases, ...]) -> None:
    project = Project(Arena.box(300, 300), goal=goal, exercise=exercise, cases=cases)
    back = Project.from_bytes(project.to_bytes())
    assert (back.goal, back.exercise, back.cases) == (goal, exercise, cases)


def test_a_project_without_these_tables_has_none() -> None:
    data = Project(Arena.box(300, 300)).to_bytes()
    assert b"goal" not in data
    back = Project.from_bytes(data)
    assert (back.goal, back.exercise, back.cases) == (None, None, ())


@given(st.lists(tables, max_size=3))
def test_there_is_a_case_for_each_choice_of_values_and_no_two_share_a_name(found: list[Cases]) -> None:
    cases = cases_of(found)
    count = 0
    for table in found:
        choices = 1
        for name in ("seed", "start", "arena", "baud", "thinking", "family"):
            choices *= len(getattr(table, name)) or 1
        mine = cases[count : count + choices]
        assert {case.seed for case in mine} == set(table.seed or (None,))
        assert {case.family for case in mine} == set(table.family or (0,))
        assert all(case.is_hidden == table.is_hidden for case in mine)
        count += choices
    assert (len(cases), len({case.name for case in cases})) == (count or 1, len(cases))
    assert all(case.name for case in cases)


def test_cases_are_named_by_what_differs() -> None:
    home = Cases("home", seed=(1, 2), baud=(9600,))
    other = Cases(start=(StartEntry((100.0, 50.0)),), family=(0, 3), thinking=("fixed:2",))
    assert [case.name for case in cases_of([home, other])] == [
        "home, seed 1",
        "home, seed 2",
        "from 100, 50 at 90 deg, thinking fixed:2, the exact robot",
        "from 100, 50 at 90 deg, thinking fixed:2, robot 3 of the family",
    ]
    assert [case.name for case in cases_of([Cases("a"), Cases("a")])] == ["a", "a (2)"]


def test_a_case_changes_the_project_alone_and_has_an_arena_of_kiks_or_of_its_folder(tmp_path: Path) -> None:
    arena = replace(Arena.box(300, 300), starts=(Pose(100, 100, 0.0), Pose(200, 200, 0.0)))
    project = Project(arena, seed=1, thinking="fixed:3", cases=(Cases("a"),), exercise=Exercise("b"))
    same = in_case(project, Case("a"), tmp_path)
    assert same == replace(project, cases=(), exercise=None)
    case = Case("b", seed=5, start=Pose(150, 150, 1.0), baud=38400, thinking="none", family=2)
    made = in_case(project, case, tmp_path)
    assert (made.seed, made.baud, made.thinking) == (5, 38400, "none")
    assert made.arena.starts == (Pose(150, 150, 1.0), Pose(200, 200, 0.0))
    sim = simulation_of(made)
    assert sim.pose(1)[:2] == (150, 150)
    assert sim.spec != RobotSpec.load("khepera")
    assert simulation_of(in_case(project, replace(case, family=3), tmp_path)).spec != sim.spec
    (tmp_path / "small.toml").write_text("size_mm = [200, 250]")
    assert in_case(Project(), Case(arena="small.toml"), tmp_path).arena.width_mm == 200
    assert in_case(Project(), Case(arena="maze"), tmp_path).arena.name == Arena.load("maze").name
    for name in ("../small.toml", str(tmp_path / "small.toml"), "other.toml", "maize"):
        folder = tmp_path / "sub" if name.startswith("..") else tmp_path
        refused("must", in_case, Project(), Case(arena=name), folder, error=KiksError)


def test_a_folder_is_an_exercise_with_its_text_and_template_beside(tmp_path: Path) -> None:
    project = Project(Arena.box(300, 300), exercise=Exercise("Title", text="short"))
    project.save(tmp_path / "exercise.kiks")
    assert Project.load(tmp_path).exercise == project.exercise
    (tmp_path / EXERCISE_FILES["text"]).write_text("# Title\nlong")
    (tmp_path / EXERCISE_FILES["template"]).write_text("import serial\n")
    for path in (tmp_path, tmp_path / "exercise.kiks"):
        assert Project.load(path).exercise == Exercise("Title", "# Title\nlong", "import serial\n")
    (tmp_path / EXERCISE_FILES["text"]).write_text("a" * (LONG_TEXT_MAX + 1))
    refused("at most 200000 characters", Project.load, tmp_path, error=KiksError)
    (tmp_path / "none").mkdir()
    refused("must exist", Project.load, tmp_path / "none", error=ArenaError)


def test_what_is_wrong_in_a_file_is_said_in_one_line() -> None:
    for line, words in (
        ('[goal]\nsolved = "contacts >"', "goal.solved must be a formula, but 'contacts >' is none: invalid syntax"),
        ('[goal]\nsovled = "1"', "goal must have known keys only, but it has 'sovled'. Did you mean 'solved'?"),
        ("[goal]\nrobot = 0", "goal.robot must be at least 1"),
        ("[[case]]\nseed = [-1]", "case 1: seed[0] must be at least 0"),
        ('[[case]]\nthinking = ["slow"]', "case 1: thinking must be 'none', 'fixed:MS'"),
        ("[[case]]\nseed = 1", "case 1: seed must be a list, but it was 1"),
        ("[[case]]\nfamily = [true]", "case 1: family[0] must be a whole number"),
        (f"[[case]]\nseed = {list(range(101))}\nfamily = {list(range(100))}", "case 1: cases must be at most 10000"),
        ("[exercise]\ntext = 3", "exercise.text must be a text"),
    ):
        data = f"kiks = 1\n{line}\n[walls]\nsize_mm = [300, 300]\n".encode()
        refused(re.escape(words), Project.from_bytes, data, error=ArenaError)
    many = Cases(seed=tuple(range(1000)), family=(1, 2, 3, 4, 5, 6))
    refused(f"cases must be at most {CASES_MAX}, but there are 12000", cases_of, [many, many])
