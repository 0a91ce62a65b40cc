"""A picture of a soccer match: all paths on the pitch, and below it a small picture of each goal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from soccer_match import LOOK_S, Goal, Match

from kiks.model import pitch

if TYPE_CHECKING:
    from PIL.Image import Image

Colour = tuple[int, int, int]

_GRASS, _WALL, _LINE = (232, 239, 226), (92, 98, 104), (255, 255, 255)
_COLOURS: dict[str, Colour] = {"left": (38, 92, 200), "right": (214, 84, 30), "ball": (30, 30, 30)}
_GOALS: dict[str, Colour] = {"left": (168, 186, 222), "right": (236, 190, 160)}
_PAPER, _INK = (255, 255, 255), (40, 40, 40)

_WIDTH, _HEAD, _CAPTION, _GAP = 1230, 64, 26, 14
_COLUMNS = 4
_FINER = 2  # drawn larger by this factor and shrunk, which smooths the lines
_RUN_UP_S = 8.0  # time before a goal that its picture shows [s]
_PALE = 0.55


def draw_match(match: Match) -> Image:
    """Return the picture of a match."""
    from PIL import Image, ImageDraw

    trail, goals = match.trail(), match.report.goals
    large = panel(trail, _WIDTH, goals)
    small_width = (_WIDTH - (_COLUMNS - 1) * _GAP) // _COLUMNS
    small_height = round(small_width * pitch.HEIGHT_MM / pitch.WIDTH_MM)
    row_count = -(-len(goals) // _COLUMNS)
    height = _HEAD + large.height + _GAP + row_count * (small_height + _CAPTION + _GAP)
    image = Image.new("RGB", (_WIDTH + 2 * _GAP, height), _PAPER)
    draw = ImageDraw.Draw(image)
    left, right = match.report.score()
    _write(draw, (_GAP, 12), f"left {left}", 34, _COLOURS["left"])
    _write(draw, (_WIDTH + _GAP, 12), f"right {right}", 34, _COLOURS["right"], anchor="ra")
    _write(draw, (_GAP + _WIDTH // 2, 20), f"{match.time_s:.0f} s, seed {match.seed}", 22, _INK, anchor="ma")
    image.paste(large, (_GAP, _HEAD))
    top = _HEAD + large.height + _GAP
    standing = {"left": 0, "right": 0}
    for number, goal in enumerate(goals):
        standing[goal.side] += 1
        end = round(goal.time_s / LOOK_S) + 1
        x = _GAP + number % _COLUMNS * (small_width + _GAP)
        y = top + number // _COLUMNS * (small_height + _CAPTION + _GAP)
        before = goals[number - 1].time_s if number else 0.0
        begin = round(max(goal.time_s - _RUN_UP_S, before) / LOOK_S) + 1
        image.paste(panel(trail[begin:end], small_width, [], is_close=True), (x, y + _CAPTION))
        text = f"{goal.time_s:.0f} s   {standing['left']}:{standing['right']}"
        _write(draw, (x, y + 2), text, 18, _COLOURS[goal.side])
    return image


def panel(trail: NDArray[np.float64], width: int, goals: Sequence[Goal], *, is_close: bool = False) -> Image:
    """Return the pitch with paths on it.

    Args:
        trail: float64 [look, left, right or ball, x or y] [mm].
        width: Of the picture [pixels].
        goals: The goals to mark.
        is_close: True for a few seconds in strong colours, False for a whole match in pale ones.
    """
    from PIL import Image, ImageDraw

    scale = _FINER * width / pitch.WIDTH_MM
    image = _ground(scale)
    draw = ImageDraw.Draw(image)

    def at(place: Sequence[float]) -> tuple[float, float]:
        return place[0] * scale, (pitch.HEIGHT_MM - place[1]) * scale

    def disc(place: Sequence[float], radius_mm: float, fill: Colour | None, outline: Colour, line_mm: float) -> None:
        (x, y), r = at(place), radius_mm * scale
        draw.ellipse((x - r, y - r, x + r, y + r), fill=fill, outline=outline, width=max(round(line_mm * scale), 1))

    thick = 7.0 if is_close else 1.6
    for index, name in enumerate(("left", "right", "ball")):
        colour = _COLOURS[name] if is_close or name == "ball" else _mix(_COLOURS[name], _GRASS, _PALE)
        for piece in _pieces(trail[:, index]):
            draw.line([at(place) for place in piece], fill=colour, width=max(round(thick * scale), 1), joint="curve")
    for goal in goals:
        look = min(round(goal.time_s / LOOK_S), len(trail) - 1)
        disc(trail[look, 2], 12.0, _COLOURS[goal.side], _PAPER, 2.0)
    if len(trail):
        for index, name in enumerate(("left", "right")):
            disc(trail[-1, index], 27.5, _COLOURS[name], _PAPER, 3.0)
        disc(trail[-1, 2], 32.0, _PAPER, _COLOURS["ball"], 4.0)
    size = width, round(width * pitch.HEIGHT_MM / pitch.WIDTH_MM)
    return image.resize(size, Image.Resampling.LANCZOS)


def _ground(scale: float) -> Image:
    """Return the empty pitch, with the lines that are painted on such floors."""
    from PIL import Image, ImageDraw

    cells = pitch.picture()
    colours = np.where((cells == 0)[..., None], np.array(_GRASS, np.uint8), np.array(_WALL, np.uint8))
    for grey, side in ((pitch.LEFT_GOAL, "left"), (pitch.RIGHT_GOAL, "right")):
        colours[cells == grey] = _GOALS[side]
    size = round(pitch.WIDTH_MM * scale), round(pitch.HEIGHT_MM * scale)
    image = Image.fromarray(colours.astype(np.uint8), "RGB").resize(size, Image.Resampling.LANCZOS)
    draw = ImageDraw.Draw(image)
    middle_x, middle_y, width = pitch.MIDDLE_X_MM * scale, pitch.MIDDLE_Y_MM * scale, max(round(3 * scale), 1)
    draw.line([(middle_x, 10 * scale), (middle_x, size[1] - 10 * scale)], fill=_LINE, width=width)
    radius = 100 * scale
    draw.ellipse(
        (middle_x - radius, middle_y - radius, middle_x + radius, middle_y + radius), outline=_LINE, width=width
    )
    for line_mm in (pitch.LEFT_LINE_MM, pitch.RIGHT_LINE_MM):
        draw.line([(line_mm * scale, middle_y - 150 * scale), (line_mm * scale, middle_y + 150 * scale)], _LINE, width)
    return image


def _pieces(path: NDArray[np.float64]) -> list[list[list[float]]]:
    """Return a path in pieces, cut where the referee has moved the ball."""
    if len(path) < 2:
        return []
    steps_mm = np.hypot(*np.diff(path, axis=0).T)
    cuts = np.flatnonzero(steps_mm > 1000.0 * LOOK_S) + 1
    return [piece.tolist() for piece in np.split(path, cuts) if len(piece) > 1]


def _mix(first: Colour, second: Colour, share: float) -> Colour:
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(first, second, strict=True))
    return red, green, blue


def _write(draw: Any, at: tuple[int, int], text: str, size: int, colour: Colour, anchor: str = "la") -> None:
    from PIL import ImageFont

    draw.text(at, text, fill=colour, font=ImageFont.load_default(size), anchor=anchor)
