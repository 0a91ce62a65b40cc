"""Draw the pictures of the example arenas: `python examples/arenas/draw.py [folder]`.

Each function returns a picture as uint8 [row, column] with row 0 on top: 0 is floor, anything else a wall of that
brightness, 1 mm per pixel. The committed pictures are what this script draws, to the pixel.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from kiks.model import pitch

Picture = npt.NDArray[np.uint8]

WALL_MM = 10


def box(width_mm: int, height_mm: int, brightness: int = 255) -> Picture:
    picture = np.full((height_mm, width_mm), brightness, np.uint8)
    picture[WALL_MM:-WALL_MM, WALL_MM:-WALL_MM] = 0
    return picture


def fill(picture: Picture, left_mm: int, top_mm: int, width_mm: int, height_mm: int, brightness: int) -> None:
    picture[top_mm : top_mm + height_mm, left_mm : left_mm + width_mm] = brightness


def disc(picture: Picture, x_mm: float, y_mm: float, radius_mm: float, brightness: int) -> None:
    rows, columns = np.indices(picture.shape)
    picture[np.hypot(columns + 0.5 - x_mm, rows + 0.5 - y_mm) <= radius_mm] = brightness


def default() -> Picture:
    """Draw the classic arena: corners of radius 100 mm inside 10 mm walls."""
    picture = np.full((650, 500), 255, np.uint8)
    fill(picture, 110, 10, 280, 630, 0)
    fill(picture, 10, 110, 480, 430, 0)
    for x_mm in (110, 390):
        for y_mm in (110, 540):
            disc(picture, x_mm, y_mm, 100, 0)
    return picture


def office() -> Picture:
    """Draw a corridor with three rooms above and two below it, doorways of 110 mm, and grey furniture."""
    picture = box(1100, 850, 220)
    for top_mm, doors_mm in ((330, (130, 480, 840)), (500, (260, 760))):
        fill(picture, 0, top_mm, 1100, WALL_MM, 220)
        for door_mm in doors_mm:
            fill(picture, door_mm, top_mm, 110, WALL_MM, 0)
    for x_mm, top_mm, bottom_mm in ((360, 0, 330), (730, 0, 330), (520, 510, 850)):
        fill(picture, x_mm, top_mm, WALL_MM, bottom_mm - top_mm, 220)
    # A doorway between the two lower rooms, so that there is more than one way about.
    fill(picture, 520, 660, WALL_MM, 110, 0)
    for desk in ((10, 10, 120, 60), (600, 10, 130, 60), (1030, 90, 60, 140), (110, 780, 150, 60), (960, 770, 130, 70)):
        fill(picture, *desk, 90)
    fill(picture, 660, 640, 160, 80, 140)
    disc(picture, 240, 110, 22, 40)
    disc(picture, 1065, 630, 25, 40)
    return picture


MAZE_PLAN = """
+--+--+--+--+--+--+--+
|        |           |
+--+--+  +  +  +--+  +
|     |     |     |  |
+--+  +--+  +--+--+  +
|     |     |     |  |
+  +  +  +--+  +  +  +
|  |  |  |     |     |
+  +--+  +  +--+--+  +
|           |        |
+--+--+--+--+--+--+--+
"""


def maze() -> Picture:
    """Draw the maze of the plan: paths 120 mm wide between walls of 10 mm."""
    plan, pitch_mm = MAZE_PLAN.split("\n")[1:-1], 130
    row_count, column_count = len(plan) // 2, len(plan[0]) // 3
    picture = np.zeros((row_count * pitch_mm + WALL_MM, column_count * pitch_mm + WALL_MM), np.uint8)
    for row, line in enumerate(plan):
        top_mm = row // 2 * pitch_mm
        for column in range(column_count + 1):
            left_mm = column * pitch_mm
            if row % 2 and line[3 * column] == "|":
                fill(picture, left_mm, top_mm, WALL_MM, pitch_mm + WALL_MM, 255)
            elif line[3 * column + 1 : 3 * column + 3] == "--":
                fill(picture, left_mm, top_mm, pitch_mm + WALL_MM, WALL_MM, 255)
    return picture


def pillars() -> Picture:
    """Draw nine pillars of rising brightness, round and square in turn, with at least 100 mm between them."""
    picture = box(600, 600)
    for index, brightness in enumerate((20, 50, 80, 110, 140, 170, 200, 230, 255)):
        x_mm, y_mm = 140 + 160 * (index % 3), 140 + 160 * (index // 3)
        if index % 2:
            disc(picture, x_mm, y_mm, 28, brightness)
        else:
            fill(picture, x_mm - 22, y_mm - 22, 44, 44, brightness)
    return picture


def track() -> Picture:
    """Draw an oval race track 120 mm wide; white outside, and a dark island with a striped kerb inside."""
    picture = np.full((500, 600), 255, np.uint8)
    _oval(picture, 230, 0)
    _oval(picture, 110, 60)
    # Stripes on the island's rim, so that a camera sees the track go by.
    rows, columns = np.indices(picture.shape)
    rim = np.zeros_like(picture)
    _oval(rim, 110, 1)
    _oval(rim, 100, 0)
    stripe = (columns // 40 + rows // 40) % 2 == 0
    picture[(rim == 1) & stripe] = 240
    return picture


def _oval(picture: Picture, radius_mm: int, brightness: int) -> None:
    for x_mm in (250, 350):
        disc(picture, x_mm, 250, radius_mm, brightness)
    fill(picture, 250, 250 - radius_mm, 100, 2 * radius_mm, brightness)


PICTURES = {
    "default.png": default,
    "maze.png": maze,
    "office.png": office,
    "pillars.tif": pillars,
    "pitch.png": pitch.picture,
    "track.png": track,
}


def draw_all(folder: Path) -> None:
    """Write all pictures into a folder."""
    for name, draw in PICTURES.items():
        Image.fromarray(draw()).save(folder / name, **({"compression": "tiff_lzw"} if name.endswith(".tif") else {}))


if __name__ == "__main__":
    draw_all(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
