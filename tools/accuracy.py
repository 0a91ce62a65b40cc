"""Compare proximity sensors with a real Khepera's: KiKS's models and those of other simulators, on measured samples.

python tools/accuracy.py --page docs/explanation/accuracy.md
python tools/accuracy.py --networks networks.json
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from kiks.cli.engine_start import ready_engine
from kiks.cli.options import written_folder
from kiks.model.atomic_files import check_writable, replace_file

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tools.sensors.card import Card

    from kiks.fit.samples import Samples


def written_file(param: typer.CallbackParam, value: Path | None) -> Path | None:
    """Check the file of an option before the work whose result goes there.

    Raises:
        ParameterError: If it could not be written.
    """
    if value is not None:
        check_writable(value, param.opts[0])
    return value


def accuracy(
    data: Annotated[
        Path | None,
        typer.Option(help="Folder of the measured samples; beside the repository or in KIKS_SHARED if left out."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line: name, value, unit.")] = False,
    plots: Annotated[
        Path | None, typer.Option(help="Folder for pictures (needs Matplotlib).", callback=written_folder)
    ] = None,
    page: Annotated[
        Path | None, typer.Option(help="Write the page here: docs/explanation/accuracy.md.", callback=written_file)
    ] = None,
    networks: Annotated[
        Path | None, typer.Option(help="Train the thesis's networks and write them here.", callback=written_file)
    ] = None,
    starts: Annotated[int, typer.Option(help="Random starts per sensor in training; the best is kept.", min=1)] = 12,
    seed: Annotated[int, typer.Option(help="Seed of the training.", min=0)] = 0,
) -> None:
    """Print the accuracy card, or train the thesis's networks on the even angles."""
    # Before NumPy is imported: the matrices are small, and threads of its linear algebra would wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    ready_engine()
    from tools.sensors import card as cards

    tables = cards.load_tables(cards.data_folder(data))
    if networks is not None:
        _train(tables, networks, starts, seed)
        return
    card = cards.make_card(tables)
    if as_json:
        for figure in card.figures():
            typer.echo(json.dumps(vars(figure)))
    else:
        _show(card)
    if page is not None:
        replace_file(page, cards.page(card), "--page")
    if plots is not None:
        from tools.sensors.plots import plot_card

        for file in plot_card(card, plots):
            typer.echo(f"Picture: {file}", err=as_json)


def _train(tables: Mapping[str, Samples], file: Path, starts: int, seed: int) -> None:
    """Train networks at the poses that are found for the rig, and write those of the thesis's size."""
    from rich.console import Console
    from rich.table import Table
    from tools.sensors import train_networks

    from kiks.fit.robot_fit import find_rigs
    from kiks.model.robot import RobotSpec

    halves = [[table.at_angles(slice(first, None, 2)) for table in tables.values()] for first in (0, 1)]
    rigs = find_rigs(halves[0], RobotSpec.load("khepera"))
    learn, test = ([rig.moved(table) for rig, table in zip(rigs, half, strict=True)] for half in halves)
    console = Console()
    result = Table("network", "maximum", "mean", "median", title="Absolute errors in counts (held-out half)")
    for size, layers in train_networks.SIZES.items():
        trained = train_networks.train_sensors(learn, layers, seed=seed, starts=starts, progress=console.print)
        result.add_row(size, *(f"{e:.1f}" for e in train_networks.errors(*train_networks.predictions(test, trained))))
    console.print(result)
    train_networks.response_of(trained).save(file)


def _show(card: Card) -> None:
    """Print the card as two tables."""
    import numpy as np
    from rich.console import Console
    from rich.table import Table
    from tools.sensors.card import FOUND, TOLD
    from tools.sensors.models import MODELS

    console = Console()
    errors = Table(title="Absolute errors in counts (held-out half)")
    errors_told = Table(title="The same at the poses of the tables, errors of the rig and all")
    parts = Table(title="By object: median / mean in counts, largest error of a 50 % distance in mm")
    for table in (errors, errors_told, parts):
        table.add_column("model", no_wrap=True)
    for column in ("median", "mean", "95 %", "maximum"):
        errors.add_column(column, justify="right")
        errors_told.add_column(column, justify="right")
    for name in card.tables:
        parts.add_column(name, justify="right")
        parts.add_column("50 %", justify="right")
    for key, (title, _) in MODELS.items():
        for table, poses in ((errors, FOUND), (errors_told, TOLD)):
            table.add_row(title, *(f"{value:.1f}" for value in vars(card.score(key, poses=poses)).values()))
        entries = []
        for name in card.tables:
            score = card.score(key, [name])
            off_mm = np.abs(card.half_distances_mm(name, key) - card.half_distances_mm(name)).max()
            entries += [f"{score.median:.1f} / {score.mean:.1f}", f"{off_mm:.1f}"]
        parts.add_row(title, *entries)
    console.print(errors)
    console.print(errors_told)
    console.print(parts)


if __name__ == "__main__":
    typer.run(accuracy)
