"""`kiks fit`."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Annotated

import typer

from kiks.cli.outputs import has_results, output, tell_results
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, shown
from kiks.model.robot_kinds import ROBOT_NAMES


@has_results
def fit(
    context: typer.Context,
    files: Annotated[
        list[str],
        typer.Argument(help="Files of samples; =RADIUS in mm after that of a round object: post.sam=12.5."),
    ],
    base: Annotated[
        str, typer.Option(help=f"Its kind, for all that is not fitted: {', '.join(ROBOT_NAMES)}, a file.")
    ] = "khepera",
    robot: Annotated[
        Path | None, typer.Option(help="Write the fitted robot here: mine.toml.", callback=output(".toml"))
    ] = None,
) -> None:
    """Fit the proximity sensors to samples of a real robot.

    They are fitted on every other angle, and tested on the rest. The fit also estimates how far the rig was off.

    Example: kiks fit wall.sam round.sam=27 --robot mine.toml
    """
    # Before NumPy is imported: the matrices are small, and threads of its linear algebra would wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    import numpy as np
    from rich.console import Console

    from kiks.cli.engine_start import ready_engine
    from kiks.fit.robot_fit import active_pairs, fit_robot
    from kiks.fit.samples import load_samples
    from kiks.model.robot import RobotSpec, save_robot

    kind = RobotSpec.load(base)
    largest = kind.proximity.maximum_counts
    tables = [
        load_samples(path, radius_mm=radius_mm, maximum_counts=largest) for path, radius_mm in map(parse_file, files)
    ]
    ready_engine()
    end_as_with_ctrl_c()
    with Console().status("fitting"):
        found = fit_robot([table.at_angles(slice(0, None, 2)) for table in tables], kind)
    test = [rig.moved(table.at_angles(slice(1, None, 2))) for rig, table in zip(found.rigs, tables, strict=True)]
    answers, readings = active_pairs(found.spec, test)
    results: dict[str, float | None] = dict.fromkeys(("median_counts", "mean_counts", "maximum_counts"))
    if len(answers):
        error = np.abs(answers - readings)
        median, mean, most = (float(each(error)) for each in (np.median, np.mean, np.max))
        results = {"median_counts": median, "mean_counts": mean, "maximum_counts": most}
        typer.echo(
            f"Absolute errors on the other angles: median {median:.1f}, mean {mean:.1f}, maximum {most:.1f} counts."
        )
    if robot is not None:
        save_robot(found.spec, robot, comment="Proximity sensors fitted to samples by `kiks fit`.")
        typer.echo(f"Robot: {robot}")
    tell_results(context, results)


def parse_file(entry: str) -> tuple[str, float]:
    """Return the path and the radius [mm] of 'post.sam=12.5'; the radius of a wall is infinite.

    Example:
        >>> parse_file("post.sam=12.5")
        ('post.sam', 12.5)
    """
    path, equals, radius = entry.partition("=")
    if not equals:
        return entry, math.inf
    try:
        radius_mm = float(radius)
    except ValueError:
        radius_mm = math.nan
    if not radius_mm > 0:
        raise ParameterError(
            f"The radius after a file's name must be a positive number of mm, but it was {shown(entry)}. "
            "Example: round.sam=27; a wall's file has none."
        )
    return path, radius_mm
