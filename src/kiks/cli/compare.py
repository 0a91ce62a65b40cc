"""`kiks compare`, and the table of `kiks evolve --seeds`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.outputs import has_results, output, tell_results
from kiks.errors import ParameterError, counted
from kiks.export.kinds import KINDS
from kiks.table import Table

FIGURES = KINDS["figures"].endings

if TYPE_CHECKING:
    from kiks.learn.results import Result
    from kiks.learn.statistics import Comparison


@has_results
def compare(
    context: typer.Context,
    folders: Annotated[
        list[Path],
        typer.Argument(help="Two folders of kiks evolve or more, best with --seeds, with evolutions of one task."),
    ],
    picture: Annotated[
        Path, typer.Option(help=f"File of the picture, {', '.join(FIGURES)}.", callback=output(*FIGURES))
    ] = Path("kiks-compare.png"),
    task: Annotated[
        str | None, typer.Option(help="Of co-evolutions: the file of the task, if it is a Python file or was moved.")
    ] = None,
) -> None:
    """Compare the evolutions in two or more folders.

    It prints medians, exams and tests, each with its method: fitness, the share of the exam's starts that were solved,
    and how many evaluations it took to solve the task. Of more than two folders, the p of pairs are corrected.
    Champions of co-evolutions meet those of all others first.

    Example: kiks compare runs/linear runs/mlp runs/gru --picture compare.pdf
    """
    from kiks.learn import statistics
    from kiks.learn.plots import figure_of_results, save_plot
    from kiks.learn.results import comparable, load_results, solved_of, summary_of

    if len({each.resolve() for each in folders}) < max(len(folders), 2):
        given = ", ".join(map(str, folders))
        raise ParameterError(f"FOLDERS must be two or more, all different, but they were {given}.")
    groups = comparable({str(folder): load_results(folder) for folder in folders})
    tested: dict[str, Comparison] = {}
    samples: dict[str, dict[str, list[float]]] = {}
    if groups[str(folders[0])][0].against is not None:
        samples = _meetings(folders, task)
        tested |= {side: statistics.compare(sample) for side, sample in samples.items()}
    else:
        tested["fitness"] = statistics.compare({name: [each.fitness for each in of] for name, of in groups.items()})
    print_results(groups)
    solved = {name: found for name, of in groups.items() if (found := solved_of(of)) is not None}
    if len(solved) == len(groups):
        shares = {name: [each.exam.share for each in of if each.exam is not None] for name, of in groups.items()}
        tested |= {"exam": statistics.compare(shares), "solved": statistics.compare_solved(solved)}
    for name, comparison in tested.items():
        _print_comparison(name, comparison)
    save_plot(figure_of_results(groups, tested, samples), picture)
    typer.echo(f"Picture: {picture}")
    results: dict[str, Any] = {"folders": {name: summary_of(group) for name, group in groups.items()}}
    if samples:
        results["meetings"] = samples
    tell_results(context, results | {"differences": {name: _plain(each) for name, each in tested.items()}})


def _meetings(folders: Sequence[Path], task: str | None) -> dict[str, dict[str, list[float]]]:
    """Let the champions of co-evolutions meet those of all others, and return their mean fitness."""
    from kiks.cli.engine_start import ready_batch
    from kiks.learn import tasks
    from kiks.learn.cross_tournament import MEETINGS, hold_cross_tournament
    from kiks.learn.results import evolutions_in

    given = None if task is None else tasks.load(task)
    homes = {str(folder): evolutions_in(folder) for folder in folders}
    ready_batch()
    count = sum(map(len, homes.values()))
    typer.echo(
        f"Compared: each champion against those of the other {counted(count - 1, 'evolution')}, {MEETINGS} times each."
    )
    return hold_cross_tournament(homes, given)


def _print_comparison(name: str, comparison: Comparison) -> None:
    """Print what tests say about groups: what is compared, with which test, and each pair."""
    from kiks.learn.results import title_of
    from kiks.learn.statistics import CONFIDENCE

    correction = f", p corrected for {counted(len(comparison.pairs), 'pair')} by {comparison.correction}'s method"
    typer.echo(f"{title_of(name)}{correction if comparison.correction else ''}:")
    if (omnibus := comparison.omnibus) is not None:
        typer.echo(f"  all {omnibus.method}: H = {omnibus.statistic:.3g}, p = {omnibus.p:.3g}")
    for pair in comparison.pairs:
        line = f"  {pair.first} - {pair.second}   {pair.test.method}: p = {pair.p:.3g}"
        if pair.a is not None and pair.a_interval is not None:
            low, high = pair.a_interval
            line += f", A = {pair.a:.2f} ({low:.2f} to {high:.2f} at {CONFIDENCE:.0%}, {pair.effect})"
        typer.echo(line)


def _plain(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison for scripts."""
    plain = asdict(comparison)
    for pair, known in zip(comparison.pairs, plain["pairs"], strict=True):
        known |= {"effect": pair.effect}
    return plain


def print_results(groups: Mapping[str, Sequence[Result]]) -> None:
    """Print a table of each side, with intervals: a row for each group, or of a single one for each evolution."""
    from kiks.learn.results import of_sides

    for side, named in of_sides(groups).items():
        if side:
            typer.echo(f"{side}, against all champions of the other side of its own evolution:")
        table = _groups_table(named) if len(named) > 1 else _seeds_table(*named.values())
        typer.echo(table.for_output())
        for name, group in named.items():
            _print_intervals(name, group)


def _seeds_table(results: Sequence[Result]) -> Table:
    """Return evolutions that differ in their seed; the last row holds medians, and how many passed."""
    rows: list[tuple[object, ...]] = []
    for each in results:
        exam = ("-", "-")
        if (score := each.exam) is not None:
            exam = f"{score.solved} of {score.starts}", f"{score.imperfect_solved} of {score.imperfect_starts}"
        count, seconds = each.evaluation_count, f"{each.seconds:.0f}"
        rows.append((each.seed, f"{each.fitness:.4f}", each.generation, *exam, count, seconds))
    _, middle, _, passed, *costs = _figures(results)
    rows.append(("all", middle, "", passed, "", *costs))
    return Table(("seed", "fitness", "found in", "exam", "imperfect", "evaluations", "seconds"), rows)


def _groups_table(groups: Mapping[str, Sequence[Result]]) -> Table:
    """Return groups of evolutions: quartiles and medians, and how many champions passed the exam."""
    heads = ("folder", "runs", "quartile", "median", "quartile", "exams", "evaluations", "seconds")
    return Table(heads, ((name, len(group), *_figures(group)) for name, group in groups.items()))


def _print_intervals(name: str, results: Sequence[Result]) -> None:
    """Print the intervals of the median and of the share of exams, with their methods, if there are several results."""
    from kiks.learn.results import passed_count
    from kiks.learn.statistics import median_interval, wilson_interval

    interval = median_interval([each.fitness for each in results])
    if interval is None:
        return
    line = f"{name}: at 95 %, median {interval.low:.4f} to {interval.high:.4f} (bootstrap)"
    if (passed := passed_count(results)) is not None:
        low, high = wilson_interval(passed, len(results))
        line += f", exams passed {100 * low:.0f} to {100 * high:.0f} % (Wilson)"
    typer.echo(line)


def _figures(results: Sequence[Result]) -> tuple[str, ...]:
    """Return quartiles and median of fitness, solved exams, and medians of evaluations and of seconds, as text."""
    from statistics import median

    from kiks.learn.results import passed_count, quartiles

    passed = passed_count(results)
    return (
        *(f"{value:.4f}" for value in quartiles(results)),
        "-" if passed is None else f"{passed} of {len(results)}",
        f"{median(each.evaluation_count for each in results):.0f}",
        f"{median(each.seconds for each in results):.0f}",
    )
