"""What notebooks show of objects; `upwards.shown_in_notebooks` gives each class one of these functions."""

from __future__ import annotations

import io
from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from kiks.batch.number_table import NumberTable
from kiks.export.figures import COLUMN_INCHES, draw_figure, draw_run_figure
from kiks.export.pictures import Picture
from kiks.export.vector_pen import figure_bytes
from kiks.model.arena import Arena
from kiks.recording.recording import Recording
from kiks.sim.explanation import Explanation, LightExplanation
from kiks.sim.simulation import Simulation

if TYPE_CHECKING:
    from PIL.Image import Image

Bundle = tuple[dict[str, str], dict[str, Any]]
"""What Jupyter calls a MIME bundle: data by their types, and at which size pictures are shown."""

PIXELS_PER_INCH = 96

ARENAS, ARENA_PIXELS, GAP_PIXELS = 6, 480, 24
"""Of several arenas, how many are shown side by side, the longest side of each, and the gap between them."""


def simulation(sim: Simulation) -> Bundle:
    """Return a picture of a simulation as it stands."""
    with sim.lock:
        picture = Picture.of_simulation(sim)
    return image(picture.captioned())


def arena(given: Arena) -> Bundle:
    """Return a picture of an arena."""
    return image(Picture.of_arena(given).captioned())


def arenas(of: Any) -> Bundle:
    """Return a picture of the first arenas of a batch, a task or an exam, side by side."""
    from PIL import Image

    first: Sequence[Arena] = of.arenas[:ARENAS]
    parts = [Picture.of_arena(each).image(longest_side=ARENA_PIXELS) for each in first]
    width = sum(part.width for part in parts) + GAP_PIXELS * (len(parts) - 1)
    row, left = Image.new("RGBA", (width, max(part.height for part in parts))), 0
    for part in parts:
        row.paste(part, (left, 0))
        left += part.width + GAP_PIXELS
    return image(row)


def recording(given: Recording) -> Bundle:
    """Return the figures of a recording."""
    return figure(draw_figure([given]), COLUMN_INCHES)


def sentences(given: Explanation | LightExplanation) -> Bundle:
    """Return an explanation in plain sentences."""
    return html(f"<p>{'<br>'.join(map(escape, given.text().splitlines()))}</p>")


def table(of: Any) -> Bundle:
    """Return the table of results."""
    of_numbers: NumberTable = of.table()
    left = [[f"... {of_numbers.left_out}"]] if of_numbers.left_out else []
    return html(html_table([*of_numbers.rows, *left], of_numbers.head, of_numbers.sums))


def plot(recordings: Sequence[Recording], *, robot: int = 1) -> Any:
    """Return figures of recordings; see `kiks.export.figures.draw_figure`."""
    return _shown(draw_figure(recordings, robot=robot))


def plot_run(sim: Simulation, *, robot: int = 1) -> Any:
    """Return figures of a run that is being recorded."""
    return _shown(draw_run_figure(sim, robot=robot))


def _shown(given: Any) -> Any:
    """Return a figure that a notebook shows. Matplotlib alone shows none before one is drawn with pyplot."""
    given._repr_mimebundle_ = lambda include=None, exclude=None: figure(given, given.get_figwidth())
    return given


# ---- the parts ----


def image(picture: Image) -> Bundle:
    """Return a picture, shown at half its size, so that it is sharp on any screen."""
    pixels = io.BytesIO()
    picture.save(pixels, "PNG")
    return _png(pixels.getvalue(), {"width": picture.width // 2, "height": picture.height // 2})


def figure(given: Any, inches: float) -> Bundle:
    """Return a figure of Matplotlib, and how wide it is shown."""
    return _png(figure_bytes(given, "png"), {"width": round(inches * PIXELS_PER_INCH)})


def _png(data: bytes, size: dict[str, int]) -> Bundle:
    return {"image/png": b64encode(data).decode()}, {"image/png": size}


def html(text: str) -> Bundle:
    """Return a piece of HTML."""
    return {"text/html": text}, {}


def html_table(rows: Iterable[Sequence[str]], head: Sequence[str] = (), foot: Iterable[Sequence[str]] = ()) -> str:
    """Return a table in HTML; a row of one cell is as wide as all.

    Example:
        >>> html_table([["1", "<2>"]])
        '<table><tbody><tr><td>1</td><td>&lt;2&gt;</td></tr></tbody><tfoot></tfoot></table>'
    """

    def row(words: Sequence[str], tag: str) -> str:
        wide = f' colspan="{len(head)}"' if len(words) == 1 < len(head) else ""
        return f"<tr>{''.join(f'<{tag}{wide}>{escape(word)}</{tag}>' for word in words)}</tr>"

    thead = f"<thead>{row(head, 'th')}</thead>" if head else ""
    tfoot = "".join(row(words, "th") for words in foot)
    return f"<table>{thead}<tbody>{''.join(row(words, 'td') for words in rows)}</tbody><tfoot>{tfoot}</tfoot></table>"
