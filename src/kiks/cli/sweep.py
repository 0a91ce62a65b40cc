"""`kiks sweep`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.compare import FIGURES
from kiks.cli.job import job_of
from kiks.cli.options import WorldOptions, run_and_show, say
from kiks.cli.outputs import has_results, is_quiet, output, shows_progress, tell_results
from kiks.errors import ParameterError, counted, shown
from kiks.model.ranges import numbers_of
from kiks.table import Table

if TYPE_CHECKING:
    from kiks.cli.job import Job
    from kiks.model.project import Project
    from kiks.trials.sweep import Row

FAMILY_MAX, SEEDS_MAX = 1000, 1000


Program = Annotated[
    str,
    typer.Argument(help="What kiks run takes: a program, a project (.kiks), a demonstration, or a champion's file."),
]

Arguments = Annotated[
    list[str] | None,
    typer.Argument(help="The program's arguments, those with a - after --; or programs for a project's robots."),
]

ThinkingTimes = Annotated[
    str | None, typer.Option(metavar="MS", help="Thinking times [ms]: numbers, and ranges such as 0..40 or 0..40:5.")
]

Latencies = Annotated[
    str | None,
    typer.Option(metavar="MS", help="Least delays of the link, each way [ms], in place of thinking times: 0..200:20."),
]

BaudRates = Annotated[
    str | None,
    typer.Option(metavar="BAUD", help="Speeds of the line, such as 9600,19200, whatever the program sets."),
]

FamilySize = Annotated[
    int,
    typer.Option(help="Robots of the family of imperfect ones; 0 for the exact robot alone.", min=0, max=FAMILY_MAX),
]

SeedCount = Annotated[int, typer.Option(help="Seeds, from --seed on.", min=1, max=SEEDS_MAX)]

SolvedFormula = Annotated[
    str | None, typer.Option(metavar="FORMULA", help="When a run is solved, in place of the project's goal.")
]

FailedFormula = Annotated[str | None, typer.Option(metavar="FORMULA", help="When a run has failed.")]

PointsFormula = Annotated[str | None, typer.Option(metavar="FORMULA", help="The points of a run.")]

TimeLimit = Annotated[
    float | None, typer.Option(help="Time limit of a run [s of simulated time]; the project's, else 60.", min=0.1)
]

NeededShare = Annotated[
    float, typer.Option(help="Share of the runs that must be solved where the program holds.", min=0.01, max=1.0)
]

OutFolder = Annotated[
    Path | None,
    typer.Option(help="Folder of recordings, outcomes and picture; kiks-sweep-PROGRAM if left out."),
]

PictureFile = Annotated[
    Path | None,
    typer.Option(
        help=f"File of the picture, {', '.join(FIGURES)}; sweep.png in the folder if left out.",
        callback=output(*FIGURES),
    ),
]


@has_results
@shows_progress
def sweep(
    context: typer.Context,
    world: WorldOptions,
    program: Program,
    arguments: Arguments = None,
    think: ThinkingTimes = None,
    latency: Latencies = None,
    baud: BaudRates = None,
    family: FamilySize = 3,
    seeds: SeedCount = 3,
    solved: SolvedFormula = None,
    failed: FailedFormula = None,
    points: PointsFormula = None,
    seconds: TimeLimit = None,
    share: NeededShare = 1.0,
    out: OutFolder = None,
    picture: PictureFile = None,
) -> None:
    """Try a program with more and more thinking time, on several lines, robots and seeds: up to where does it hold?

    The program runs with each thinking time, at each baud rate, with each robot and each seed, on all cores. With
    --latency, the link is later and later, and the thinking time is one, 0 if left out. Each run
    is judged by the project's goal, or by --solved. Without either, a program must touch nothing and get about. After
    Ctrl-C or a kill, the same command goes on.

    Example: kiks sweep wander.py --baud 9600,19200 --think 0..40:2 --family 10 --seeds 20
    """
    from kiks.model.atomic_files import alone_in
    from kiks.model.exercise import Cases
    from kiks.trials.runner import OUTCOMES
    from kiks.trials.sweep import Sweep, Tried, sweep_trials
    from kiks.trials.sweep_plot import save_sweep_plot

    job = job_of(program, arguments or [], world)
    thinking = numbers_of(think or ("0..40" if latency is None else "0"), "--think")
    latencies = () if latency is None else numbers_of(latency, "--latency")
    if latency is not None and len(thinking) > 1:
        raise ParameterError(f"--think must be one number with --latency, but it was {shown(think)}. Vary one of them.")
    cases = Cases(
        thinking=tuple(f"fixed:{each:g}" for each in thinking),
        link=tuple(f"{job.project.link},latency_ms={each:g}" for each in latencies),
        baud=() if baud is None else tuple(map(int, numbers_of(baud, "--baud"))),
        family=tuple(range(1, family + 1)) or (0,),
        seed=tuple(range(job.project.seed, job.project.seed + seeds)),
    )
    project = replace(_project(job, {"solved": solved, "failed": failed, "points": points}, seconds), cases=(cases,))
    trials = sweep_trials(project, job.home, job.commands)
    folder = out or Path(f"kiks-sweep-{Path(program).stem}")
    context.with_resource(alone_in(folder, "--out", OUTCOMES))
    goal, name = project.goal, Path(program).name
    assert goal is not None
    if not is_quiet():
        say(f"{counted(len(trials), 'run')} of {project.seconds:g} s at most. Goal: {goal.text or goal.solved}.")
    outcomes = run_and_show(trials, folder, "runs")
    found = Sweep(tuple(map(Tried, cases.each(), outcomes)), share)
    save_sweep_plot(found, file := picture or folder / "sweep.png", f"{name}: {goal.text or goal.solved}")
    heads = ("baud", f"{found.what} [ms]", "solved", "least points", "median", "most", "worst")
    typer.echo(Table(heads, map(_cells, found.rows), ends_in_text=True).for_output())
    see = f"see it with kiks replay {folder / found.worst.outcome.recording}"
    results: dict[str, Any] = {
        "program": program,
        "goal": {each: getattr(goal, each) for each in ("text", "solved", "failed", "points")},
        "share": share,
        "holds_up_to_ms": [{"baud": each, "ms": found.holds_up_to_ms(each)} for each in found.bauds],
        "rows": [row.to_dict() for row in found.rows],
        "verdict": found.verdict,
        "picture": str(file),
        "folder": str(folder),
    }
    tell_results(context, results, [f"Picture: {file}", f"{name} {found.verdict}; {see}"])


def _project(job: Job, formulas: dict[str, str | None], seconds: float | None) -> Project:
    """Return the world of a sweep, with a goal and a time limit."""
    from kiks.model.data_file import check
    from kiks.model.goal import Goal
    from kiks.trials.sweep import DEFAULT_GOAL, SECONDS

    goal, told = job.project.goal, {name: text for name, text in formulas.items() if text is not None}
    if told:
        goal = check(Goal, ({} if goal is None or "solved" in told else vars(goal) | {"text": ""}) | told, "the goal")
    return replace(job.project, goal=goal or DEFAULT_GOAL, seconds=seconds or job.project.seconds or SECONDS)


def _cells(row: Row) -> tuple[str, ...]:
    """Return the cells of a row of the table."""
    worst = row.tried[0]
    return (
        "own" if row.baud is None else str(row.baud),
        f"{row.place_ms:g}",
        f"{row.solved} of {len(row.tried)}",
        *(f"{value:.4g}" for value in (row.points[0], median(row.points), row.points[-1])),
        "" if worst.is_solved else str(worst),
    )
