"""`kiks fit`."""

from __future__ import annotations

import enum
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.accuracy import DataFolder, PlotFolder
from kiks.cli.options import written_file
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, shown

if TYPE_CHECKING:
    from kiks.fit.samples import Floats, Samples


class Places(enum.StrEnum):
    """Where the rays of the networks begin and look."""

    RIM = "rim"
    PROTOCOL = "protocol"


def fit(
    files: Annotated[
        list[str] | None,
        typer.Argument(help="Files of samples; =RADIUS in mm after that of a round object: post.sam=12.5."),
    ] = None,
    data: DataFolder = None,
    robot: Annotated[
        Path | None, typer.Option(help="Write the robot that was found here: mine.toml.", callback=written_file)
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the networks here: mine.json.", callback=written_file)] = None,
    plots: PlotFolder = None,
    starts: Annotated[int, typer.Option(help="Random starts for each sensor; the best is kept.", min=1)] = 12,
    seed: Annotated[int, typer.Option(help="Seed: the same seed, the same networks.", min=0)] = 0,
    places: Annotated[Places, typer.Option(help="Rays from the rim or from the protocol's mounts.")] = Places.RIM,
) -> None:
    """Fit the sensors to samples of a real robot: on every other angle, and test them on the rest.

    First come the default response and how the rig was off, then the thesis's networks, at the poses that were found.
    Without FILES the wall and the cylinder of the shared samples are taken.

    Example: kiks fit wall.sam round.sam=27 --robot mine.toml
    """
    # Before NumPy is imported: the matrices are small, and threads of its linear algebra would wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from rich.console import Console
    from rich.table import Table

    from kiks.cli.engine_start import ready_engine
    from kiks.fit import train_networks
    from kiks.fit.reflection import active_pairs, fit_reflection
    from kiks.model.robot import RobotSpec, save_robot

    ready_engine()
    tables = _tables(files, data)
    learn = [table.at_angles(slice(0, None, 2)) for table in tables]
    test = [table.at_angles(slice(1, None, 2)) for table in tables]
    console = Console()
    result = Table(title="Absolute errors in counts (test set)")
    for column in ("model", "maximum", "mean", "median"):
        result.add_column(column, justify="left" if column == "model" else "right")

    def enter(name: str, counts: Floats, expected: Floats) -> None:
        result.add_row(name, *(f"{error:.1f}" for error in train_networks.errors(counts, expected)))
        if plots is not None:
            from kiks.fit.plots import plot_errors

            plot_errors(
                f"{name}: test set", counts, expected, plots / f"fit-{'-'.join(name.replace('+', ' ').split())}.png"
            )

    end_as_with_ctrl_c()
    with console.status("default response") as status:
        found = fit_reflection(learn, RobotSpec.load("khepera"))
        learn = [rig.moved(table) for rig, table in zip(found.rigs, learn, strict=True)]
        test = [rig.moved(table) for rig, table in zip(found.rigs, test, strict=True)]
        enter("default", *active_pairs(found.spec, test))
        for size, layers in train_networks.SIZES.items():
            trained = train_networks.train_sensors(
                learn,
                layers,
                places=places.value,
                seed=seed,
                starts=starts,
                progress=lambda sensor, size=size: status.update(f"{size}, {sensor}"),  # type: ignore[misc]
            )
            enter(size, *train_networks.predictions(test, trained, places=places.value))
    console.print(result)
    if robot is not None:
        save_robot(found.spec, robot, comment="Proximity sensors fitted to samples by `kiks fit`.")
        typer.echo(f"Robot: {robot}")
    if out is not None:
        train_networks.response_of(trained, places=places.value).save(out)
        typer.echo(f"Networks: {out}")


def _tables(files: list[str] | None, data: Path | None) -> list[Samples]:
    """Return the samples of the files named on the command line, of the shared folder if there are none."""
    from kiks.fit.accuracy import data_folder, load_tables
    from kiks.fit.samples import load_samples

    if not files:
        return list(load_tables(data_folder(data)).values())
    return [load_samples(path, radius_mm=radius_mm) for path, radius_mm in map(parse_file, files)]


def parse_file(entry: str) -> tuple[str, float]:
    """Return the path and the radius [mm] of 'post.sam=12.5'; the radius of a wall is infinite.

    Raises:
        ParameterError: If what stands after = is no positive number.

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
