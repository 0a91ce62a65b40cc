"""The linear camera K213: a row of 64 pixels over 36 degrees, with its lens, exposure and noise.

Source: khepera-protocol.md 10.3, kiks-behaviour.md 3.3 (whose constants were tuned by eye to the images in the K213's
manual) and thesis 3.4 ("Linear vision extension module").

Method: 64 rays from +18 to -18 degrees, the leftmost pixel first, from the robot's centre; the view begins 50 mm from
it. A ray ends at the first surface, whose brightness 1..255 becomes a grey of 50..245. Then, in this order: the lens
blurs distant surfaces, the exposure adapts to the scene, the converter adds noise, the picture darkens towards its
edges, motion smears it, and the line adds noise. How much, and whether the exposure adapts, is a matter of the robot's
file (`kiks.model.robot.Camera`).

Blur: each pixel becomes the mean over an interval of the row, with a width of its own [pixels].

* Lens. Sharp to D = 250 mm. Beyond, the circle of confusion of a lens grows like 1/D - 1/d, so the interval reaches
  7 (1 - D/d) pixels to each side: 3.5 at 500 mm, where KiKS 2.2.0 takes the mean of 7 pixels, and 7 at any distance.
* Motion. While the picture is exposed for the time T, a wall at the distance d and the angle a moves across the row
  by (turn - way sin(a)/d) / pixel angle, and driving shakes the turret. T and the shaking are chosen so that a robot
  at usual speeds gets about the widths of KiKS 2.2.0: 6 pixels straight on, 8 when it turns.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from kiks.engine.compiling import entry, kernel, linked
from kiks.engine.numbers import at_instant, draw, sin_cos, stream_of
from kiks.engine.physics.motion import moment_of
from kiks.engine.scene import OPEN_SCENE, open_scene
from kiks.engine.sensing.disc_rays import meet_discs, other_tracks, see_all
from kiks.engine.sensing.proximity import pose_at
from kiks.engine.sensing.rays import ENDLESS, brightness_met, cast, cast_many, free_cells
from kiks.engine.simd.stack_arrays import stack_floats
from kiks.engine.state import PIXEL_COUNT
from kiks.units import TICK_NS

STREAM_CAMERA = 5
"""Random stream of the noise on images."""

_EDGE_DEG = 18.0
_PIXEL_DEG = 2.0 * _EDGE_DEG / (PIXEL_COUNT - 1)
_SUM_COUNT, _CHANCE_COUNT = PIXEL_COUNT + 1, 3 * PIXEL_COUNT
_PIXEL_RAD = 0.009973310011396168  # 36/63 degrees
_PIXEL_COS, _PIXEL_SIN = 0.999950266955943, 0.009973144676492593
_EDGE_COS, _EDGE_SIN = 0.9510565162951535, 0.3090169943749474

_BEGIN_MM = 50.0
_NEAREST_MM = 1e-3  # a camera within a wall
_SHARP_MM = 250.0
_DEFOCUS_PIXELS = 7.0  # to each side, at infinite distance

_BLACK, _WHITE = 50.0, 245.0  # greys of the blackest and the whitest wall
_DARKEN = 10.0  # subtracted by the exposure in a scene without black
_NOISE = 10.0  # of the converter, to each side

_EXPOSURE_TICKS = 5.0  # 50 ms, the shortest reading period
_SHAKE_PIXELS_PER_MM, _SHAKE_PIXELS = 1.5, 6.0  # per path during the exposure, and at most


@kernel
def integral(sums: Any, grey: Any, place: Any) -> Any:
    """Return the integral of a row of pixels from its left edge to a place; the edges continue outside."""
    last = grey.shape[0]
    if not place > 0.0:
        return place * grey[0]
    if place >= last:
        return sums[last] + (place - last) * grey[last - 1]
    i = np.int64(place)
    return sums[i] + (place - i) * grey[i]


@kernel
def smear(grey: Any, half_width: Any) -> Any:
    """Replace each pixel by the mean over its own interval of the row: `half_width` pixels to each side of its middle.

    Half a pixel is no blur. All means come from one running sum, so wide intervals cost as much as narrow ones.
    """
    sums, mean = stack_floats(_SUM_COUNT), stack_floats(PIXEL_COUNT)
    sums[0] = 0.0
    for p in range(PIXEL_COUNT):
        sums[p + 1] = sums[p] + grey[p]
    for p in range(PIXEL_COUNT):
        low, high = p + 0.5 - half_width[p], p + 0.5 + half_width[p]
        mean[p] = (integral(sums, grey, high) - integral(sums, grey, low)) / (2.0 * half_width[p])
    for p in range(PIXEL_COUNT):
        grey[p] = mean[p]


@kernel
def look(walls: Any, seen: Any, seen_count: Any, x: Any, y: Any, heading: Any, grey: Any, distance_mm: Any) -> Any:
    """Write the grey of the surface that each pixel sees, and its distance from the robot's centre [mm]."""
    cell, pad = walls.cell_mm, walls.pad
    per_cell = 1.0 / cell
    column, row = x * per_cell + pad, y * per_cell + pad
    begin = max(_BEGIN_MM * per_cell, free_cells(walls, column, row))
    begin_columns, begin_rows = stack_floats(PIXEL_COUNT), stack_floats(PIXEL_COUNT)
    rays_x, rays_y = stack_floats(PIXEL_COUNT), stack_floats(PIXEL_COUNT)
    lengths = stack_floats(PIXEL_COUNT)
    sine, cosine = sin_cos(heading)
    ray_x = cosine * _EDGE_COS - sine * _EDGE_SIN
    ray_y = sine * _EDGE_COS + cosine * _EDGE_SIN
    for p in range(PIXEL_COUNT):
        rays_x[p], rays_y[p] = ray_x, ray_y
        begin_columns[p], begin_rows[p] = column + begin * ray_x, row + begin * ray_y
        # Clockwise to the next pixel.
        ray_x, ray_y = ray_x * _PIXEL_COS + ray_y * _PIXEL_SIN, ray_y * _PIXEL_COS - ray_x * _PIXEL_SIN
    cast_many(walls, begin_columns, begin_rows, rays_x, rays_y, lengths)
    for p in range(PIXEL_COUNT):
        start, length, ray = begin, lengths[p], (rays_x[p], rays_y[p])
        brightness = 1.0 * brightness_met(walls, begin_columns[p], begin_rows[p], *ray, length, True)
        if length == 0.0:  # the view begins inside a wall: the pixel sees its surface
            start = 0.0
            length, is_met = cast(walls, column, row, *ray, ENDLESS)
            brightness = 1.0 * brightness_met(walls, column, row, *ray, length, is_met)
        if seen_count > 0:
            limit = start + length
            to_disc, _, shade = meet_discs(seen, seen_count, column, row, *ray, limit, 1.0, 0.0)
            if shade > 0.0:
                start, length, brightness = 0.0, to_disc, shade
        grey[p] = _BLACK + brightness * ((_WHITE - _BLACK) / 255.0)
        distance_mm[p] = max(_NEAREST_MM, (start + length) * cell)


@kernel
def expose(grey: Any) -> Any:
    """Adapt the exposure: the brightest pixel becomes white, and a scene without black becomes slightly darker."""
    brightest, darkest = grey.max(), grey.min()
    grey += max(_WHITE - brightest, 0.0) - min(max(darkest - _BLACK, 0.0), _DARKEN)


@kernel
def darken_edges(grey: Any, chance: Any) -> Any:
    """Limit the greys by a ceiling that falls towards the edges: 240 in the middle, 132 at 18 degrees.

    Args:
        grey: The greys, float64 [64].
        chance: A random number from 0 to 1 for each pixel, float64 [64].
    """
    for p in range(PIXEL_COUNT):
        angle = abs(_EDGE_DEG - p * _PIXEL_DEG)
        share = angle / _EDGE_DEG
        ceiling = 240.0 - 6.0 * angle * share * math.sqrt(share)
        if angle > 5.0 and grey[p] > ceiling:
            grey[p] = ceiling + _NOISE * (2.0 * chance[p] - 1.0)


@linked(types.int64(OPEN_SCENE, *(types.int64,) * 4, types.boolean, types.float64[::1]), _nrt=True)
def take_image_in(scene: Any, world: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Write the image of a robot's camera at a time into `out` and return its light level.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        world: Index of the world.
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: Time [ns], at most 10 ms before the end of the last tick.
        is_noisy: False for the expected image, without rounding; motion smears that, too.
        out: float64, shape [64]: greys 0..255, the leftmost pixel first.

    Returns:
        The reading of the light detector, larger for a darker scene.
    """
    state = scene.robots[world, robot]
    parameters = scene.kinds[state.kind]
    x, y, heading = pose_at(state, tick_count, time_ns)
    x_before, y_before, heading_before = pose_at(state, tick_count, time_ns - TICK_NS)
    sine, cosine = sin_cos(heading)
    way_mm = ((x - x_before) * cosine + (y - y_before) * sine) * _EXPOSURE_TICKS
    turn = (heading - heading_before) * _EXPOSURE_TICKS

    # Three random numbers per pixel; their means for an expected image.
    chance = stack_floats(_CHANCE_COUNT)
    chance[:] = 0.5
    flicker = 0.5
    if is_noisy:
        origin = at_instant(stream_of(scene.seeds[world], 0, robot, STREAM_CAMERA), time_ns)
        flicker = draw(origin, 3 * PIXEL_COUNT)
        for number in range(_CHANCE_COUNT):
            chance[number] = draw(origin, number)

    distance_mm, half_width = stack_floats(PIXEL_COUNT), stack_floats(PIXEL_COUNT)
    tracks, count, seen = other_tracks(scene, world, robot)
    see_all(scene.walls, tracks, count, moment_of(tick_count, 1.0 * time_ns), seen)
    look(scene.walls, seen, count, x, y, heading, out, distance_mm)
    for p in range(PIXEL_COUNT):
        half_width[p] = 0.5 + _DEFOCUS_PIXELS * max(1.0 - _SHARP_MM / distance_mm[p], 0.0)
    if distance_mm.max() > _SHARP_MM:
        smear(out, half_width)
    brightest = out.max()
    light = (255.0 - brightest) * 7.0 + 175.0 + 50.0 * flicker + (brightest - out.mean())

    if parameters.adapts_exposure:
        expose(out)
    for p in range(PIXEL_COUNT):
        out[p] += _NOISE * (2.0 * chance[p] - 1.0)
    darken_edges(out, chance[PIXEL_COUNT:])

    if way_mm != 0.0 or turn != 0.0:
        shake = min(_SHAKE_PIXELS_PER_MM * abs(way_mm), _SHAKE_PIXELS)
        for p in range(PIXEL_COUNT):
            sine = _EDGE_SIN * (1.0 - p * (2.0 / (PIXEL_COUNT - 1)))  # of the pixel's angle, within 1 %
            # Driving moves surfaces on the left to the left of the picture; a left turn moves all to the right.
            shift = abs(turn - way_mm * sine / distance_mm[p]) / _PIXEL_RAD
            half_width[p] = 0.5 + 0.5 * (shake + shift)
        smear(out, half_width)
    # At rest, too, each pixel takes a quarter from either neighbour.
    before, line_noise = out[0], parameters.camera_noise_share
    for p in range(PIXEL_COUNT):
        here = out[p]
        out[p] = 0.25 * before + 0.5 * here + 0.25 * out[min(p + 1, PIXEL_COUNT - 1)]
        before = here
    for p in range(PIXEL_COUNT):
        out[p] = (1.0 - line_noise) * out[p] + line_noise * 255.0 * chance[2 * PIXEL_COUNT + p]
        if is_noisy:
            out[p] = min(max(0.0, np.floor(out[p] + 0.5)), 255.0)
    return np.int64(np.floor(light + 0.5))


@entry
def take_image(scene: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Call `take_image_in` for the first world of a scene."""
    return take_image_in(open_scene(scene[0]), 0, robot, tick_count, time_ns, is_noisy, out)
