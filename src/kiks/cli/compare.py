"""`kiks compare`, and the table of `kiks evolve --seeds`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.options import print_table
from kiks.cli.outputs import has_results, output, tell_results
from kiks.errors import ParameterError
from kiks.export.kinds import KINDS

FIGURES = KINDS["figures"].endings

if TYPE_CHECKING:
    from kiks.learn.results import Result


@has_results
def compare(
    context: typer.Context,
    first: Annotated[Path, typer.Argument(help="A folder of kiks evolve, best with --seeds.")],
    second: Annotated[Path, typer.Argument(help="Another folder, with evolutions of the same task.")],
    picture: Annotated[
        Path, typer.Option(help=f"File of the picture, {', '.join(FIGURES)}.", callback=output(*FIGURES))
    ] = Path("kiks-compare.png"),
) -> None:
    """Compare the evolutions in two folders.

    It prints medians, exams, and the Mann-Whitney test with its effect size.

    Example: kiks compare runs/linear runs/gru
    """
    from kiks.learn.plots import save_results_plot
    from kiks.learn.results import comparable, difference, load_results, summary_of

    if first.resolve() == second.resolve():
        raise ParameterError(f"SECOND must be another folder than FIRST, but both are {str(first)!r}.")
    one, two = comparable(load_results(first), load_results(second))
    groups = {str(first): one, str(second): two}
    print_groups(groups)
    samples = {"Fitness": [[each.fitness for each in group] for group in (one, two)]}
    if all(each.exam is not None for each in (*one, *two)):
        samples["Exam"] = [[each.exam.share for each in group if each.exam is not None] for group in (one, two)]
    differences = {}
    for name, sample in samples.items():
        found = difference(*sample)
        differences[name.lower()] = asdict(found) | {"effect": found.effect}
        typer.echo(
            f"{name}: U = {found.u:g}, p = {found.p:.3g}, A = {found.a:.2f} ({found.effect}): the share of pairs in "
            f"which {first} is better"
        )
    save_results_plot(groups, picture)
    typer.echo(f"Picture: {picture}")
    summaries = {folder: summary_of(group) for folder, group in groups.items()}
    tell_results(context, {"folders": summaries, "differences": differences})


def print_seeds(results: Sequence[Result]) -> None:
    """Print a table of evolutions that differ in their seed; the last row holds medians, and how many passed."""
    rows: list[tuple[str, ...]] = [
        (
            str(each.seed),
            f"{each.fitness:.4f}",
            str(each.generation),
            *_exam_texts(each),
            str(each.evaluations[-1]),
            f"{each.seconds:.0f}",
        )
        for each in results
    ]
    _, middle, _, passed, *costs = _figures(results)
    rows.append(("all", middle, "", passed, "", *costs))
    print_table(("seed", "fitness", "found in", "exam", "imperfect", "evaluations", "seconds"), rows)


def print_groups(groups: Mapping[str, Sequence[Result]]) -> None:
    """Print a table of groups of evolutions: quartiles and medians, and how many champions passed the exam."""
    columns = ("folder", "runs", "quartile", "median", "quartile", "exams", "evaluations", "seconds")
    print_table(columns, [(name, str(len(group)), *_figures(group)) for name, group in groups.items()])


def _figures(results: Sequence[Result]) -> tuple[str, ...]:
    """Return quartiles and median of fitness, solved exams, and medians of evaluations and of seconds, as text."""
    from statistics import median

    from kiks.learn.results import passed_count, quartiles

    passed = passed_count(results)
    return (
        *(f"{value:.4f}" for value in quartiles(results)),
        "-" if passed is None else f"{passed} of {len(results)}",
        f"{median(each.evaluations[-1] for each in results):.0f}",
        f"{median(each.seconds for each in results):.0f}",
    )


def _exam_texts(result: Result) -> tuple[str, str]:
    if result.exam is None:
        return "-", "-"
    exam = result.exam
    return f"{exam.solved} of {exam.starts}", f"{exam.imperfect_solved} of {exam.imperfect_starts}"
