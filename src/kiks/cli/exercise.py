"""`kiks exercise`: checks exercises."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kiks.cli.command_line import command_group
from kiks.cli.engine_start import ready_engine
from kiks.cli.options import ExerciseFile, Trusted, Workers, progress_bar
from kiks.cli.outputs import Command, has_results, shows_progress, tell_results
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import counted, figure, printable
from kiks.table import Table

exercise = command_group("Check exercises.", no_args_is_help=True)


@exercise.callback()
def _exercise() -> None:
    """Keep the name of the command, although there is one alone."""


@exercise.command(cls=Command)
@has_results
@shows_progress
def check(
    context: typer.Context,
    exercise: ExerciseFile,
    solution: Annotated[
        Path | None, typer.Option(help="A program that should solve all cases: a file, or a folder with a __main__.py.")
    ] = None,
    workers: Workers = None,
    trusted: Trusted = False,
) -> None:
    """Check an exercise before a class gets it.

    A program that ends at once, one that waits, the template and, with --solution, a solution run in all cases, as
    kiks grade would run them. Lines tell what is to be looked at: points for nothing, a goal that holds before anything
    has moved, cases that the solution does not solve in time, scores that nothing counts. Then the exit code is 1.

    Example: kiks exercise check exercises/wall --solution wall.py
    """
    from kiks.ports.program_command import ProgramCommand as Program
    from kiks.trials.exercise_check import check_exercise, findings_of
    from kiks.trials.grading import load_exercise

    project, home = load_exercise(exercise)
    program = None if solution is None else Program(solution)
    if program is not None:
        program.check_file()
    ready_engine()
    end_as_with_ctrl_c()
    with progress_bar("exercise") as show:
        checked = check_exercise(project, home, program, is_trusted=trusted, workers=workers, on_progress=show)
    assert checked is not None
    findings = findings_of(project, checked)
    rows = [
        (
            each.submission.name,
            figure(each.outcomes.points),
            f"{each.outcomes.solved}/{len(checked.cases)}",
            each.problem or each.outcomes.last_words,
        )
        for each in checked.grades
    ]
    results: dict[str, Any] = {
        "cases": [case.name for case in checked.cases],
        "programs": [
            {"name": each.submission.name, "points": each.outcomes.points, "solved": each.outcomes.solved}
            for each in checked.grades
        ],
        "findings": findings,
    }
    table = Table(("program", "points", "solved", "said last"), rows, ends_in_text=True).for_output()
    without = "" if program is not None else " Whether it can be solved says --solution PROGRAM."
    end = f"{counted(len(findings), 'finding')} in {counted(len(checked.cases), 'case')}.{without}"
    tell_results(context, results, [table, *map(printable, findings), end])
    raise typer.Exit(bool(findings))
