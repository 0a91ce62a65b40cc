"""Arenas for training and for the exam, drawn as strokes: long ones are walls, short and thick ones pillars.

An arena never changes, so each is made once, with its distances to walls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from kiks.batch.initial_state import random_starts
from kiks.learn.candidate_worlds import CLEAR_MM
from kiks.model.arena import Arena, Lamp, Pose

WALL_MM = 10.0
"""Thickness of walls [mm]."""

HEAP_PITCH_MM = 75.0
"""Distance between neighbours in a heap of robots [mm]: they see each other."""

TRIED_STARTS = 2000
"""Random places among which starts in shadow are looked for."""


@dataclass(frozen=True)
class Stroke:
    """A wall from one point to another with round ends; a pillar if both points are equal.

    Args:
        begin_mm: x and y of its beginning.
        end_mm: x and y of its end.
        thickness_mm: Its thickness.
        brightness: From 1 (black) to 255 (white).
    """

    begin_mm: tuple[float, float]
    end_mm: tuple[float, float]
    thickness_mm: float = WALL_MM
    brightness: int = 255


def pillar(x_mm: float, y_mm: float, diameter_mm: float, brightness: int = 255) -> Stroke:
    """Return a pillar."""
    return Stroke((x_mm, y_mm), (x_mm, y_mm), diameter_mm, brightness)


def wall(*places_mm: tuple[float, float], brightness: int = 255) -> list[Stroke]:
    """Return a wall through some points."""
    return [Stroke(begin, end, brightness=brightness) for begin, end in pairwise(places_mm)]


def draw(width_mm: int, height_mm: int, strokes: Sequence[Stroke], name: str, brightness: int = 255) -> Arena:
    """Return an arena with a wall around it and strokes inside."""
    cells = np.zeros((height_mm, width_mm), np.uint8)
    edge = int(WALL_MM)
    cells[:edge] = cells[-edge:] = cells[:, :edge] = cells[:, -edge:] = brightness
    rows, columns = np.indices(cells.shape)
    x_mm, y_mm = columns + 0.5, height_mm - rows - 0.5
    for stroke in strokes:
        (begin_x, begin_y), (end_x, end_y) = stroke.begin_mm, stroke.end_mm
        along_x, along_y = end_x - begin_x, end_y - begin_y
        length_squared = along_x**2 + along_y**2
        share = ((x_mm - begin_x) * along_x + (y_mm - begin_y) * along_y) / (length_squared or 1.0)
        share = np.clip(share, 0.0, 1.0)
        distance_squared = (x_mm - begin_x - share * along_x) ** 2 + (y_mm - begin_y - share * along_y) ** 2
        cells[distance_squared <= (stroke.thickness_mm / 2) ** 2] = stroke.brightness
    return Arena.from_array(cells, name=name)


@cache
def heap(side_mm: int, x_mm: float, y_mm: float, number: int) -> Arena:
    """Return a square room where twenty robots start in a heap around a place, each with another heading."""
    rng = np.random.default_rng(number)
    columns, rows = (each.ravel() for each in np.meshgrid(np.arange(5) - 2.0, np.arange(4) - 1.5))
    starts = tuple(
        Pose(x_mm + HEAP_PITCH_MM * column, y_mm + HEAP_PITCH_MM * row, float(rng.uniform(-np.pi, np.pi)))
        for column, row in zip(columns.tolist(), rows.tolist(), strict=True)
    )
    return replace(Arena.box(side_mm, side_mm), name=f"heap {number}", starts=starts)


@cache
def pillars() -> Arena:
    """Return an arena with thick and thin, bright and dark pillars."""
    return draw(
        600,
        600,
        [
            pillar(150, 150, 60),
            pillar(430, 130, 30, 160),
            pillar(300, 300, 90, 60),
            pillar(120, 430, 24),
            pillar(450, 460, 50, 30),
            pillar(300, 480, 16, 120),
        ],
        "pillars",
    )


@cache
def corridors() -> Arena:
    """Return an arena of corridors with right-angled corners and a dead end."""
    walls = [
        *wall((130, 130), (130, 470), (330, 470)),
        *wall((130, 130), (470, 130), (470, 600)),
        *wall((250, 250), (250, 350), brightness=90),
        *wall((250, 250), (350, 250), (350, 360)),
    ]
    return draw(600, 600, walls, "corridors", 200)


@cache
def wedges() -> Arena:
    """Return an arena whose walls meet at acute and obtuse angles, with walls that end inside."""
    walls = [
        *wall((0, 500), (100, 600)),
        *wall((600, 110), (490, 0), brightness=140),
        *wall((0, 150), (210, 215)),
        *wall((490, 380), (360, 330), (395, 490), brightness=70),
        *wall((250, 0), (300, 110)),
    ]
    return draw(600, 600, walls, "wedges")


@cache
def unseen() -> Arena:
    """Return an arena for the exam: slanted walls, pillars, a passage and a dead end."""
    walls = [
        *wall((0, 520), (240, 600)),
        *wall((250, 0), (250, 240), (120, 330)),
        *wall((380, 150), (640, 150), (700, 260)),
        *wall((360, 800), (360, 560), (250, 470), brightness=170),
        *wall((500, 420), (500, 680), (640, 680), brightness=150),
        pillar(640, 420, 70),
        pillar(110, 150, 40, 130),
        pillar(660, 560, 25),
        pillar(370, 350, 50),
    ]
    return draw(800, 800, walls, "unseen", 220)


@cache
def rooms() -> Arena:
    """Return an arena for the exam: three rooms with doors, furniture, thin dark walls and a post."""
    walls = [
        *wall((0, 420), (250, 420)),
        *wall((370, 420), (430, 420), (430, 620), brightness=90),
        *wall((430, 740), (430, 900)),
        *wall((430, 420), (620, 420)),
        *wall((740, 420), (900, 420), brightness=60),
        *wall((430, 0), (430, 150)),
        *wall((430, 280), (430, 420), brightness=200),
        *wall((120, 200), (220, 200), (220, 110), (120, 110), (120, 200), brightness=150),
        *wall((640, 620), (760, 700), brightness=40),
        pillar(200, 660, 80, 110),
        pillar(680, 200, 20, 60),
        pillar(610, 800, 45),
    ]
    return draw(900, 900, walls, "rooms", 180)


@cache
def wall_ends() -> Arena:
    """Return an arena for following walls: walls that end inside, with corners to both sides, and two pillars."""
    walls = [
        *wall((235, 0), (235, 210), (430, 210)),
        *wall((0, 390), (195, 390), (285, 520), brightness=170),
        *wall((455, 375), (455, 560), (625, 560)),
        *wall((650, 0), (650, 180)),
        *wall((845, 340), (665, 375)),
        *wall((390, 845), (390, 700), (260, 700)),
        pillar(730, 700, 70),
        pillar(115, 585, 45, 190),
    ]
    return draw(845, 845, walls, "wall ends")


@cache
def alcoves() -> Arena:
    """Return an arena for following walls: a room with alcoves, and an angled wall in its middle."""
    walls = [
        *wall((0, 245), (155, 245), (155, 195)),
        *wall((340, 0), (340, 85), (545, 85), (545, 0)),
        *wall((780, 235), (610, 235), (610, 325), brightness=180),
        *wall((235, 430), (405, 365), (495, 480)),
        *wall((780, 545), (695, 545), (695, 780)),
        *wall((430, 780), (430, 650), (545, 570), brightness=200),
        *wall((0, 570), (145, 700)),
    ]
    return draw(780, 780, walls, "alcoves", 230)


@cache
def unseen_rooms() -> Arena:
    """Return an arena for the exam of followers: ledges, open rooms and a hook, with corners to both sides."""
    walls = [
        *wall((0, 65), (180, 65), (180, 0)),
        *wall((330, 0), (330, 260), (230, 260)),
        *wall((700, 0), (760, 140), (900, 140)),
        *wall((520, 700), (520, 450), (700, 450), (700, 560)),
        *wall((0, 430), (200, 430), (260, 520)),
        *wall((520, 150), (520, 310), (640, 310)),
        *wall((900, 420), (835, 420), (835, 700)),
    ]
    return draw(900, 700, walls, "unseen rooms", 220)


LAMP_W = 25.0
"""Power of lamps [W]: their light exceeds the noise of a Khepera's sensors up to 1.15 m away, that of 1 W to 0.23 m."""


@cache
def lit_pillars() -> Arena:
    """Return an arena with a lamp among thick pillars."""
    strokes = [
        pillar(480, 560, 140),
        pillar(760, 460, 90, 120),
        pillar(820, 850, 110),
        pillar(300, 850, 60, 60),
        pillar(250, 300, 120, 180),
        pillar(620, 200, 40),
    ]
    return _lit(draw(1100, 1100, strokes, "lit pillars"), 640, 700)


@cache
def lit_walls() -> Arena:
    """Return an arena with a lamp between walls that end inside."""
    walls = [
        *wall((430, 130), (430, 560)),
        *wall((150, 620), (560, 760), brightness=140),
        *wall((700, 1100), (700, 800)),
        *wall((1100, 330), (760, 400)),
        pillar(680, 560, 60, 180),
    ]
    return _lit(draw(1100, 1100, walls, "lit walls"), 260, 330)


@cache
def lit_rooms() -> Arena:
    """Return an arena of three rooms with a lamp in one of them."""
    walls = [
        *wall((550, 0), (550, 330)),
        *wall((550, 560), (550, 1100), brightness=170),
        *wall((550, 620), (800, 620)),
        pillar(300, 520, 110),
        pillar(830, 400, 70, 90),
    ]
    return _lit(draw(1100, 1100, walls, "lit rooms", 220), 840, 860)


@cache
def lit_unseen() -> Arena:
    """Return an arena for the exam, with a lamp in a corner behind walls and pillars."""
    walls = [
        *wall((330, 620), (620, 330)),
        *wall((700, 900), (1000, 900), (1000, 620), brightness=170),
        *wall((1500, 420), (1180, 420)),
        *wall((420, 1200), (420, 940)),
        pillar(760, 620, 120, 150),
        pillar(960, 230, 80),
        pillar(250, 850, 60),
    ]
    arena = _lit(draw(1500, 1200, walls, "lit unseen", 220), 260, 260)
    return replace(arena, starts=starts_in_shadow(arena, 20, lamp_mm=1000.0, seed=1))


def starts_in_shadow(
    arena: Arena, count: int, *, lamp_mm: float, seed: int, radius_mm: float = 27.5
) -> tuple[Pose, ...]:
    """Return random free starts at which a robot is far from the arena's lamp, and wholly in the shadow of a wall.

    Args:
        arena: The arena; its first lamp counts.
        count: Number of starts.
        lamp_mm: Least distance from the lamp [mm].
        seed: Seed of the random generator.
        radius_mm: Radius of the robot [mm].
    """
    lamp, found = arena.lamps[0], []
    for x_mm, y_mm, heading_rad in random_starts(
        arena, TRIED_STARTS, seed=seed, radius_mm=radius_mm, clear_mm=CLEAR_MM
    ):
        distance_mm = math.hypot(x_mm - lamp.x_mm, y_mm - lamp.y_mm)
        if distance_mm < lamp_mm:
            continue
        across = np.array([y_mm - lamp.y_mm, lamp.x_mm - x_mm]) / distance_mm
        lines_mm = [(x_mm, y_mm) + side_mm * across for side_mm in np.linspace(-radius_mm, radius_mm, 12)]
        if all(is_wall_between(arena, begin_mm, (lamp.x_mm, lamp.y_mm)) for begin_mm in lines_mm):
            found.append(Pose(x_mm, y_mm, heading_rad))
    return tuple(found[:count])


def is_wall_between(arena: Arena, begin_mm: ArrayLike, end_mm: ArrayLike) -> bool:
    """Return whether the straight line between two places, x and y [mm], meets a wall."""
    begin, end = np.asarray(begin_mm, np.float64), np.asarray(end_mm, np.float64)
    step_count = int(2 * np.abs(end - begin).max() / arena.mm_per_cell)
    x_mm, y_mm = np.linspace(begin, end, 2 + step_count).T
    rows, columns = (y_mm / arena.mm_per_cell).astype(int), (x_mm / arena.mm_per_cell).astype(int)
    return bool(arena.brightness[rows, columns].any())


def _lit(arena: Arena, x_mm: float, y_mm: float) -> Arena:
    """Return an arena with a lamp."""
    return replace(arena, lamps=(Lamp(x_mm, y_mm, LAMP_W),))


SIDE_MM = 27.5 / 0.015
"""Side of the maze [mm]."""

GOAL_MM = (0.15 * SIDE_MM, 0.9 * SIDE_MM)
"""The goal: x and y."""

_SEGMENTS = (
    ((0.25, 0.25), (0.25, 0.75)),
    ((0.14, 0.45), (0.0, 0.65)),
    ((0.25, 0.75), (0.0, 0.8)),
    ((0.25, 0.75), (0.66, 0.875)),
    ((0.355, 0.0), (0.525, 0.185)),
    ((0.25, 0.5), (0.75, 0.215)),
    ((1.0, 0.25), (0.435, 0.55)),
    ((0.0, 0.8), (0.0, 1.0)),
    ((0.355, 0.0), (1.0, 0.0)),
)
"""Inner walls, in units of the maze's side."""

_START = (0.15, 0.15, math.pi / 2)
"""x and y in units of the maze's side, and heading [rad]."""


@cache
def kheperax() -> Arena:
    """Return the maze, with its start."""
    side = round(SIDE_MM + 2 * WALL_MM)
    strokes = [Stroke(_place(*begin), _place(*end)) for begin, end in _SEGMENTS]
    x_mm, y_mm = _place(*_START[:2])
    return replace(draw(side, side, strokes, "kheperax"), starts=(Pose(x_mm, y_mm, _START[2]),))


def goal_mm() -> tuple[float, float]:
    """Return x and y of the goal in the arena [mm]."""
    return GOAL_MM[0] + WALL_MM, GOAL_MM[1] + WALL_MM


def _place(x: float, y: float) -> tuple[float, float]:
    """Return a place in the arena, whose outer wall lies around the maze [mm]."""
    return x * SIDE_MM + WALL_MM, y * SIDE_MM + WALL_MM
