"""The check of an exercise before a class gets it: programs whose results are known are tried in all of its cases.

Need: a goal that is true before a robot has moved gives full marks for nothing, and is easily overlooked. Method: what
a program that does nothing, the template and a solution get says more about a goal than its formulas do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from kiks.errors import counted, shown
from kiks.model.atomic_files import make_folder
from kiks.model.exercise import STUDENT
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.sim.judge import LOOK_S, POINTS, RESULT
from kiks.trials.grading import Graded, grade, trials_of
from kiks.trials.runner import run_trials
from kiks.trials.submissions import Submission
from kiks.trials.trial import Outcome

ENDS, WAITS, TEMPLATE, SOLUTION = "ends at once", "does nothing", "template", "solution"
"""The programs that are tried; those that no student wrote are `_IDLE`."""

_IDLE = {ENDS: "", WAITS: "import time\n\nwhile True:\n    time.sleep(60)\n"}

NAMED_MAX = 3
"""Most cases that a finding names."""


def check_exercise(
    project: Project,
    folder: Path,
    solution: ProgramCommand | None = None,
    *,
    is_trusted: bool = False,
    on_progress: Callable[[int, int], object] = lambda done, count: None,
    **options: Any,
) -> Graded | None:
    """Try programs in all cases of an exercise; return how they have done, or None if that was stopped.

    Args:
        project: The exercise.
        folder: Where it lies.
        solution: A program that should solve it; None if there is none.
        is_trusted: Whether the programs run without a sandbox.
        on_progress: Called with the number of runs that are done, and of all.
        options: Other ones of `run_trials`.
    """
    with TemporaryDirectory(prefix="kiks-check-") as place:
        programs = _programs(project, Path(place, "programs"))
        if solution is not None:
            programs.append(Submission(SOLUTION, id=SOLUTION, command=solution))
        trials = trials_of(project, folder, programs, is_trusted=is_trusted)
        outcomes = run_trials(trials, Path(place), on_outcome=lambda _, done: on_progress(done, len(trials)), **options)
    return grade(project, programs, outcomes) if len(outcomes) == len(trials) else None


def _programs(project: Project, folder: Path) -> list[Submission]:
    """Write the programs that no student wrote into a folder, and return them."""
    texts = dict(_IDLE)
    if project.exercise is not None and project.exercise.template.strip():
        texts[TEMPLATE] = project.exercise.template
    make_folder(folder, "the folder of the check")
    programs = []
    for name, text in texts.items():
        file = folder / f"{name.replace(' ', '_')}.py"
        file.write_text(text, encoding="utf-8")
        programs.append(Submission(name, id=file.stem, command=ProgramCommand(file)))
    return programs


def findings_of(project: Project, graded: Graded) -> list[str]:
    """Return sentences about what is to be looked at in an exercise; none if nothing is.

    Args:
        project: The exercise.
        graded: How the programs of `check_exercise` have done in it.

    Example:
        >>> from kiks.model.goal import Goal
        >>> project = Project(seconds=1.0, goal=Goal(solved="contacts == 0"))
        >>> findings_of(project, check_exercise(project, Path(), is_trusted=True))
        ['The goal is solved before anything has moved, with 1 point.']
    """
    of_cases: dict[str, list[str]] = {}
    for number, case in enumerate(graded.cases):
        for sentence in _in_a_case(project, {each.submission.name: each.outcomes[number] for each in graded.grades}):
            of_cases.setdefault(sentence, []).append(case.name)
    found = [_where(names, len(graded.cases)) + sentence for sentence, names in of_cases.items()]
    return [*found, *_never_counted(project, graded)]


def _in_a_case(project: Project, outcomes: dict[str, Outcome]) -> Iterator[str]:
    """Yield a sentence about each thing in a case that is to be looked at."""
    idle = max((outcomes[name] for name in _IDLE), key=lambda each: (each.is_solved, each.points))
    gets = counted(idle.points, "point")
    waits = outcomes[WAITS]
    if (waits.is_solved or waits.is_failed) and waits.time_s <= LOOK_S:
        yield f"The goal {'is solved' if waits.is_solved else 'has failed'} before anything has moved, with {gets}."
    elif idle.is_solved:
        yield f"A program that does nothing solves it, with {gets}."
    elif idle.points > 0:
        yield f"A program that does nothing gets {gets}."
    if (template := outcomes.get(TEMPLATE)) is not None:
        if template.is_solved and not idle.is_solved:
            yield "The template solves it."
        if (end := template.end_of(STUDENT)).has_failed:
            yield f"The template fails: {end}."
    solution = outcomes.get(SOLUTION)
    has_solved = project.goal is not None and bool(project.goal.formulas()["solved"].terms)
    if solution is not None and has_solved and not solution.is_solved:
        yield f"The solution does not solve it in {project.seconds:g} s: {solution.end_of(STUDENT)}."
    # What the world does by itself, each once.
    yield from dict.fromkeys(sentence for outcome in outcomes.values() for sentence in _world_faults(outcome))


def _world_faults(outcome: Outcome) -> Iterator[str]:
    """Yield a sentence about each program of the exercise that has failed, and about a run that may differ."""
    for end in outcome.ends:
        if end.robot != STUDENT and end.has_failed:
            yield f"The program of robot {end.robot}, {end.name}, fails: {end}."
    if outcome.doubt:
        yield f"A run may come out differently next time: {outcome.doubt}."


def _where(names: Sequence[str], case_count: int) -> str:
    """Return the beginning of a sentence that holds in some of the cases."""
    if len(names) == case_count:
        return ""
    more = len(names) - NAMED_MAX
    return f"{', '.join(map(shown, names[:NAMED_MAX]))}{f' and {more} more' if more > 0 else ''}: "


def _never_counted(project: Project, graded: Graded) -> Iterator[str]:
    """Yield a sentence about each entry of the score that the goal asks for and no run has."""
    wanted = set() if project.goal is None else project.goal.counts()
    there = {POINTS, RESULT}.union(*(outcome.score for each in graded.grades for outcome in each.outcomes))
    for what in sorted(map(repr, (each for each in wanted if str(each) not in there))):
        yield f"score({what}) was counted in none of these runs, so it is 0: does the supervisor call it so?"
