"""The exercises that come with KiKS: a solution solves each case, a naive program earns a part, the template less."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.at_length import AT_LENGTH, share

from kiks.model.exercise import Case, cases_of
from kiks.model.package import shipped
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.sim.from_project import in_case
from kiks.trials.runner import run_trials
from kiks.trials.trial import End, Outcome, Trial

SOLUTIONS = Path(__file__).parent / "solutions"

SEEDS = share((8001,), (8001, 8002, 8003))
"""Seeds with which no solution was made."""

POINTS_MAX = 10.0
"""Most points of a case, the same in all exercises."""

EARNING = {"lamp": -1}
"""The case in which a naive program earns something, where that is not the first one."""

FOLDER = shipped("examples/exercises")
NAMES = sorted(path.parent.name for path in FOLDER.glob("*/exercise.kiks"))


def tried_cases(project: Project) -> Iterator[Case]:
    """Return the cases in which programs are tried: one that students see and a hidden one, or all of them."""
    cases = cases_of(project.cases)
    for case in share((cases[0], cases[-1]), tuple(cases)):
        for seed in SEEDS:
            yield replace(case, name=f"{case.name}, seed {seed}", seed=seed)


def trials_of(name: str) -> Iterator[Trial]:
    """Return the trials of an exercise's programs, named 'exercise/program/number'."""
    folder = FOLDER / name
    project = Project.load(folder)
    everywhere = [*tried_cases(project)]
    for program, file, cases in (
        ("solution", SOLUTIONS / f"{name}.py", share(everywhere[-1:], everywhere)),
        ("naive", SOLUTIONS / f"{name}_naive.py", share([everywhere[EARNING.get(name, 0)]], everywhere)),
        ("template", folder / "template.py", everywhere),
    ):
        for number, case in enumerate(cases):
            world = in_case(project, case, folder)
            yield Trial(f"{name}/{program}/{number}", world, folder, (ProgramCommand(file),), is_trusted=True)


@pytest.mark.slow
def test_solutions_solve_them_and_less_than_that_earns_less(tmp_path: Path) -> None:
    outcomes: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in run_trials([trial for name in NAMES for trial in trials_of(name)], tmp_path):
        assert outcome.end_of().how not in (End.CRASHED, End.ENDLESS), outcome
        assert not outcome.doubt
        assert 0 <= outcome.points <= POINTS_MAX
        name, program, _ = outcome.name.split("/")
        outcomes.setdefault((name, program), []).append(outcome)
    for name in NAMES:
        for program, is_solved in (("solution", True), ("template", False)):
            assert [each for each in outcomes[name, program] if each.is_solved is not is_solved] == []
        programs = ("template", "naive", "solution")
        template, naive, solution = (sum(each.points for each in outcomes[name, program]) for program in programs)
        assert template < naive, name
        # In one case a naive program may have luck, in all cases it has not.
        assert naive < solution or not AT_LENGTH, name


@pytest.mark.parametrize("name", NAMES)
def test_it_has_what_a_class_needs(name: str) -> None:
    folder = FOLDER / name
    project = Project.load(folder)
    exercise, goal, cases = project.exercise, project.goal, cases_of(project.cases)
    assert exercise.title == project.arena.name
    assert all((exercise.title, goal.text, project.seconds))
    assert "\n## Hint" in exercise.text
    assert all(len(line) <= 150 for line in exercise.text.splitlines())
    assert 3 <= sum(not case.is_hidden for case in cases) <= 6
    assert any(case.is_hidden for case in cases)
    # What a lab has: robots that are not alike, and computers that need time.
    assert any(case.family for case in cases if case.is_hidden)
    for case in cases:
        in_case(project, case, folder)
