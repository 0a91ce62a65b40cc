"""`kiks accuracy`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.options import written_file, written_folder
from kiks.model.atomic_files import replace_file

if TYPE_CHECKING:
    from kiks.fit.accuracy import Card

DataFolder = Annotated[
    Path | None,
    typer.Option("--data", help="Folder of the measured samples; beside the repository or in KIKS_SHARED if left out."),
]
PlotFolder = Annotated[
    Path | None, typer.Option("--plots", help="Folder for pictures (needs Matplotlib).", callback=written_folder)
]


def accuracy(
    data: DataFolder = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object a line: name, value, unit.")] = False,
    plots: PlotFolder = None,
    page: Annotated[
        Path | None, typer.Option(help="Write the card as Markdown here: docs/accuracy.md.", callback=written_file)
    ] = None,
) -> None:
    """Compare the sensors with a real Khepera's: KiKS's models, and those of other simulators, on measured samples.

    Example: kiks accuracy --plots card
    """
    ready_engine()
    from kiks.fit import accuracy as cards

    card = cards.make_card(cards.load_tables(cards.data_folder(data)))
    if as_json:
        for figure in card.figures():
            typer.echo(json.dumps(vars(figure)))
    else:
        _show(card)
    if page is not None:
        replace_file(page, cards.page(card), "--page")
    if plots is not None:
        from kiks.fit.plots import plot_card

        for file in plot_card(card, plots):
            typer.echo(f"Picture: {file}", err=as_json)


def _show(card: Card) -> None:
    """Print the card as two tables."""
    import numpy as np
    from rich.console import Console
    from rich.table import Table

    from kiks.fit.accuracy import FOUND, TOLD
    from kiks.fit.models import MODELS

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
