"""A film, or a picture, of candidates that drive in worlds of their own, all seen in one arena: ghosts.

They do not see each other, and drive through one another. Those behind the first are translucent. Balls and cylinders
are rings where they stood at the start, for each ghost has pushed its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, library
from kiks.export.film import (
    FPS,
    FPS_MAX,
    GIF_FPS_MAX,
    PICTURES_MAX,
    SAMPLE_COUNT,
    SIZE,
    SPEED_MAX,
    SPEED_MIN,
    checked_size,
)
from kiks.export.kinds import KINDS
from kiks.export.looks import CYLINDER_COLOUR, robot_colour
from kiks.export.panel import draw_sign
from kiks.export.pictures import save_image
from kiks.export.sheet import FLOOR, mixed
from kiks.export.stage import MARGIN, OUTSIDE, TRAIL_PIXELS, Canvas, Pixels
from kiks.export.video_file import GIF, MP4, VideoFile
from kiks.model.arena import Arena
from kiks.model.atomic_files import ending_of, writing
from kiks.model.checks import check_count, check_number
from kiks.model.robot import RobotSpec

PICTURE = ".png"
ENDINGS = (*KINDS["film"].endings, PICTURE)
"""Endings of what ghosts become."""

LINE_POINTS = 40
"""Most points of a trail that wait for the next piece, of a robot that stands."""

GHOST_SHARE, TRAIL_SHARE = 0.4, 0.22
"""Opacity of a ghost behind the first one, and of its trail."""

PAUSE_S = 0.6
"""How long the end of a generation stands in a film [s]."""


class Ghosts(NamedTuple):
    """Candidates that drive in worlds that are alike.

    Attributes:
        arena: Their arena.
        spec: Their kind of robot.
        ways: x_mm, y_mm and heading_rad at equal intervals, float64 [ghost, point, 3]; the best ghost first.
        seconds: Time of a trial [s].
        title: What they are.
    """

    arena: Arena
    spec: RobotSpec
    ways: NDArray[np.float64]
    seconds: float
    title: str


def check_scenes(scenes: Sequence[Ghosts]) -> None:
    """Raise an error if there is no generation."""
    if not scenes:
        raise ParameterError("ghosts must be of one generation at least, but there was none.")


def save_ghosts(
    scenes: Sequence[Ghosts],
    path: str | Path,
    *,
    size: tuple[int, int] = SIZE,
    fps: int = FPS,
    speed: float = 1.0,
    on_progress: Callable[[float], object] = lambda share: None,
) -> int:
    """Make a film of generations one after the other, or a picture of the whole ways of the last one.

    Args:
        scenes: The generations.
        path: The file: .mp4, .gif or .webp for a film, .png for a picture.
        size: Width and height [pixels]; of an MP4, an odd one becomes one less.
        fps: Pictures per second.
        speed: Simulated seconds per second of the film.
        on_progress: Called after each picture with the share that is done.

    Returns:
        The number of pictures.
    """
    check_scenes(scenes)
    ending = ending_of(path, "ghosts", ENDINGS)
    width, height = checked_size(size)
    if ending == PICTURE:
        from PIL import Image

        (picture,) = _pictures(scenes[-1], (width, height), np.array([scenes[-1].seconds]))
        save_image(Image.fromarray(picture), path)
        return 1
    library("av", "film")
    if ending == MP4:
        width, height = width // 2 * 2, height // 2 * 2
    fps = check_count("fps", fps, 1, GIF_FPS_MAX if ending == GIF else FPS_MAX)
    speed, pause = check_number("speed", speed, SPEED_MIN, SPEED_MAX), round(PAUSE_S * fps)
    times_s = [np.arange(0, each.seconds, speed / fps).tolist() + [each.seconds] * (1 + pause) for each in scenes]
    if (count := sum(map(len, times_s))) > PICTURES_MAX:
        raise ParameterError(
            f"a film must have at most {PICTURES_MAX} pictures, but it would have {count}. Choose fewer generations, "
            "or a greater speed."
        )

    def pictures(share: float = 1.0) -> Iterator[Pixels]:
        for scene, times in zip(scenes, times_s, strict=True):
            yield from _pictures(scene, (width, height), np.array(times)[:: round(1 / share)])

    samples = pictures(min(1.0, SAMPLE_COUNT / count))
    with writing(path, "a film") as beside, VideoFile(beside.path, ending, (width, height), fps, samples) as film:
        for number, picture in enumerate(pictures(), 1):
            film.add(picture)
            on_progress(number / count)
    return count


def _pictures(scene: Ghosts, size: tuple[int, int], times_s: NDArray[np.float64]) -> Iterator[Pixels]:
    """Yield a picture for each time; ways grow from one to the next."""
    body, (ghosts, points) = scene.spec.body, scene.ways.shape[:2]
    ways = scene.ways.copy()
    ways[:, :, 2] = np.unwrap(ways[:, :, 2], axis=1)
    ground, frame = _ground(scene, size)
    drawn = np.zeros(ghosts, np.int64)
    for time_s in times_s.tolist():
        place = min(time_s / scene.seconds, 1.0) * (points - 1)
        number = min(int(place), points - 2)
        poses = ways[:, number] + (place - number) * (ways[:, number + 1] - ways[:, number])
        for ghost in reversed(range(1, ghosts)):
            line = [*ways[ghost, drawn[ghost] : number + 1].tolist(), poses[ghost].tolist()]
            if math.dist(line[0][:2], line[-1][:2]) * ground.scale > 1.0 or len(line) > LINE_POINTS:
                _trail(ground, line, ghost, TRAIL_SHARE)
                drawn[ghost] = number
        picture = frame.pixels.copy()
        view = Canvas(picture, frame.scale, frame.left_mm, frame.top_mm)
        rows, columns = ground.pixels.shape[:2]
        top, left = (size[1] - rows) // 2, (size[0] - columns) // 2
        picture[top : top + rows, left : left + columns] = ground.pixels
        behind = picture.copy()
        for ghost in reversed(range(ghosts)):
            if ghost == 0:
                _trail(view, [*ways[0, : number + 1].tolist(), poses[0].tolist()], 0, 1.0)
            with view.patch([poses[ghost, :2].tolist()], body.radius_mm) as sheet:
                sheet.robot(poses[ghost].tolist(), body, ghost)
            if ghost == 1:
                picture[...] = np.rint(GHOST_SHARE * picture + (1.0 - GHOST_SHARE) * behind)
        draw_sign(picture, f"{scene.title}   {time_s:.1f} s", size[1] / 720)
        yield picture


def _trail(canvas: Canvas, line: Sequence[Sequence[float]], ghost: int, share: float) -> None:
    """Draw a trail through poses in the colour of a ghost, of which a share is seen."""
    width_mm = TRAIL_PIXELS * (1.0 + 0.6 * share) / canvas.scale
    with canvas.patch(line, width_mm) as sheet:
        sheet.line([point[:2] for point in line], mixed(FLOOR, robot_colour(ghost), share), width_mm)


def _ground(scene: Ghosts, size: tuple[int, int]) -> tuple[Canvas, Canvas]:
    """Return the floor with walls and lamps, and the empty picture around it."""
    arena, (width, height) = scene.arena, size
    scale = (1 - 2 * MARGIN) * min(width / arena.width_mm, height / arena.height_mm)
    lamps = np.array([(each.x_mm, each.y_mm, each.power_w, each.is_on) for each in arena.lamps], float).reshape(-1, 4)
    ground = Canvas.of_ground(arena, lamps, scene.spec, scale)
    for x_mm, y_mm, radius_mm, *_ in (*arena.balls, *arena.cylinders):
        with ground.patch([(x_mm, y_mm)], radius_mm) as sheet:
            sheet.ring((x_mm, y_mm), radius_mm, (*CYLINDER_COLOUR, 255))
    left, top = (width - ground.pixels.shape[1]) // 2, (height - ground.pixels.shape[0]) // 2
    empty = np.full((height, width, 3), OUTSIDE, np.uint8)
    return ground, Canvas(empty, scale, -left / scale, arena.height_mm + top / scale)
