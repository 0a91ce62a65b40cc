"""Pictures with lines that stay sharp: the strokes of a `Sheet` as shapes of Matplotlib, and the files of figures."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.export.looks import Colour
from kiks.export.sheet import FLOOR, Place, coarse_cells, darkness, lit_floor, wall_grey
from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 160

UNIT_POINTS = 0.2
"""A pixel of a sheet on paper [points]: a picture fills the width of a page."""

_WALL_CELLS_MAX, _SHADES_MAX = 2000, 16
"""Most cells along a side of the walls that are outlined, and most shades of the floor."""

_PARTS = {"l": "left", "m": "center", "r": "right"}


def file_of(figure: Figure, kind: str, dots_per_inch: int = DOTS_PER_INCH) -> bytes:
    """Return the file of a figure. Without dates and random names, the same recording gives the same file.

    Args:
        figure: The figure.
        kind: 'png', 'jpg', 'svg' or 'pdf'.
        dots_per_inch: Of a picture in pixels.
    """
    from matplotlib import rc_context

    dated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    buffer = io.BytesIO()
    # Journals want TrueType in a PDF. What the font lacks, such as Chinese, is a box, and no reason for a warning.
    with rc_context({"svg.hashsalt": "kiks", "pdf.fonttype": 42}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        figure.savefig(buffer, format=kind, dpi=dots_per_inch, metadata=dated)
    return buffer.getvalue()


class VectorPen:
    """Draws on axes what Pillow's `ImageDraw` would draw; of its methods those that a sheet uses.

    Args:
        axes: The axes; they show the arena in millimetres.
        scale: Pixels of the sheet a millimetre.
        top_mm: Place of the sheet's upper side [mm].
    """

    def __init__(self, axes: Any, scale: float, top_mm: float) -> None:
        from matplotlib.transforms import Affine2D

        self._axes = axes
        self._transform = Affine2D().scale(1 / scale, -1 / scale).translate(0, top_mm) + axes.transData

    def ground(self, arena: Arena, lamps: NDArray[np.float64], spec: RobotSpec | None) -> None:
        """Draw what `ground_picture` draws, as outlines; each grey lies over the darker ones."""
        self._axes.set_facecolor(_colour(FLOOR))
        if (lit := lit_floor(arena, lamps, spec)) is not None:
            # As outlines, each level of light would be as long as all shadows. A viewer makes the pixels smooth.
            extent = (0.0, arena.width_mm, 0.0, arena.height_mm)
            self._axes.imshow(lit, extent=extent, interpolation="none", zorder=1)
        if arena.shades is not None:
            self._darken(*coarse_cells(arena.shades, arena.mm_per_cell, _WALL_CELLS_MAX))
        cells, cell_mm = coarse_cells(arena.brightness, arena.mm_per_cell, _WALL_CELLS_MAX)
        cells = np.pad(cells, 1)  # a wall at the edge has an outline there, too
        for brightness in np.unique(cells[cells > 0]).tolist():
            self._fill(cells >= brightness, 0.5, cell_mm, -0.5, (wall_grey(brightness),) * 3)

    def _darken(self, shades: NDArray[Any], cell_mm: float) -> None:
        """Darken the floor where it is not white."""
        if len(np.unique(shades)) > _SHADES_MAX:
            shades = np.rint(shades / 255 * _SHADES_MAX) * (255 / _SHADES_MAX)
        dark = np.pad(darkness(shades), 1)
        for share in np.unique(dark[dark > 0]).tolist():
            self._fill(dark == share, 0.5, cell_mm, -0.5, (0, 0, 0, round(255 * share)))

    def _fill(self, cells: Any, level: float, cell_mm: float, first: float, colour: Colour) -> None:
        """Fill the area above a level; the middle of the first cell is so many cells from the lower left corner."""
        x_mm, y_mm = ((np.arange(count) + first) * cell_mm for count in cells.shape[::-1])
        levels = [level, 2.0]
        self._axes.contourf(x_mm, y_mm, cells.astype(np.float64), levels=levels, colors=[_colour(colour)], zorder=1)

    def ellipse(
        self, box: tuple[float, ...], fill: Colour | None = None, outline: Colour | None = None, width: float = 1
    ) -> None:
        """Draw a circle by its box."""
        from matplotlib.patches import Circle

        left, top, right, bottom = box
        edge = 0.0 if outline is None else width / 2  # Pillow's outline lies within the box
        middle = ((left + right) / 2, (top + bottom) / 2)
        self._add(Circle(middle, max((right - left) / 2 - edge, 0)), fill, outline, width)

    def polygon(self, points: Sequence[Place], fill: Colour | None = None) -> None:
        """Draw a polygon."""
        from matplotlib.patches import Polygon

        self._add(Polygon(points), fill, None, 0)

    def line(self, points: Sequence[Place], fill: Colour, width: float = 1, joint: str = "") -> None:
        """Draw a line through points."""
        from matplotlib.lines import Line2D

        drawn = Line2D(
            *np.transpose(points),
            color=_colour(fill),
            linewidth=width * UNIT_POINTS,
            transform=self._transform,
            solid_capstyle="butt",
            solid_joinstyle="round",
            zorder=1,
        )
        self._axes.add_artist(drawn)

    def text(self, at: Place, text: str, fill: Colour, font: Any, anchor: str, stroke_width: int = 0, **_: Any) -> None:
        """Write a line."""
        self._axes.text(
            *at,
            text,
            color=_colour(fill),
            fontsize=font.size * UNIT_POINTS,
            fontweight="bold" if stroke_width else "normal",
            ha=_PARTS[anchor[0]],
            va="center_baseline",
            parse_math=False,
            transform=self._transform,
            clip_on=True,
            zorder=1,
        )

    @staticmethod
    def textlength(text: str, font: Any) -> float:
        """Return how long a line of text is."""
        from matplotlib.font_manager import FontProperties
        from matplotlib.textpath import text_to_path

        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing from")
            length, _, _ = text_to_path.get_text_width_height_descent(text, FontProperties(size=font.size), False)
        return float(length)

    def _add(self, patch: Any, fill: Colour | None, stroke: Colour | None, width: float) -> None:
        patch.set(
            facecolor=_colour(fill),
            edgecolor=_colour(stroke),
            linewidth=width * UNIT_POINTS if stroke else 0,
            transform=self._transform,
            zorder=1,
        )
        self._axes.add_artist(patch)


def _colour(colour: Colour | None) -> Any:
    return "none" if colour is None else tuple(part / 255 for part in colour)
