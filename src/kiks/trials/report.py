"""Writes what is left of a grading: tables, results for platforms, and a report that needs no network.

All that students have written reaches the report through a template that escapes it.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from zipfile import ZIP_DEFLATED as DEFLATED

from kiks.errors import figure
from kiks.export.page import page_template
from kiks.model.atomic_files import make_folder, replace_file, writing
from kiks.trials import tables
from kiks.trials.grading import Graded
from kiks.trials.hand_in import DATE
from kiks.trials.report_parts import Run, page_parts, shown_runs
from kiks.trials.trial import Outcomes

REPORT = "report.html"
"""The report's name in the output folder."""

RESULTS = "results"
"""The folder of the results for Gradescope, a file for each submission."""

FEEDBACK = "feedback"
"""The folder of a page for each student, and the archive in which Moodle takes these pages."""

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
    """Write `grades.csv`, `moodle.csv`, `results/`, `feedback/` and `report.html` into the output folder.

    What an earlier grading has left there of submissions that are gone is removed.

    Args:
        graded: The grades.
        out: The folder, in which the recordings are.
        workers: Processes that prepare the players of the pages; one for each core if left out.
        on_progress: Called with how many players are ready, and of how many.
    """
    replace_file(out / "grades.csv", tables.grades_csv(graded), "grades")
    replace_file(out / "moodle.csv", tables.moodle_csv(graded), "grades")
    seen = {each.submission.id: graded.seen_by(each) for each in graded.grades}
    worst = [each.outcomes.worst for some in (graded, *seen.values()) for each in some.grades]
    recordings = {each.name: out / each.recording for each in worst if each is not None and each.recording}
    runs = shown_runs(recordings, workers, on_progress)
    for folder in (RESULTS, FEEDBACK):
        make_folder(out / folder, folder)
    with writing(out / f"{FEEDBACK}.zip", FEEDBACK) as beside, zipfile.ZipFile(beside.file, "w", DEFLATED) as archive:
        for each in graded.grades:
            name, own = each.submission.id, seen[each.submission.id]
            results = json.dumps(tables.gradescope_results(graded, each), indent=2) + "\n"
            replace_file(out / RESULTS / f"{name}.json", results, RESULTS)
            if len(graded.grades) == 1:
                # Where Gradescope itself runs the command, for one submission.
                replace_file(out / "results.json", results, RESULTS)
            said = tables.feedback_text(graded, each)
            page = _page("feedback.html", own, runs, out, grade=own.grades[0], said=said, is_for_student=True)
            replace_file(out / FEEDBACK / f"{name}.html", page, FEEDBACK)
            archive.writestr(zipfile.ZipInfo(tables.feedback_name(each.submission), DATE), page, DEFLATED)
    for path in (path for folder in (RESULTS, FEEDBACK, "runs") for path in (out / folder).glob("*")):
        if path.stem not in seen:
            shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink()
    low, high, spread = _spread(graded)
    report = _page(
        "grades.html",
        graded,
        runs,
        out,
        likenesses=tables.likeness_sentences(graded),
        overview=tables.overview(graded),
        ranked=tables.ranked(graded),
        low=low,
        high=high,
        spread=spread,
        is_for_student=False,
    )
    replace_file(out / REPORT, report, "the report")


def _page(template: str, graded: Graded, runs: dict[str, Run], out: Path, **values: object) -> bytes:
    """Return a page about grades, with the player of the worst case of each."""
    worst = {each.submission.id: each.outcomes.worst for each in graded.grades}
    own = {id: runs[each.name] for id, each in worst.items() if each is not None and each.name in runs}
    names = {
        outcome.name: case.name
        for each in graded.grades
        for case, outcome in zip(graded.cases, each.outcomes, strict=False)
    }
    page = page_template(template).render(
        graded=graded,
        figure=figure,
        cases_table=tables.cases_table,
        likeness=tables.likeness_text,
        names=names,
        **values,
        **page_parts(own, out),
    )
    return page.encode("utf-8", "replace")


def _spread(graded: Graded) -> tuple[float, float, _Spread]:
    """Return the fewest and most points, and for all cases and each: name, bars and a note."""
    tried = [each.outcomes for each in graded.grades if not each.problem]
    rows = [("All cases", [each.points for each in tried], sum(each.solved for each in tried))]
    for number, case in enumerate(graded.cases):
        outcomes = Outcomes(each[number] for each in tried)
        rows.append((case.name, [each.points for each in outcomes], outcomes.solved))
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
