"""The pictures that the thesis shows of a network (section 3.3, figures 9 to 17), for any model. Needs Matplotlib."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kiks.errors import ParameterError, installing
from kiks.fit.samples import MAXIMUM_COUNTS, Floats, is_active
from kiks.model.atomic_files import make_folder, replace_file
from kiks.model.robot import SENSOR_COUNT

if TYPE_CHECKING:
    from tools.sensors.card import Card

_MEASURED, _PREDICTED, _ERROR = "black", "tab:blue", "tab:red"


def _figure(columns: int, rows: int) -> tuple[Any, Any]:
    """Return an empty figure and its axes, shape [rows, columns].

    Raises:
        ParameterError: If Matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ParameterError(
            f"Plots must be drawn by Matplotlib, but it is not installed. {installing('plot')}, or leave --plots out."
        ) from error
    figure = Figure(figsize=(4.8 * columns, 3.4 * rows), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def _save(figure: Any, file: Path) -> Path:
    make_folder(file.parent, "plots")
    pixels = BytesIO()
    figure.savefig(pixels, format="png", dpi=100)
    replace_file(file, pixels.getvalue(), "a plot")
    return file


def plot_errors(title: str, counts: Floats, expected: Floats, file: Path) -> Path:
    """Draw expected and predicted counts, sorted by what was measured, above a histogram of the errors.

    Args:
        title: What stands above.
        counts: Predicted, shape [samples].
        expected: Measured, shape [samples].
        file: Where the picture goes.

    Raises:
        ParameterError: If Matplotlib is missing or the file cannot be written.
    """
    figure, ((above,), (below,)) = _figure(1, 2)
    order = np.argsort(expected, kind="stable")
    place = np.arange(len(order))
    error = np.abs(counts - expected)[order]
    above.plot(place, counts[order], ".", color=_PREDICTED, markersize=2, label="predicted")
    above.plot(place, error, ".", color=_ERROR, markersize=2, label="absolute error")
    above.plot(place, expected[order], ":", color=_MEASURED, label="measured")
    above.set(title=title, xlabel="samples, sorted", ylabel="counts", ylim=(0, MAXIMUM_COUNTS))
    above.legend(loc="upper left", markerscale=4)
    below.hist(error, bins=np.arange(0, MAXIMUM_COUNTS + 20, 20), color=_ERROR)
    below.set(xlabel="absolute error [counts]", ylabel="samples", yscale="log")
    return _save(figure, file)


def plot_card(card: Card, folder: Path) -> list[Path]:
    """Draw the card: for each model the errors on the held-out half, and for each object a curve per sensor.

    Raises:
        ParameterError: If Matplotlib is missing or the folder cannot be written.
    """
    from tools.sensors.card import FOUND, HALVES, HELD_OUT, smoothed
    from tools.sensors.models import MODELS

    half = HALVES[HELD_OUT]
    measured = {name: table.counts[:, half] for name, table in card.tables.items()}
    active = {name: is_active(counts) for name, counts in measured.items()}
    expected = np.concatenate([measured[name][active[name]] for name in measured]).astype(np.float64)
    files = []
    for key, answers in card.answers[FOUND].items():
        counts = np.concatenate([answers[name][:, half][active[name]] for name in measured])
        files.append(plot_errors(f"{MODELS[key][0]}: held-out half", counts, expected, folder / f"errors-{key}.png"))
    for name, table in card.tables.items():
        figure, axes = _figure(4, 2)
        gap_mm = table.gap_mm + card.rigs[name].gap_mm
        curves = smoothed(table.counts.astype(np.float64))
        best = curves.sum(axis=0).argmax(axis=0)
        for sensor in range(SENSOR_COUNT):
            axis = axes[sensor // 4, sensor % 4]
            axis.plot(gap_mm, curves[:, best[sensor], sensor], "o", color=_MEASURED, label="measured")
            for key, answers in card.answers[FOUND].items():
                if key != "floor":
                    axis.plot(gap_mm, smoothed(answers[name])[:, best[sensor], sensor], label=MODELS[key][0])
            direction = f"{table.angle_deg[0, best[sensor]]:.0f} degrees clockwise"
            axis.set(title=f"sensor {sensor}, {direction}", xlabel="gap [mm]", ylabel="counts")
        axes[0, 0].legend(fontsize="small")
        figure.suptitle(f"{name}: readings at the sensor's best angle")
        files.append(_save(figure, folder / f"curves-{name}.png"))
    return files
