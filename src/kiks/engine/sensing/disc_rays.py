"""Rays and discs: robots, balls and cylinders at the instant of a reading.

Derivation: from a ray's origin let b be the path along it to the point nearest to the disc's centre, and h the distance
of the two there. The ray enters a disc of radius r at b - w with w^2 = r^2 - h^2; there the angle between its direction
and the disc's normal has the cosine w/r.

A reading first lists the tracks of nearby discs: their places at the last tick boundaries. Each sensor has an instant
of its own, and from the tracks it gets the discs that it sees, each with column, row and radius [cells], and shade. A
shade above 0 is the brightness of a plain disc. One below 0 is that of a striped robot: it holds the number of stripes
and the heading (`shade_of`), so plain discs cost nothing more.

Stripes: n black and n white ones stand around a robot, the middle of a black one ahead. So the point at the angle a
from ahead is black where cos(n a) > 0. With z = cos(a) + i sin(a), that is the real part of z^n: multiplications alone,
in lanes as well.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import allocating, inlined, kernel
from kiks.engine.grid import count_discs, is_on_floor
from kiks.engine.numbers import sin_cos
from kiks.engine.simd.lanes import LANES, root, store
from kiks.engine.simd.masks import anywhere, choose
from kiks.engine.state import TRAIL_LENGTH

SEEN_LIMIT = 96
"""Most discs that proximity sensors take into account: more than fit within their range."""

PER_DISC = 4
"""Numbers per visible disc."""

PER_SEEN = 32
"""Numbers of a disc that eight sensors may see: for each sensor column, row, and 1 if it sees it; radius, and shade."""

SEEN_TOGETHER = 128
"""Most such discs of robots that are read together."""

SEEN_SIZE = PER_SEEN * SEEN_TOGETHER
"""Numbers for them."""

PER_TRACK = 2 * (TRAIL_LENGTH + 1) + 3
"""Numbers of a track: x and y [mm] now and at the past tick boundaries, radius [mm], shade, and the disc."""

TRACKS_SIZE = 1056
"""Numbers for `SEEN_LIMIT` tracks."""

_ANYWHERE_MM = 1e6

_BLACK_STRIPE, _WHITE_STRIPE = 1.0, 255.0
_TURN_RAD = 2.0 * math.pi
_CODE_RAD = 8.0  # more than a turn

_RADIUS, _SHADE, _DISC = (2 * (TRAIL_LENGTH + 1) + k for k in range(3))


@kernel
def follow(scene: Any, world: Any, found: Any, count: Any, x: Any, y: Any, reach_mm: Any, tracks: Any) -> Any:
    """List the tracks of discs that may have been within reach of a place; return their number.

    Args:
        scene: The scene.
        world: Index of the world.
        found: Candidate discs, int64, as `kiks.engine.scene.find_near` writes them.
        count: Number of candidates.
        x: The place [mm].
        y: The place [mm].
        reach_mm: Largest distance of an edge [mm].
        tracks: float64 [`PER_TRACK` per track]; further discs are left out.
    """
    robots, bodies, kinds = scene.robots, scene.bodies, scene.kinds
    track_count, limit = 0, tracks.shape[0] // PER_TRACK
    for k in range(count):
        # More do not fit within the range of proximity sensors.
        if track_count == limit:
            break
        disc, place = found[k], PER_TRACK * track_count
        if disc < robots.shape[1]:
            robot = robots[world, disc]
            radius, shade = kinds[robot.kind].radius_mm, shade_of(kinds[robot.kind], robot)
            moved_mm = note_track(robot, place, tracks)
        else:
            body = bodies[world, disc - robots.shape[1]]
            radius, shade = body.radius_mm, np.float64(body.brightness)
            moved_mm = note_track(body, place, tracks)
        tracks[place + _RADIUS], tracks[place + _SHADE], tracks[place + _DISC] = radius, shade, disc
        dx, dy, far = tracks[place] - x, tracks[place + 1] - y, reach_mm + radius + moved_mm
        track_count += dx * dx + dy * dy < far * far
    return track_count


@inlined
def shade_of(parameters: Any, robot: Any) -> Any:
    """Return the shade of a robot. Stripes are those of its present heading, at most 20 ms after a sensor's instant."""
    if parameters.stripe_count == 0:
        return np.float64(parameters.brightness)
    turn = robot.heading_rad - _TURN_RAD * np.floor(robot.heading_rad / _TURN_RAD)
    return -(_CODE_RAD * parameters.stripe_count + turn)


@kernel
def stripe_at(shade: Any, ahead: Any, aside: Any) -> Any:
    """Return the brightness of a striped robot at a place of its rim, or at eight of them, in lanes.

    Args:
        shade: Its shade.
        ahead: The place in the direction of x, from its centre [radii].
        aside: The place in the direction of y.
    """
    count = np.int64(-shade / _CODE_RAD)
    sine, cosine = sin_cos(-shade - _CODE_RAD * count)
    ahead, aside = ahead * cosine + aside * sine, aside * cosine - ahead * sine
    real, imaginary = ahead, aside
    for _ in range(count - 1):
        real, imaginary = real * ahead - imaginary * aside, real * aside + imaginary * ahead
    return choose(real > 0.0, _BLACK_STRIPE, _WHITE_STRIPE)


@kernel
def disc_of(tracks: Any, k: Any) -> Any:
    """Return the disc of a track."""
    return np.int64(tracks[PER_TRACK * k + _DISC])


@inlined
def note_track(thing: Any, place: Any, tracks: Any) -> Any:
    """Write the track of a robot or body into `tracks`; return how far from its place it has ever been [mm]."""
    tracks[place], tracks[place + 1] = thing.x_mm, thing.y_mm
    for k in range(TRAIL_LENGTH):
        tracks[place + 2 * k + 2], tracks[place + 2 * k + 3] = thing.trail[k, 0], thing.trail[k, 1]
    return moved_of(thing)


@inlined
def moved_of(thing: Any) -> Any:
    """Return a distance from its place within which a robot or body has been since its track begins [mm]."""
    farthest = 0.0
    for k in range(TRAIL_LENGTH):
        dx, dy = thing.trail[k, 0] - thing.x_mm, thing.trail[k, 1] - thing.y_mm
        farthest = max(farthest, abs(dx) + abs(dy))
    return farthest


@inlined
def moved_at(scene: Any, world: Any, disc: Any) -> Any:
    """Return the same of a disc."""
    if disc < scene.robots.shape[1]:
        return moved_of(scene.robots[world, disc])
    return moved_of(scene.bodies[world, disc - scene.robots.shape[1]])


@inlined
def place_then(tracks: Any, k: Any, moment: Any) -> Any:
    """Return where the disc of a track was at a moment, x and y [mm]; at eight of them, `Lanes`."""
    ticks_ago, back = moment
    track = PER_TRACK * k
    later_x, later_y = 0.0 * back + tracks[track], 0.0 * back + tracks[track + 1]
    earlier_x, earlier_y = 0.0 * back + tracks[track + 2], 0.0 * back + tracks[track + 3]
    for ago in range(1, TRAIL_LENGTH):
        place = track + 2 * ago
        is_then = ticks_ago == ago
        later_x = choose(is_then, tracks[place], later_x)
        later_y = choose(is_then, tracks[place + 1], later_y)
        earlier_x = choose(is_then, tracks[place + 2], earlier_x)
        earlier_y = choose(is_then, tracks[place + 3], earlier_y)
    return later_x + back * (earlier_x - later_x), later_y + back * (earlier_y - later_y)


@kernel
def see_all(walls: Any, tracks: Any, count: Any, moment: Any, seen: Any) -> Any:
    """List where all discs were at a moment; `seen` is float64 [`PER_DISC` * `count` at least]."""
    per_cell = 1.0 / walls.cell_mm
    for k in range(count):
        x, y = place_then(tracks, k, moment)
        its = PER_DISC * k
        seen[its], seen[its + 1] = x * per_cell + walls.pad, y * per_cell + walls.pad
        seen[its + 2], seen[its + 3] = tracks[PER_TRACK * k + _RADIUS] * per_cell, tracks[PER_TRACK * k + _SHADE]


@kernel
def see(walls: Any, tracks: Any, first: Any, end: Any, moments: Any, view: Any, seen: Any, place: Any) -> Any:
    """Add the discs that any of eight sensors sees to a list.

    Args:
        walls: The walls as rays see them, for their scale.
        tracks: Tracks of discs (`follow`).
        first: The first of the tracks to look at.
        end: The first one not to look at.
        moments: The time of each sensor, `Lanes` (`kiks.engine.physics.motion.moment_of`).
        view: The places of the sensors, x and y [mm]; the directions, cosine and sine, of the leftmost and of the
            rightmost rays; all `Lanes`; and the range [mm] (`kiks.engine.sensing.proximity.view_of`).
        seen: The list, float64 [`PER_SEEN` per disc].
        place: Number of discs in it.

    Returns:
        The new number of discs, and a mask of the sensors that see any of the new ones.
    """
    x, y, left, right, reach_mm = view[:5]
    per_cell, is_any = 1.0 / walls.cell_mm, x < x
    for k in range(first, end):
        disc_x, disc_y = place_then(tracks, k, moments)
        radius = tracks[PER_TRACK * k + _RADIUS]
        dx, dy, far = disc_x - x, disc_y - y, reach_mm + radius
        # Distances of the centre beyond the edges of the view, which covers at most half a circle.
        beyond_left, beyond_right = dy * left[0] - dx * left[1], dx * right[1] - dy * right[0]
        is_seen = (dx * dx + dy * dy < far * far) & (max(beyond_left, beyond_right) < radius)
        if anywhere(is_seen):
            its = PER_SEEN * place
            store(seen, disc_x * per_cell + walls.pad, its)
            store(seen, disc_y * per_cell + walls.pad, its + LANES)
            store(seen, choose(is_seen, 1.0, 0.0), its + 2 * LANES)
            seen[its + 3 * LANES] = radius * per_cell
            seen[its + 3 * LANES + 1] = tracks[PER_TRACK * k + _SHADE]
            place += 1
            is_any = is_any | is_seen
    return place, is_any


@inlined
def sees(seen: Any, k: Any, sensor: Any) -> Any:
    """Return whether a sensor sees a disc of the list of `see`."""
    return seen[PER_SEEN * k + 2 * LANES + sensor] > 0.0


@inlined
def seen_by(seen: Any, k: Any, sensor: Any) -> Any:
    """Return column, row, radius and shade of a disc of the list of `see`, as a sensor sees it."""
    its = PER_SEEN * k
    return seen[its + sensor], seen[its + LANES + sensor], seen[its + 3 * LANES], seen[its + 3 * LANES + 1]


@inlined
def meet_disc(disc: Any, column: Any, row: Any, cosine: Any, sine: Any, length: Any, squarely: Any, shade: Any) -> Any:
    """Follow a ray to a disc, column, row, radius and shade; other arguments and results are those of `meet_discs`."""
    disc_column, disc_row, radius, its_shade = disc
    dx, dy = disc_column - column, disc_row - row
    along, aside = cosine * dx + sine * dy, sine * dx - cosine * dy
    square = radius * radius - aside * aside
    half = root(max(0.0, square))
    # From inside it is met at once.
    begin = max(0.0, along - half)
    is_first = (square > 0.0) & (along + half > 0.0) & (begin < length)
    squarely = choose(is_first, half / radius, squarely)
    shade = choose(is_first, its_shade, shade)
    # Only a striped robot needs the place on its rim.
    if its_shade < 0.0:
        per_radius = 1.0 / radius
        ahead = (column + begin * cosine - disc_column) * per_radius
        aside = (row + begin * sine - disc_row) * per_radius
        shade = choose(is_first, stripe_at(its_shade, ahead, aside), shade)
    return choose(is_first, begin, length), squarely, shade


@kernel
def meet_discs(
    seen: Any, count: Any, column: Any, row: Any, cosine: Any, sine: Any, length: Any, squarely: Any, shade: Any
) -> Any:
    """Follow a ray to the first disc that it meets, or eight rays of one origin, in lanes.

    Args:
        seen: The discs (`see_all`).
        count: Number of discs.
        column: Origin [cells].
        row: Origin [cells].
        cosine: Direction, a number or lanes, as are the others.
        sine: Direction.
        length: Length up to the wall, or the longest to be followed [cells].
        squarely: Cosine of the angle of incidence there.
        shade: Brightness there.

    Returns:
        Length, cosine and brightness up to the wall or the first disc before it.
    """
    for k in range(count):
        its = PER_DISC * k
        disc = seen[its], seen[its + 1], seen[its + 2], seen[its + 3]
        length, squarely, shade = meet_disc(disc, column, row, cosine, sine, length, squarely, shade)
    return length, squarely, shade


@kernel
def hides(seen: Any, k: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Return whether a disc is between the two ends of a ray; it does not hide a lamp that hangs over it."""
    dx, dy = seen[PER_DISC * k] - column, seen[PER_DISC * k + 1] - row
    radius = seen[PER_DISC * k + 2]
    along, aside = dx * cosine + dy * sine, dx * sine - dy * cosine
    is_over = aside * aside + (reach - along) * (reach - along) <= radius * radius
    return 0.0 < along < reach and abs(aside) < radius and not is_over


@allocating
def other_tracks(scene: Any, world: Any, itself: Any) -> Any:
    """Return the tracks of all discs of a world except one, their number, and memory for the visible discs."""
    found, count = np.empty(count_discs(scene)[1], np.int64), 0
    for disc in range(found.shape[0]):
        if disc != itself and is_on_floor(scene, world, disc):
            found[count] = disc
            count += 1
    return note_tracks(scene, world, found, count)


@allocating
def note_tracks(scene: Any, world: Any, found: Any, count: Any) -> Any:
    """Return the tracks of some discs, their number, and memory for the visible discs."""
    tracks = np.empty(PER_TRACK * count, np.float64)
    count = follow(scene, world, found, count, 0.0, 0.0, _ANYWHERE_MM, tracks)
    return tracks, count, np.empty(PER_DISC * count, np.float64)
