"""`kiks grade`."""

from __future__ import annotations

import os
import shlex
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from kiks.cli.options import ExerciseFile, Trusted, Workers, progress_bar, run_and_show, say
from kiks.cli.outputs import has_results, leave_out, shows_progress, tell_results
from kiks.errors import ParameterError, counted, figure, printable

if TYPE_CHECKING:
    from kiks.trials.grading import Graded
    from kiks.trials.submissions import Submission


Submissions = Annotated[
    list[Path],
    typer.Argument(
        help="Programs (.py), folders of them, or archives (.zip, .tar.gz), such as Moodle and Gradescope export. "
        "A folder with a __main__.py is one program."
    ),
]

OutFolder = Annotated[
    Path | None,
    typer.Option(help="Folder of the tables, the report and the recordings; grades-EXERCISE if left out."),
]

StudentsFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="The students: a name on each line, or a CSV, such as Moodle's grading worksheet. Who handed in "
        "nothing is in the tables, too.",
    ),
]

Maximum = Annotated[
    float | None,
    typer.Option("--max", help="Grade for full points; points are the grade if left out.", min=0.01, max=1e6),
]

FullPoints = Annotated[
    float | None,
    typer.Option(
        help="Full points; if left out, the most that the exercise's formula of points can give.",
        min=0.001,
        max=1e6,
    ),
]

DueTime = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help="When hand-ins were due, such as 2026-11-28T23:59; each day that has begun since costs --penalty.",
    ),
]

Penalty = Annotated[float, typer.Option(help="Share of the grade that each day after --due costs [%].", min=0, max=100)]

WhichAttempts = Annotated[
    Literal["best", "last"] | None,
    typer.Option(help="Which submission of a student counts: best or last; each has a row if left out."),
]

OtherUserName = Annotated[
    str | None,
    typer.Option(
        help="Run the program as this user where no sandbox can be made, as in Gradescope's container; for root."
    ),
]


@has_results
@shows_progress
def grade(
    context: typer.Context,
    exercise: ExerciseFile,
    submissions: Submissions,
    out: OutFolder = None,
    students: StudentsFile = None,
    maximum: Maximum = None,
    full: FullPoints = None,
    due: DueTime = None,
    penalty: Penalty = 10.0,
    attempts: WhichAttempts = None,
    workers: Workers = None,
    trusted: Trusted = False,
    user: OtherUserName = None,
) -> None:
    """Grade programs: run each in all cases of an exercise, and judge it by its goal.

    Each drives robot 1 in a sandbox: it reaches no file of yours, no network and no other program. A line says so if
    there is no bubblewrap, which makes the sandbox. What is left is grades.csv, moodle.csv, results/ for Gradescope,
    report.html, a page for each student in feedback/, and a recording of each run (kiks replay). A command that was
    stopped goes on when it starts again.

    Example: kiks grade lamp.kiks submissions/

    Example: kiks grade exercises/wall moodle_export.zip --students worksheet.csv --max 100 --due 2026-11-28T23:59
    """
    from kiks.model.atomic_files import alone_in
    from kiks.ports.other_user import OtherUser
    from kiks.ports.sandbox import check_sandbox
    from kiks.trials import grading
    from kiks.trials.marking import marking_for
    from kiks.trials.report import save_grades
    from kiks.trials.runner import OUTCOMES
    from kiks.trials.students import read_students, with_students
    from kiks.trials.submissions import submissions_in

    project, folder = grading.load_exercise(exercise)
    if due is None:
        leave_out(context, "without --due", "penalty")
    marking = marking_for(project, maximum, full, due, penalty)
    listed = None if students is None else read_students(students)
    other = None if user is None else OtherUser(user)
    if other is not None:
        other.check_unreadable([exercise, folder])
        os.umask(0o077)  # nor may it read what comes out
    elif not trusted:
        check_sandbox()  # Without one nothing is copied or compiled.
    out = Path(f"grades-{exercise.stem}") if out is None else out
    with alone_in(out, "--out", OUTCOMES):
        found = submissions_in(submissions, out / "programs")
        if other is not None:
            _check_alone(found)
            other.let_read(out / "programs")
        found, strangers = (found, []) if listed is None else with_students(found, listed)
        is_trusted = trusted or other is not None
        command = shlex.join(["kiks", *sys.argv[1:]])
        trials = grading.trials_of(project, folder, found, is_trusted=is_trusted, command=command, user=user or "")
        # At the end of a sandbox all processes of another user are killed.
        at_once = workers if other is None else 1
        outcomes = run_and_show(trials, out, counted(len(found), "submission"), workers=at_once)
        if other is not None:
            other.end_all()
        graded = grading.grade(
            project, found, outcomes, title=exercise.stem, marking=marking, attempts=attempts, is_trusted=is_trusted
        )
        with progress_bar("report", "page") as show:
            save_grades(graded, out, workers=workers, on_progress=show)
    tell_results(context, _results(graded, out))
    _tell(graded, out)
    if strangers:
        names = ", ".join(each.name for each in strangers)
        count = counted(len(strangers), "submission")
        say(printable(f"{count} with no student in {students}, or with several: {names}."))


def _check_alone(found: Sequence[Submission]) -> None:
    """Check that programs of one user cannot reach each other: there is one."""
    if len(found) != 1:
        raise ParameterError(
            f"--user must have one submission, for programs of one user can reach each other, but there are "
            f"{len(found)}. Grade each one alone."
        )


def _tell(graded: Graded, out: Path) -> None:
    """Print the table, and what people have to look at."""
    from kiks.trials.students import identities
    from kiks.trials.tables import likeness_sentences, overview

    marking = graded.marking
    typer.echo(printable(graded.title))
    for line in graded.faults:
        typer.echo(printable(line))
    typer.echo(overview(graded).for_output())
    if marking.most is not None:
        typer.echo(f"A grade of {figure(marking.most)} is for {counted(marking.full, 'point')}.")
    for line in likeness_sentences(graded):
        typer.echo(printable(line))
    for grade in graded.grades:
        if grade.problem:
            say(printable(f"{grade.submission.name} was not graded: {grade.problem}."))
        for outcome in grade.outcomes:
            if outcome.doubt:
                say(printable(f"{outcome.name} may come out differently next time: {outcome.doubt}."))
        if marking.due_s is not None and grade.mark is not None and grade.days_late is None:
            say(printable(f"{grade.submission.name} has no time of handing in, and counts as in time."))
    handed_in = Counter((identities(grade.submission)[0], grade.submission.name) for grade in graded.grades)
    for (_, name), count in handed_in.items():
        if count > 1:
            say(printable(f"{name} has {count} rows: --attempts best or last chooses one."))
    typer.echo(f"{out / 'report.html'}: open it in a browser. {out / 'grades.csv'}, {out / 'moodle.csv'}")


def _results(graded: Graded, out: Path) -> dict[str, Any]:
    from kiks.trials.tables import gradescope_results

    return {
        "title": graded.title,
        "folder": str(out),
        "faults": graded.faults,
        "cases": [case.name for case in graded.cases],
        "submissions": [
            {"name": each.submission.name, "id": each.submission.id, "problem": each.problem or None}
            | gradescope_results(graded, each)
            | {"grade": each.mark, "days_late": each.days_late}
            | ({"score": None} if each.problem else {})
            for each in graded.grades
        ],
        "alike": [vars(pair) for pair in graded.likenesses],
    }
