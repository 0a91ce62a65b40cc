"""What stands under a picture from above: who drove, how long a millimetre is, and what its signs mean."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from kiks.export.sheet import INK, Sheet, text_font

LETTERS_A_LINE = 38
"""Width of a picture in heights of its letters, which have 6.3 points in a column of a paper, 85 mm wide."""

LETTER_PIXELS_MIN = 40
"""Least height of letters [pixels of the sheet]: on a screen, which shows a quarter of them, that is still read."""

LETTER_MM = 30.0
"""Height of a letter in the millimetres of signs."""

_ROW, _MARGIN, _GAP = 1.7, 0.7, 1.2
"""Height of a line, margin, and gap between signs [heights of a letter]."""


class Sign(NamedTuple):
    """A sign, and what it means.

    Attributes:
        draw: Draws it on a sheet, from x = 0 on, around y = 0.
        width_mm: Its width on that sheet [mm].
        text: What it means.
        letter_mm: Height of a letter there [mm].
    """

    draw: Callable[[Sheet], None]
    width_mm: float
    text: str
    letter_mm: float = LETTER_MM

    @property
    def letters(self) -> float:
        """Its width, and the space after it, in heights of letters."""
        return self.width_mm / self.letter_mm + 0.4


class Caption:
    """The lines of a caption; `draw` draws them.

    Args:
        title: Who drove.
        signs: What follows.
        width: Width of the picture [pixels of the sheet].
        text_length: Returns how long a text is in a font [pixels].
        letter: Height of its letters [pixels]; that of a picture's if left out.

    Attributes:
        height: Its height [pixels].
        right: How far its words reach, with a margin [pixels].
    """

    def __init__(
        self,
        title: str,
        signs: Sequence[Sign],
        width: float,
        text_length: Callable[..., float],
        letter: float | None = None,
    ) -> None:
        self._size = letter_pixels(width) if letter is None else letter
        self.right = 0.0
        self._placed: list[tuple[float, int, str, Sign | None]] = []
        gap, right = _GAP * self._size, width - _MARGIN * self._size
        row, x = 0, 0.0
        words = [(text, None) for text in title.split(" ")] if title else []
        for text, sign in (*words, *((each.text, each) for each in signs)):
            length = text_length(text, font=text_font(self._size))
            length += 0 if sign is None else sign.letters * self._size
            is_first_sign = bool(signs) and sign is signs[0]
            if (is_first_sign and words) or (x and x + length > right):
                row, x = row + 1, 0.0
            x = x or _MARGIN * self._size
            self._placed.append((x, row, text, sign))
            self.right = max(self.right, x + length + _MARGIN * self._size)
            x += length + (0.3 * self._size if sign is None else gap)
        self.height = math.ceil(((row + 1) * _ROW + 0.6) * self._size) if self._placed else 0

    def draw(self, sheet: Sheet) -> None:
        """Draw it on a white sheet, whose unit is a pixel and whose upper side is at 0."""
        pen, size = sheet.pen, self._size
        for x, row, text, sign in self._placed:
            y = ((row + 0.5) * _ROW + 0.3) * size
            if sign is not None:
                scale = size / sign.letter_mm
                sign.draw(Sheet(pen, scale, -x / scale, y / scale))
                x += sign.letters * size
            pen.text((x, y), text, fill=INK, font=text_font(size), anchor="lm")


def letter_pixels(width: float) -> float:
    """Return the height of the letters under a picture of a width in pixels."""
    return max(width / LETTERS_A_LINE, LETTER_PIXELS_MIN)


def scale_bar(width_mm: float, letter_mm: float) -> Sign:
    """Return the sign of a round length, a fifth of a picture or less.

    Args:
        width_mm: Width of the picture [mm].
        letter_mm: Height of a letter on its scale [mm].
    """
    step_mm = 10 ** math.floor(math.log10(width_mm / 5))
    length_mm = max(part * step_mm for part in (1, 2, 5) if part * step_mm <= width_mm / 5)

    def draw(sheet: Sheet) -> None:
        half = 0.3 * letter_mm
        for ends in (((0, 0), (length_mm, 0)), ((0, -half), (0, half)), ((length_mm, -half), (length_mm, half))):
            sheet.line(ends, INK, 0.12 * letter_mm)

    text = f"{length_mm:g} mm" if length_mm < 1000 else f"{length_mm / 1000:g} m"
    return Sign(draw, length_mm, text, letter_mm)
