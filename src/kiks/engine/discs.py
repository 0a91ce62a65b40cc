"""What rays meet besides walls: robots, balls and cylinders, as discs at the instant of a reading.

Derivation: from a ray's origin let b be the way along it to the point nearest to the disc's centre, and h the distance
of the two there. The ray enters a disc of the radius r at b - w with w^2 = r^2 - h^2; there its direction and the
disc's normal have the angle whose cosine is w/r.

A disc is four numbers in a row of `seen`: column, row and radius [cells], and brightness.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import kernel
from kiks.engine.scene import count_discs, find_near, place_at

SEEN_LIMIT = 64
"""Most discs that a proximity sensor takes into account: more than there is room for within its range."""

PER_DISC = 4
"""Numbers that describe a disc that is seen."""

SEEN_SIZE = 256
"""Numbers that describe as many discs as that."""

_ANYWHERE_MM = 1e6

ALL_AROUND = (0.0, 0.0, 1.0, 0.0, _ANYWHERE_MM, False)
"""The view of everything there is."""


@kernel
def see(scene: Any, world: Any, found: Any, count: Any, moment: Any, scale: Any, view: Any, seen: Any) -> Any:
    """Write down the discs that are in view at a moment; return how many.

    Args:
        scene: What there is.
        world: Index of the world.
        found: Discs that come into question, int64, as `kiks.engine.scene.find_near` writes them.
        count: How many of them count.
        moment: When (`kiks.engine.scene.moment_of`).
        scale: Edge of a cell [mm] and cells of the border around the arena.
        view: Where it is seen from, x and y [mm]; a direction, cosine and sine; how far [mm]; whether only what lies
            in that direction counts, however much aside, or all around.
        seen: float64 [`PER_DISC` * `count` at least].
    """
    robots, bodies, kinds, _ = scene
    ticks_ago, back = moment
    cell, pad = scale
    x, y, cosine, sine, reach_mm, is_ahead = view
    per_cell = 1.0 / cell
    seen_count = 0
    for k in range(count):
        disc = found[k]
        if disc < robots.shape[1]:
            robot = robots[world, disc]
            disc_x, disc_y = place_at(robot, ticks_ago, back)
            radius, brightness = kinds[robot.kind].radius_mm, kinds[robot.kind].brightness
        else:
            body = bodies[world, disc - robots.shape[1]]
            disc_x, disc_y = place_at(body, ticks_ago, back)
            radius, brightness = body.radius_mm, np.int64(body.brightness)
        dx, dy, far = disc_x - x, disc_y - y, reach_mm + radius
        if dx * dx + dy * dy < far * far and (not is_ahead or dx * cosine + dy * sine > -radius):
            place = PER_DISC * seen_count
            seen[place], seen[place + 1] = disc_x * per_cell + pad, disc_y * per_cell + pad
            seen[place + 2], seen[place + 3] = radius * per_cell, brightness
            seen_count += 1
    return seen_count


@kernel
def meet_disc(seen: Any, count: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow one ray to the first disc.

    Args:
        seen: The discs.
        count: How many they are.
        column: Origin [cells].
        row: Origin [cells].
        cosine: Direction.
        sine: Direction.
        reach: Longest length followed [cells].

    Returns:
        Length of the ray [cells], the cosine of the angle of incidence, and the brightness of the disc; `reach`, 1
        and 0 if the ray meets none.
    """
    length, squarely, brightness = reach, 1.0, np.int64(0)
    for k in range(count):
        dx, dy = seen[PER_DISC * k] - column, seen[PER_DISC * k + 1] - row
        radius = seen[PER_DISC * k + 2]
        along = dx * cosine + dy * sine
        aside = dx * sine - dy * cosine
        square = radius * radius - aside * aside
        if along <= 0.0 or square <= 0.0 or along - radius >= length:
            continue
        half = math.sqrt(square)
        entry = max(along - half, 0.0)
        if entry < length:
            length, squarely, brightness = entry, half / radius, np.int64(seen[PER_DISC * k + 3])
    return length, squarely, brightness


@kernel
def hides(seen: Any, k: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Say whether a disc stands between the origin of a ray and its end; a lamp that hangs over it is not hidden."""
    dx, dy = seen[PER_DISC * k] - column, seen[PER_DISC * k + 1] - row
    radius = seen[PER_DISC * k + 2]
    along, aside = dx * cosine + dy * sine, dx * sine - dy * cosine
    is_over = aside * aside + (reach - along) * (reach - along) <= radius * radius
    return 0.0 < along < reach and abs(aside) < radius and not is_over


@kernel
def everybody_else(scene: Any, world: Any, itself: Any) -> Any:
    """Return all discs of a world but one, how many they are, and room for what they look like."""
    limit = count_discs(scene)[1]
    found, seen = np.empty(limit, np.int64), np.empty(PER_DISC * limit, np.float64)
    return found, find_near(scene, world, 0.0, 0.0, _ANYWHERE_MM, itself, found), seen
