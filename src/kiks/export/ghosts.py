"""Films and pictures of candidates that drive in worlds of their own, all seen in one arena: ghosts.

They do not see each other, and drive through one another. Those behind the first are translucent. Balls and cylinders
are rings where they stood at the start, for each ghost has pushed its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.export.film import check_picture_count, checked_format, checked_size
from kiks.export.panel import draw_sign
from kiks.export.pictures import save_image
from kiks.export.sheet import FLOOR, mixed
from kiks.export.stage import MARGIN, TRAIL_PIXELS, Canvas, Pixels, arena_canvas
from kiks.export.video_file import write_film
from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec
from kiks.sim.colours import CYLINDER_COLOUR, robot_colour

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
        trajectories: x_mm, y_mm and heading_rad at equal intervals, float64 [ghost, point, 3]; the best ghost first.
        seconds: Time of a trial [s].
        title: What they are.
    """

    arena: Arena
    spec: RobotSpec
    trajectories: NDArray[np.float64]
    seconds: float
    title: str


def draw_ghost_film(
    scenes: Sequence[Ghosts],
    path: str | Path,
    *,
    size: tuple[int, int],
    fps: int,
    speed: float,
    on_progress: Callable[[float], object],
) -> None:
    """Make a film of generations one after the other; see `kiks.learn.ghosts.save_ghosts`."""
    size, fps, speed = checked_format(path, size, fps, speed)
    pause = 1 + round(PAUSE_S * fps)
    check_picture_count(sum(int(each.seconds / speed * fps) + pause for each in scenes), "fewer generations")
    instants = [
        (number, time_s)
        for number, scene in enumerate(scenes)
        for time_s in (*np.arange(0, scene.seconds, speed / fps).tolist(), *[scene.seconds] * pause)
    ]

    def pictures(shown: Sequence[tuple[int, float]]) -> Iterator[Pixels]:
        for number, group in groupby(shown, key=lambda instant: instant[0]):
            yield from _pictures(scenes[number], size, [time_s for _, time_s in group])

    write_film(path, size, fps, instants, pictures, on_progress)


def draw_ghost_picture(scene: Ghosts, path: str | Path, size: tuple[int, int]) -> None:
    """Draw the whole trajectories of a generation."""
    from PIL import Image

    (picture,) = _pictures(scene, checked_size(size), [scene.seconds])
    save_image(Image.fromarray(picture), path)


def _pictures(scene: Ghosts, size: tuple[int, int], times_s: Sequence[float]) -> Iterator[Pixels]:
    """Yield a picture for each time; trails grow from one to the next."""
    ghosts, points = scene.trajectories.shape[:2]
    trajectories = scene.trajectories.copy()
    trajectories[:, :, 2] = np.unwrap(trajectories[:, :, 2], axis=1)
    ground = _ground(scene, size)
    drawn = np.zeros(ghosts, np.int64)
    for time_s in times_s:
        place = time_s / scene.seconds * (points - 1)
        number = min(int(place), points - 2)
        before, after = trajectories[:, number], trajectories[:, number + 1]
        poses = before + (place - number) * (after - before)
        for ghost in reversed(range(1, ghosts)):
            line = [*trajectories[ghost, drawn[ghost] : number + 1].tolist(), poses[ghost].tolist()]
            if math.dist(line[0][:2], line[-1][:2]) * ground.scale > 1.0 or len(line) > LINE_POINTS:
                _draw_trail(ground, line, ghost, TRAIL_SHARE)
                drawn[ghost] = number
        picture = np.zeros((size[1], size[0], 3), np.uint8)
        view = ground.seen_on(picture)
        behind = picture.copy()
        for ghost in reversed(range(ghosts)):
            if ghost == 0:
                _draw_trail(view, [*trajectories[0, : number + 1].tolist(), poses[0].tolist()], 0, 1.0)
            with view.patch([poses[ghost, :2].tolist()], scene.spec.body.radius_mm) as sheet:
                sheet.robot(poses[ghost].tolist(), scene.spec, ghost)
            if ghost == 1:
                picture[...] = np.rint(GHOST_SHARE * picture + (1.0 - GHOST_SHARE) * behind)
        draw_sign(picture, f"{scene.title}   {time_s:.1f} s", size[1] / 720)
        yield picture


def _draw_trail(canvas: Canvas, line: Sequence[Sequence[float]], ghost: int, share: float) -> None:
    """Draw a trail through poses in the colour of a ghost, of which a share is seen."""
    width_mm = TRAIL_PIXELS * (1.0 + 0.6 * share) / canvas.scale
    with canvas.patch(line, width_mm) as sheet:
        sheet.line([point[:2] for point in line], mixed(FLOOR, robot_colour(ghost), share), width_mm)


def _ground(scene: Ghosts, size: tuple[int, int]) -> Canvas:
    """Return the floor with walls and lamps, and rings where balls and cylinders stood."""
    arena = scene.arena
    lamps = np.array([tuple(each) for each in arena.lamps], np.float64).reshape(-1, 4)
    scale = (1 - 2 * MARGIN) * min(size[0] / arena.width_mm, size[1] / arena.height_mm)
    ground = arena_canvas(arena, lamps, [scene.spec], scale)
    for x_mm, y_mm, radius_mm, *_ in arena.bodies:
        with ground.patch([(x_mm, y_mm)], radius_mm) as sheet:
            sheet.ring((x_mm, y_mm), radius_mm, (*CYLINDER_COLOUR, 255))
    return ground
