"""Pictures with lines that stay sharp: the strokes of a `Sheet` as shapes of Matplotlib, and the files of figures."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.export.sheet import FLOOR, Place, coarse_cells, darkness, lit_floor, wall_grey
from kiks.model.arena import Arena
from kiks.model.replaceable import MADE_BY
from kiks.model.robot import RobotSpec
from kiks.sim.colours import Colour

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 160

UNIT_POINTS = 0.2
"""A pixel of a sheet on paper [points]: a picture fills the width of a page."""

_WALL_CELLS_MAX, _SHADES_MAX = 2000, 16
"""Most cells along a side of the walls that are outlined, and most shades of the floor."""

_STRAIGHT_MM = 1e-6
"""Points of an outline that lie off the line between others by less are left out [mm]."""

_STEPS = 100
"""Steps in a point, to which places in an SVG file are rounded: a hundredth of the width of a line."""

_PATH, _PART, _ZERO = re.compile(r' d="([^"]*)"'), re.compile(r"([MLCQz])([^MLCQz]*)"), re.compile(r"\b0\.")
"""The data of a path in an SVG file, a part of it, which is a letter and places, and a zero that may be left out."""

_SQUARE = "image-rendering:crisp-edges;image-rendering:pixelated"
"""How Matplotlib asks for pictures whose pixels are squares: the light of lamps is smooth."""

_PARTS = {"l": "left", "m": "center", "r": "right"}


def figure_bytes(figure: Figure, kind: str, dots_per_inch: int = DOTS_PER_INCH) -> bytes:
    """Return the file of a figure. Without dates and random names, the same recording gives the same file.

    Args:
        figure: The figure.
        kind: 'png', 'jpg', 'svg' or 'pdf'.
        dots_per_inch: Of a picture in pixels.
    """
    from matplotlib import rc_context

    creator = {"Creator": MADE_BY}
    about = {"svg": creator | {"Date": None}, "pdf": creator | {"CreationDate": None}, "png": {"Software": MADE_BY}}
    buffer = io.BytesIO()
    # Journals want TrueType in a PDF. What the font lacks, such as Chinese, is a box, and no reason for a warning.
    with rc_context({"svg.hashsalt": "kiks", "pdf.fonttype": 42}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        figure.savefig(buffer, format=kind, dpi=dots_per_inch, metadata=about.get(kind))
    if kind != "svg":
        return buffer.getvalue()
    return _PATH.sub(_shortened, buffer.getvalue().decode()).replace(_SQUARE, "").encode()


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

    def ground(self, arena: Arena, lamps: NDArray[np.float64], specs: Sequence[RobotSpec]) -> None:
        """Draw what `ground_picture` draws, as outlines; each grey lies over the darker ones."""
        self._axes.set_facecolor(_colour(FLOOR))
        if (lit := lit_floor(arena, lamps, specs)) is not None:
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
        areas = self._axes.contourf(x_mm, y_mm, cells.astype(float), levels=levels, colors=[_colour(colour)], zorder=1)
        areas.set_paths([_corners(path) for path in areas.get_paths()])

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


def _corners(path: Any) -> Any:
    """Return an outline without the points on its straight sides, of which it has one for each cell."""
    path.simplify_threshold = _STRAIGHT_MM
    return path.cleaned(simplify=True)


def _shortened(found: re.Match[str]) -> str:
    """Return the data of a path of an SVG file as short steps, each from the place before."""
    parts: list[str] = []
    begin = at = [0, 0]
    before = ""
    for letter, numbers in _PART.findall(found[1]):
        ends = [round(float(number) * _STEPS) for number in numbers.split()]
        steps = [end - at[index % 2] for index, end in enumerate(ends)]
        at = begin if letter == "z" else ends[-2:]
        begin = at if letter == "M" else begin
        if letter == before == "L":
            letter = ""  # the letter before holds for what follows
        else:
            before = letter
        if letter or any(steps):
            parts.append(letter.lower() + " ".join(f"{step / _STEPS:.2f}".rstrip("0").rstrip(".") for step in steps))
    return f' d="{_ZERO.sub(".", " ".join(parts)).replace(" -", "-")}"'


def _colour(colour: Colour | None) -> Any:
    return "none" if colour is None else tuple(part / 255 for part in colour)
