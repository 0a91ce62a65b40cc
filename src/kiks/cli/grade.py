"""`kiks grade`."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.options import Trusted, Workers, progress_bar, say
from kiks.cli.outputs import has_results, shows_progress, tell_results
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, counted, printable
from kiks.table import Table

if TYPE_CHECKING:
    from kiks.trials.grading import Graded
    from kiks.trials.trial import Outcome


@has_results
@shows_progress
def grade(
    context: typer.Context,
    exercise: Annotated[
        Path, typer.Argument(help="A project with a goal and a time limit (.kiks), or the folder of an exercise.")
    ],
    submissions: Annotated[
        list[Path],
        typer.Argument(
            help="Programs (.py), folders of them, or archives (.zip), such as Moodle and Gradescope export. A folder "
            "with a __main__.py is one program."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the tables, the report and the recordings; grades-EXERCISE if left out."),
    ] = None,
    workers: Workers = None,
    trusted: Trusted = False,
    user: Annotated[
        str | None,
        typer.Option(
            help="Run the program as this user where no sandbox can be made, as in Gradescope's container; for root."
        ),
    ] = None,
) -> None:
    """Grade programs: run each in all cases of an exercise, and judge it by its goal.

    Each drives robot 1 in a sandbox: it reaches no file of yours, no network and no other program. A line says so if
    there is no bubblewrap, which makes the sandbox. What is left is grades.csv, moodle.csv, results/ for Gradescope,
    report.html, and a recording of each run (kiks replay). A command that was stopped goes on when it starts again.

    Example: kiks grade lamp.kiks submissions/

    Example: kiks grade exercises/wall moodle_export.zip --out grades
    """
    from kiks.model.atomic_files import alone_in
    from kiks.ports.other_user import OtherUser
    from kiks.ports.sandbox import Sandbox
    from kiks.trials.grading import grade as graded_of
    from kiks.trials.grading import load_exercise, trials_of
    from kiks.trials.report import save_grades
    from kiks.trials.runner import OUTCOMES
    from kiks.trials.submissions import submissions_in

    project, folder = load_exercise(exercise)
    other = None if user is None else OtherUser(user)
    if other is not None:
        other.check_unreadable([exercise, folder])
        os.umask(0o077)  # nor may it read what comes out
    elif not trusted:
        with Sandbox() as sandbox:
            sandbox.warm()  # Without one nothing is copied or compiled.
    out = Path(f"grades-{exercise.stem}") if out is None else out
    with alone_in(out, "--out", OUTCOMES):
        found = submissions_in(submissions, out / "programs")
        if other is not None:
            if len(found) != 1:
                raise ParameterError(
                    f"--user must have one submission, for programs of one user can reach each other, but there are "
                    f"{len(found)}. Grade each one alone."
                )
            other.let_read(out / "programs")
        count = len(trials_of(project, folder, found))
        ready_engine()
        end_as_with_ctrl_c()
        done = 0

        def note(outcome: Outcome, number: int) -> None:
            nonlocal done
            done = number
            show(number, count)

        options: dict[str, Any] = {"title": exercise.stem, "is_trusted": trusted, "workers": workers}
        if other is not None:
            # One worker: at the end of a sandbox all processes of that user are killed.
            options |= {"is_trusted": True, "user": other.name, "workers": 1}
        try:
            with progress_bar(counted(len(found), "submission")) as show:
                command = shlex.join(["kiks", *sys.argv[1:]])
                graded = graded_of(project, folder, found, out, command=command, on_outcome=note, **options)
            if other is not None:
                other.end_all()
            with progress_bar("report") as show_report:
                save_grades(graded, out, workers=workers, on_progress=show_report)
        except KeyboardInterrupt:
            say(f"stopped after {done} of {counted(count, 'run')}. The same command goes on from there.")
            raise
    tell_results(context, _results(graded, out))
    _tell(graded, out)


def _tell(graded: Graded, out: Path) -> None:
    """Print the table, and what people have to look at."""
    from kiks.trials.tables import COUNTED, likenesses_of, rows_of

    typer.echo(printable(graded.title))
    heads = ["name", "points", "solved", *COUNTED, "said last"]
    typer.echo(Table(heads, rows_of(graded), ends_in_text=True).for_output())
    for line in likenesses_of(graded):
        typer.echo(printable(line))
    for grade in graded.grades:
        if grade.submission.problem:
            say(printable(f"{grade.submission.name} was not graded: {grade.submission.problem}."))
        for outcome in grade.outcomes:
            if outcome.doubt:
                say(printable(f"{outcome.name} may come out differently next time: {outcome.doubt}."))
    typer.echo(f"{out / 'report.html'}: open it in a browser. {out / 'grades.csv'}, {out / 'moodle.csv'}")


def _results(graded: Graded, out: Path) -> dict[str, Any]:
    from kiks.trials.tables import gradescope_results

    return {
        "title": graded.title,
        "folder": str(out),
        "cases": [case.name for case in graded.cases],
        "submissions": [
            {"name": each.submission.name, "id": each.submission.id, "problem": each.submission.problem or None}
            | gradescope_results(graded, each)
            for each in graded.grades
        ],
        "alike": [vars(pair) for pair in graded.likenesses],
    }
