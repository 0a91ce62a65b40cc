"""Writes what is left of a grading: tables, results for platforms, and a report that needs no network.

All that students have written reaches the report through a template that escapes it.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from kiks.errors import figure
from kiks.export.page import page_template
from kiks.model.atomic_files import make_folder, replace_file
from kiks.trials.grading import Graded
from kiks.trials.report_parts import Run, page_parts, shown_runs
from kiks.trials.tables import (
    COUNTED,
    grades_csv,
    gradescope_results,
    how_it_went,
    likeness_of,
    likenesses_of,
    moodle_csv,
    ranked,
)

REPORT = "report.html"
"""The report's name in the output folder."""

RESULTS = "results"
"""The folder of the results for Gradescope, a file for each submission."""

_STRIP = 390.0
"""Width of a strip of points in a figure of the report."""

_Spread = list[tuple[str, list[tuple[float, float]], str]]


def save_grades(
    graded: Graded,
    out: Path,
    *,
    workers: int | None = None,
    on_progress: Callable[[int, int], object] = lambda done, count: None,
) -> None:
    """Write `grades.csv`, `moodle.csv`, `results/` and `report.html` into the output folder.

    Args:
        graded: The grades.
        out: The folder, in which the recordings are.
        workers: Processes that prepare the players of the report; one for each core if left out.
        on_progress: Called with how many players are ready, and of how many.
    """
    replace_file(out / "grades.csv", grades_csv(graded), "grades")
    replace_file(out / "moodle.csv", moodle_csv(graded), "grades")
    make_folder(out / RESULTS, "results")
    for each in graded.grades:
        text = json.dumps(gradescope_results(graded, each), indent=2) + "\n"
        replace_file(out / RESULTS / f"{each.submission.id}.json", text, "results")
        if len(graded.grades) == 1:
            # Where Gradescope itself runs the command, for one submission.
            replace_file(out / "results.json", text, "results")
    recordings = {
        each.submission.id: out / each.worst.recording
        for each in graded.grades
        if each.worst is not None and each.worst.recording
    }
    runs = shown_runs(recordings, workers, on_progress)
    replace_file(out / REPORT, _report(graded, runs, out).encode("utf-8", "replace"), "the report")


def _report(graded: Graded, runs: dict[str, Run], out: Path) -> str:
    low, high, spread = _spread(graded)
    names = {
        outcome.name: case.name
        for each in graded.grades
        for case, outcome in zip(graded.cases, each.outcomes, strict=False)
    }
    return page_template("grades.html").render(
        graded=graded,
        figure=figure,
        how=how_it_went,
        likeness=likeness_of,
        likenesses=likenesses_of(graded),
        ranked=ranked(graded),
        counted=[how for how in COUNTED if any(each.count(how) for each in graded.grades)],
        low=low,
        high=high,
        spread=spread,
        names=names,
        **page_parts(runs, out),
    )


def _spread(graded: Graded) -> tuple[float, float, _Spread]:
    """Return the fewest and most points, and for all cases and each: name, bars and a note."""
    rows: list[tuple[str, Sequence[float], int]] = []
    tried = [each for each in graded.grades if each.outcomes]
    rows.append(("All cases", [each.points for each in tried], sum(each.solved for each in tried)))
    for number, case in enumerate(graded.cases):
        outcomes = [each.outcomes[number] for each in tried]
        rows.append((case.name, [each.points for each in outcomes], sum(each.is_solved for each in outcomes)))
    points = [value for _, values, _ in rows for value in values]
    low, high = min([0.0, *points]), max([1.0, *points])
    spread: _Spread = []
    for number, (name, values, solved) in enumerate(rows):
        places = Counter(round((value - low) / (high - low) * _STRIP, 1) for value in values)
        most = max(places.values(), default=1)
        count = len(tried) * (1 if number else len(graded.cases))
        bars = [(place + 2, round(0.3 + 0.7 * times / most, 3)) for place, times in sorted(places.items())]
        spread.append((name, bars, f"{solved} of {count} solved"))
    return low, high, spread
