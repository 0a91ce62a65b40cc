"""Grades as tables: a CSV for spreadsheets, one that Moodle takes, and results as Gradescope reads them."""

from __future__ import annotations

import re
from typing import Any

from kiks.errors import counted, figure
from kiks.table import Table
from kiks.trials.grading import Grade, Graded
from kiks.trials.marking import AS_POINTS
from kiks.trials.submissions import Submission
from kiks.trials.trial import End, Outcome

COUNTED = (End.CRASHED, End.ENDLESS, End.OUT_OF_TIME, End.STOPPED)
"""How programs end that the tables count."""

LIKENESSES_MAX = 20
"""Most sentences about programs that are alike."""


def how_it_went(outcome: Outcome) -> str:
    """Return in a few words how a case went."""
    how = outcome.end_of().how
    return str(outcome.judgement) if outcome.is_solved or how == End.RUNNING else f"{how} after {outcome.time_s:.1f} s"


def likeness_text(grade: Grade) -> str:
    """Return which others a submission is like."""
    return ", ".join(f"{name} ({'identical' if share == 1 else f'{share:.0%}'})" for name, share in grade.like)


def likeness_sentences(graded: Graded) -> list[str]:
    r"""Return a sentence for each group of identical programs and each pair of nearly identical ones, at most 20.

    Of a group that is like another program, only the first one is named.

    Example:
        >>> from kiks.trials.similarity import Likeness
        >>> same = [Likeness(*pair, 1.0) for pair in (("ann", "bob"), ("ann", "eve"), ("bob", "eve"))]
        >>> others = [Likeness("ann", "joe", 0.9), Likeness("bob", "joe", 0.9)]
        >>> print(*likeness_sentences(Graded("", "", 1.0, (), (), (*same, *others))), sep="\n")
        ann, bob and eve are identical, but for names, comments, layout, numbers and texts.
        ann and joe are 90% alike.
    """
    groups: dict[str, list[str]] = {}
    first_of: dict[str, str] = {}
    for pair in graded.likenesses:
        if pair.share == 1:
            first = first_of.setdefault(pair.first, pair.first)
            if pair.second not in first_of:
                first_of[pair.second] = first
                groups.setdefault(first, [first]).append(pair.second)
    lines = [
        f"{', '.join(names[:-1])} and {names[-1]} are identical, but for names, comments, layout, numbers and texts."
        for names in groups.values()
    ] + [
        f"{pair.first} and {pair.second} are {pair.share:.0%} alike."
        for pair in graded.likenesses
        if pair.share < 1 and all(first_of.get(name, name) == name for name in (pair.first, pair.second))
    ]
    if len(lines) > LIKENESSES_MAX:
        more = len(lines) - LIKENESSES_MAX
        lines[LIKENESSES_MAX:] = [f"So are {counted(more, 'pair')} more: see the column like of grades.csv."]
    return lines


def grade_values(graded: Graded, grade: Grade) -> dict[str, object]:
    """Return what is said of a submission by the names of the columns of `grades.csv`, without the points in cases."""
    outcomes = grade.outcomes
    numbers: dict[str, object] = {"points": outcomes.points, "solved": outcomes.solved, "cases": len(graded.cases)}
    numbers |= {how: outcomes.count(how) for how in COUNTED} | {"time_s": outcomes.time_s}
    if grade.problem:
        numbers = dict.fromkeys(numbers)  # what was not graded is no zero
    return {
        "name": grade.submission.name,
        "grade": grade.mark,
        "days_late": grade.days_late,
        **numbers,
        "like": likeness_text(grade),
        "said_last": grade.problem or outcomes.last_words,
    }


def grades_csv(graded: Graded) -> str:
    """Return a row for each submission, with the points in each case."""
    values = [grade_values(graded, grade) for grade in graded.grades]
    rows = [
        [*said.values(), *([None] * len(graded.cases) if grade.problem else [each.points for each in grade.outcomes])]
        for said, grade in zip(values, graded.grades, strict=True)
    ]
    return Table([*values[0], *(case.name for case in graded.cases)], rows).csv()


def overview(graded: Graded) -> Table:
    """Return what a terminal and the report show of each submission, the best first."""
    rows = []
    for grade in ranked(graded):
        said = grade_values(graded, grade)
        numbers: tuple[object, ...] = ("", said["days_late"] or "", "", "")
        if grade.mark is not None:
            mark = "" if graded.marking == AS_POINTS else figure(grade.mark)
            solved = f"{grade.outcomes.solved}/{len(graded.cases)}"
            numbers = (mark, said["days_late"] or "", figure(grade.outcomes.points), solved)
        rows.append((said["name"], *numbers, *(said[how] or "" for how in COUNTED), said["said_last"]))
    return Table(("name", "grade", "days late", "points", "solved", *COUNTED, "said last"), rows, ends_in_text=True)


def cases_table(graded: Graded, grade: Grade) -> Table:
    """Return what the report shows of a submission: each case."""
    rows = [
        (
            f"{case.name}{' (hidden)' * case.is_hidden}",
            figure(outcome.points),
            how_it_went(outcome) + (f" (may differ next time: {outcome.doubt})" if outcome.doubt else ""),
            outcome.end_of().last_words,
        )
        for case, outcome in zip(graded.cases, grade.outcomes, strict=False)
    ]
    return Table(("case", "points", "how it went", "said last"), rows, ends_in_text=True)


def moodle_csv(graded: Graded) -> str:
    """Return the grades as Moodle's grading worksheet has them, which also its import of grades reads.

    Moodle finds a student by the number that its exports have, and leaves a grade alone that is empty here. Students
    read the feedback, so it says nothing of hidden cases.
    """
    head = ("Identifier", "Full name", "Email address", "Grade", "Last modified (grade)", "Feedback comments")
    rows = []
    for grade in graded.grades:
        who = grade.submission
        participant = f"Participant {who.participant}" if who.participant else ""
        rows.append((participant, who.name, who.email, grade.mark, who.last_graded, feedback_text(graded, grade)))
    return Table(head, rows).csv()


def feedback_text(graded: Graded, grade: Grade) -> str:
    """Return what a student is told in a line."""
    if grade.problem:
        return f"Not graded: {grade.problem}."
    seen = graded.seen_by(grade)
    (shown,) = seen.grades
    hidden = len(graded.cases) - len(seen.cases)
    beside = f", beside {counted(hidden, 'hidden case')}" if hidden else ""
    late = f"{counted(grade.days_late, 'day')} late" if grade.days_late else ""
    solved = f"{shown.outcomes.solved} of {len(seen.cases)} cases solved{beside}"
    return ". ".join(filter(None, (solved, late, shown.outcomes.last_words.rstrip(".")))) + "."


def feedback_name(who: Submission) -> str:
    """Return how a page of feedback is called in the archive that Moodle takes, which names files as it exports them.

    Example:
        >>> feedback_name(Submission("Ann Lee", "1201", id="Ann-Lee"))
        'Ann Lee_1201_assignsubmission_file_feedback.html'
    """
    plain = re.sub(r"[_/\\]", " ", who.name)
    return f"{plain}_{who.participant}_assignsubmission_file_feedback.html" if who.participant else f"{who.id}.html"


def gradescope_results(graded: Graded, grade: Grade) -> dict[str, Any]:
    """Return the results of a submission as Gradescope's autograder reads them, with its leaderboard.

    A case counts the mean's share of its points, so their sum is the submission's. Of an exercise with hidden cases it
    tells what a program said only if a sandbox kept the program from seeing them, in the exercise or in another run.
    """
    count = len(graded.cases)
    is_quiet = graded.is_trusted and any(case.is_hidden for case in graded.cases)
    tests = []
    for case, outcome in zip(graded.cases, grade.outcomes, strict=False):
        end = outcome.end_of()
        lines = [how_it_went(outcome)]
        if is_quiet:
            lines.append("What the program printed is not shown, as the exercise has hidden cases.")
        else:
            lines += [*([end.detail] if end.detail else []), *end.printed]
        tests.append(
            {
                "name": case.name,
                "score": round(outcome.points / count, 6),
                "status": "passed" if outcome.is_solved else "failed",
                "output": "\n".join(lines),
                "output_format": "text",
                "visibility": "hidden" if case.is_hidden else "visible",
            }
        )
    return {
        "score": grade.outcomes.points,
        "output": grade.problem or f"{grade.outcomes.solved} of {count} cases solved.",
        "output_format": "text",
        "tests": tests,
        "leaderboard": [
            {"name": "Points", "value": grade.outcomes.points},
            {"name": "Solved", "value": grade.outcomes.solved},
            {"name": "Time [s]", "value": grade.outcomes.time_s, "order": "asc"},
        ],
    }


def ranked(graded: Graded) -> list[Grade]:
    """Return the grades, the best first; of equal ones, the one that took less time; last what was not graded."""
    return sorted(
        graded.grades,
        key=lambda each: (
            each.mark is None,
            -(each.mark or 0.0),
            -each.outcomes.solved,
            each.outcomes.time_s,
            each.submission.name,
        ),
    )
