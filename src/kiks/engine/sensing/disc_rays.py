"""Rays and discs: robots, balls and cylinders at the instant of a reading.

Derivation: from a ray's origin let b be the path along it to the point nearest to the disc's centre, and h the distance
of the two there. The ray enters a disc of radius r at b - w with w^2 = r^2 - h^2; there the angle between its direction
and the disc's normal has the cosine w/r.

A reading first lists the tracks of nearby discs: their places at the last tick boundaries. Each sensor has an instant
of its own, and lists from the tracks the discs that it sees: four numbers for each, column, row and radius [cells], and
brightness.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel
from kiks.engine.scene import count_discs, find_near
from kiks.engine.simd.f64x8 import load, root, store, where_less
from kiks.engine.state import TRAIL_LENGTH

SEEN_LIMIT = 64
"""Most discs that a proximity sensor takes into account: more than fit within its range."""

PER_DISC = 4
"""Numbers per visible disc."""

SEEN_SIZE = 256
"""Numbers for `SEEN_LIMIT` discs."""

PER_TRACK = 2 * (TRAIL_LENGTH + 1) + 3
"""Numbers of a track: x and y [mm] now and at the past tick boundaries, radius [mm], brightness, and the disc."""

TRACKS_SIZE = 704
"""Numbers for `SEEN_LIMIT` tracks."""

_ANYWHERE_MM = 1e6

_NEVER = 1e30  # cells

_RADIUS, _BRIGHTNESS, _DISC = (2 * (TRAIL_LENGTH + 1) + k for k in range(3))

ALL_AROUND = (0.0, 0.0, (0.0, 0.0), (0.0, 0.0), _ANYWHERE_MM)
"""The view in all directions."""


@kernel
def follow(scene: Any, world: Any, found: Any, count: Any, x: Any, y: Any, reach_mm: Any, tracks: Any) -> Any:
    """List the tracks of discs that were ever within reach of a place; return their number.

    Args:
        scene: The scene.
        world: Index of the world.
        found: Candidate discs, int64, as `kiks.engine.scene.find_near` writes them.
        count: Number of candidates.
        x: The place [mm].
        y: The place [mm].
        reach_mm: Largest distance of an edge [mm].
        tracks: float64 [`PER_TRACK` * `count` at least].
    """
    robots, bodies, kinds, _ = scene
    track_count = 0
    for k in range(count):
        disc, place = found[k], PER_TRACK * track_count
        if disc < robots.shape[1]:
            robot = robots[world, disc]
            radius, brightness = kinds[robot.kind].radius_mm, np.float64(kinds[robot.kind].brightness)
            nearest = note_track(robot, x, y, place, tracks)
        else:
            body = bodies[world, disc - robots.shape[1]]
            radius, brightness = body.radius_mm, np.float64(body.brightness)
            nearest = note_track(body, x, y, place, tracks)
        tracks[place + _RADIUS], tracks[place + _BRIGHTNESS], tracks[place + _DISC] = radius, brightness, disc
        track_count += nearest < (reach_mm + radius) * (reach_mm + radius)
    return track_count


@kernel
def disc_of(tracks: Any, k: Any) -> Any:
    """Return the disc of a track."""
    return np.int64(tracks[PER_TRACK * k + _DISC])


@kernel
def note_track(thing: Any, x: Any, y: Any, place: Any, tracks: Any) -> Any:
    """Write the track of a robot or body into `tracks`; return the smallest square of its distances [mm^2]."""
    tracks[place], tracks[place + 1] = thing.x_mm, thing.y_mm
    nearest = (thing.x_mm - x) * (thing.x_mm - x) + (thing.y_mm - y) * (thing.y_mm - y)
    for k in range(TRAIL_LENGTH):
        then_x, then_y = thing.trail[k, 0], thing.trail[k, 1]
        tracks[place + 2 * k + 2], tracks[place + 2 * k + 3] = then_x, then_y
        nearest = min(nearest, (then_x - x) * (then_x - x) + (then_y - y) * (then_y - y))
    return nearest


@kernel
def see(tracks: Any, count: Any, moment: Any, scale: Any, view: Any, seen: Any) -> Any:
    """List the discs in view at a moment; return their number.

    Args:
        tracks: Tracks of discs (`follow`).
        count: Number of discs.
        moment: The time (`kiks.engine.scene.moment_of`).
        scale: Edge of a cell [mm] and cells of the border around the arena.
        view: The place of the sensor, x and y [mm]; the directions, cosine and sine, of the leftmost and of the
            rightmost ray, (0, 0) for all directions; the range [mm].
        seen: float64 [`PER_DISC` * `count` at least].
    """
    ticks_ago, back = np.int64(moment[0]), moment[1]
    cell, pad = scale
    x, y, left, right, reach_mm = view
    per_cell = 1.0 / cell
    seen_count = 0
    for k in range(count):
        place = PER_TRACK * k
        later, earlier, radius = place + 2 * ticks_ago, place + 2 * ticks_ago + 2, tracks[place + _RADIUS]
        disc_x = tracks[later] + back * (tracks[earlier] - tracks[later])
        disc_y = tracks[later + 1] + back * (tracks[earlier + 1] - tracks[later + 1])
        dx, dy, far = disc_x - x, disc_y - y, reach_mm + radius
        # Distances of the centre beyond the edges of the view, which covers at most half a circle.
        beyond_left, beyond_right = dy * left[0] - dx * left[1], dx * right[1] - dy * right[0]
        if dx * dx + dy * dy < far * far and max(beyond_left, beyond_right) < radius:
            place = PER_DISC * seen_count
            seen[place], seen[place + 1] = disc_x * per_cell + pad, disc_y * per_cell + pad
            seen[place + 2], seen[place + 3] = radius * per_cell, tracks[PER_TRACK * k + _BRIGHTNESS]
            seen_count += 1
    return seen_count


@kernel
def meet_disc(seen: Any, count: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow one ray to the first disc.

    Args:
        seen: The discs.
        count: Number of discs.
        column: Origin [cells].
        row: Origin [cells].
        cosine: Direction.
        sine: Direction.
        reach: Longest length followed [cells].

    Returns:
        Length of the ray [cells], the cosine of the angle of incidence, and the brightness of the disc; `reach`, 1
        and 0 if the ray meets none.
    """
    length, squarely, brightness = reach, 1.0, 0.0
    for k in range(count):
        begin, cosine_in, is_met = enter_disc(seen, k, column, row, cosine, sine)
        if is_met and begin < length:
            length, squarely, brightness = begin, cosine_in, seen[PER_DISC * k + 3]
    return length, squarely, brightness


@kernel
def enter_disc(seen: Any, k: Any, column: Any, row: Any, cosine: Any, sine: Any) -> Any:
    """Return the length at which a ray enters a disc (0 from inside), the cosine of its incidence, and if it does."""
    dx, dy, radius = seen[PER_DISC * k] - column, seen[PER_DISC * k + 1] - row, seen[PER_DISC * k + 2]
    along, aside = dx * cosine + dy * sine, dx * sine - dy * cosine
    square = radius * radius - aside * aside
    half = math.sqrt(max(square, 0.0))
    return max(along - half, 0.0), half / radius, (square > 0.0) & (along + half > 0.0)


@kernel
def meet_discs(
    seen: Any, count: Any, column: Any, row: Any, cosines: Any, sines: Any, lengths: Any, squarely: Any, shades: Any
) -> Any:
    """Follow a sensor's rays to the first disc that each hits: `meet_disc` for all of them at once.

    Args:
        seen: The discs.
        count: Number of discs.
        column: Origin of all rays [cells].
        row: Origin of all rays [cells].
        cosines: Directions, `Lanes`, as are the others.
        sines: Directions.
        lengths: Lengths up to the walls [cells].
        squarely: Cosines of the angles of incidence there.
        shades: Brightnesses there.

    Returns:
        Lengths, cosines and brightnesses up to walls or discs.
    """
    for k in range(count):
        dx, dy, radius = seen[PER_DISC * k] - column, seen[PER_DISC * k + 1] - row, seen[PER_DISC * k + 2]
        along, aside = cosines * dx + sines * dy, sines * dx - cosines * dy
        square = radius * radius - aside * aside
        half = root(where_less(0.0, square, square, 0.0))
        begin = along - half
        begin = where_less(0.0, begin, begin, 0.0)
        begin = where_less(0.0, square, begin, _NEVER)
        begin = where_less(0.0, along + half, begin, _NEVER)
        squarely = where_less(begin, lengths, half / radius, squarely)
        shades = where_less(begin, lengths, seen[PER_DISC * k + 3], shades)
        lengths = where_less(begin, lengths, begin, lengths)
    return lengths, squarely, shades


@entry
def meet_discs_all(seen: Any, count: Any, cosines: Any, sines: Any, out: Any) -> Any:
    """Follow eight rays from (0, 0), for Python: `out`, shape [3, 8], holds the hits on walls, and then on all."""
    lengths, squarely, shades = meet_discs(
        seen, count, 0.0, 0.0, load(cosines), load(sines), load(out[0]), load(out[1]), load(out[2])
    )
    store(out[0], lengths)
    store(out[1], squarely)
    store(out[2], shades)


@kernel
def hides(seen: Any, k: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Return whether a disc is between the two ends of a ray; it does not hide a lamp that hangs over it."""
    dx, dy = seen[PER_DISC * k] - column, seen[PER_DISC * k + 1] - row
    radius = seen[PER_DISC * k + 2]
    along, aside = dx * cosine + dy * sine, dx * sine - dy * cosine
    is_over = aside * aside + (reach - along) * (reach - along) <= radius * radius
    return 0.0 < along < reach and abs(aside) < radius and not is_over


@kernel
def other_tracks(scene: Any, world: Any, itself: Any) -> Any:
    """Return the tracks of all discs of a world except one, their number, and memory for the visible discs."""
    limit = count_discs(scene)[1]
    found, tracks = np.empty(limit, np.int64), np.empty(PER_TRACK * limit, np.float64)
    count = find_near(scene, world, 0.0, 0.0, _ANYWHERE_MM, itself, found)
    count = follow(scene, world, found, count, 0.0, 0.0, _ANYWHERE_MM, tracks)
    return tracks, count, np.empty(PER_DISC * limit, np.float64)
