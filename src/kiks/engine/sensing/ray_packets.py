"""Ray packets: the rays of proximity sensors in eight lanes each, of one sensor or of several at once.

A reading of eight sensors is mostly rays, and a ray mostly waits for memory. While one packet waits, others go on:
`enter` starts packets one by one, `step_all` lets them step in turn until all have ended, `met` returns the hits. The
steps of a packet do not depend on other packets, and so neither do its bits. They are in float32, relative to the cell
in which the packet begins (`kiks.engine.simd.lanes`).

From any point of a cell, a ray may go in any direction as far as the cell's square is from that of the nearest wall
(`kiks.model.arena.Arena.leaps`). So a step goes to the edge of the cell, and then that far: no corner is missed, and a
ray ends in a wall no deeper than by the nudge that takes it over the edge.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import inlined, kernel
from kiks.engine.simd.lanes import floor, load, narrow, store, wide
from kiks.engine.simd.masks import anywhere, choose
from kiks.engine.simd.rasters import faces_at, look_up
from kiks.model.raster import LEAPS_PER_CELL

PACKET_SIZE = 72
"""Numbers of a packet, float32: eight times eight, and its origin and reach."""

LONGEST = 16000.0
"""Longest ray [cells]: up to here a nudge still changes a float32, so no ray gets stuck."""

# Offsets of a packet's fields.
_DX, _DY, _PER_DX, _PER_DY, _RIGHT, _UP, _LENGTH, _MET, _REST = (8 * k for k in range(9))

_NUDGE = 1e-3  # over the edge of a cell [cells]
_GRAZING = 0.1  # cosine of an incidence below which a surface is not worth finding
_FAR = 1e30
_FLAT = 1e-10  # square of a direction's part along an axis below which it counts as none


@inlined
def enter(
    walls: Any, packets: Any, origins: Any, k: Any, column: Any, row: Any, rays_x: Any, rays_y: Any, reach: Any
) -> Any:
    """Start a packet.

    Args:
        walls: The walls as rays see them (`kiks.engine.sensing.rays`).
        packets: float32 [`PACKET_SIZE` per packet].
        origins: int64, one per packet.
        k: Index of the packet.
        column: Origin of its rays [cells].
        row: Origin of its rays [cells].
        rays_x: Directions, `Lanes`.
        rays_y: Directions, `Lanes`.
        reach: Longest length of a ray [cells].
    """
    field = walls.clearance
    # An origin outside the arena counts as in the wall around it, a cell from its edge: no lookup leaves the raster.
    i = np.int64(min(max(1.0, column), field.shape[1] - 2.0))
    j = np.int64(min(max(1.0, row), field.shape[0] - 2.0))
    x, y = min(max(0.0, column - i), 1.0), min(max(0.0, row - j), 1.0)
    origins[k] = j * field.shape[1] + i
    dx, dy = narrow(rays_x), narrow(rays_y)
    dx, dy = choose(dx * dx > _FLAT, dx, 0.0), choose(dy * dy > _FLAT, dy, 0.0)
    offset = k * PACKET_SIZE
    store(packets, dx, offset + _DX)
    store(packets, dy, offset + _DY)
    store(packets, choose(dx * dx > _FLAT, 1.0 / dx, _FAR), offset + _PER_DX)
    store(packets, choose(dy * dy > _FLAT, 1.0 / dy, _FAR), offset + _PER_DY)
    store(packets, choose(dx < 0.0, 0.0, narrow(1.0)) - x, offset + _RIGHT)
    store(packets, choose(dy < 0.0, 0.0, narrow(1.0)) - y, offset + _UP)
    store(packets, narrow(0.0), offset + _LENGTH)
    packets[offset + _REST], packets[offset + _REST + 1], packets[offset + _REST + 2] = x, y, min(LONGEST, reach)


@inlined
def step(leaps: Any, origin: Any, packets: Any, offset: Any, lengths: Any) -> Any:
    """Advance the rays of a packet by one step.

    Returns:
        The new lengths; and for each ray a number above 0 if it goes on, 0 if it is beyond its reach, or 1/2 minus the
        brightness of the wall that it hit.
    """
    columns = floor(packets[offset + _REST] + lengths * load(packets, offset + _DX))
    rows = floor(packets[offset + _REST + 1] + lengths * load(packets, offset + _DY))
    found = look_up(leaps, origin, columns, rows)
    to_column = (columns + load(packets, offset + _RIGHT)) * load(packets, offset + _PER_DX)
    to_row = (rows + load(packets, offset + _UP)) * load(packets, offset + _PER_DY)
    edge = min(to_row, to_column)
    onward = max(edge, lengths) + (found * (1.0 / LEAPS_PER_CELL) + _NUDGE)
    goes_on = choose(lengths < packets[offset + _REST + 2], found + 0.5, 0.0)
    return choose(goes_on > 0.0, onward, lengths), goes_on


@kernel
def step_all(walls: Any, packets: Any, origins: Any, under_way: Any, count: Any) -> Any:
    """Step packets until each ray has hit a wall or its reach; `under_way` is scratch memory, int64 [packet]."""
    leaps = walls.leaps
    for k in range(count):
        under_way[k] = k
    while count > 0:
        kept = 0
        for place_in_line in range(count):
            k = under_way[place_in_line]
            offset, origin = k * PACKET_SIZE, origins[k]
            lengths = load(packets, offset + _LENGTH)
            lengths, goes_on = step(leaps, origin, packets, offset, lengths)
            store(packets, lengths, offset + _LENGTH)
            store(packets, goes_on, offset + _MET)
            under_way[kept] = k
            kept += anywhere(goes_on > 0.0)
        count = kept


@inlined
def meet_faces(walls: Any, packets: Any, origin: Any, offset: Any, lengths: Any, shades: Any) -> Any:
    """Return the hits of rays on the smooth surface of a wall.

    Returns:
        Lengths of the rays [cells], at most a cell from the given ones, and cosines of the angles of incidence.
    """
    dx, dy = load(packets, offset + _DX), load(packets, offset + _DY)
    before = lengths - 2.0 * _NUDGE
    x, y = packets[offset + _REST] + before * dx, packets[offset + _REST + 1] + before * dy
    columns, rows = floor(x), floor(y)
    # A ray without a hit looks up its origin: another cell would cost a memory access.
    place_x, place_y = choose(shades > 0.0, columns, 0.0), choose(shades > 0.0, rows, 0.0)
    face_x, face_y, left = faces_at(walls.faces, origin, place_x, place_y)
    squarely = face_x * dx + face_y * dy
    left = left - (x - columns - 0.5) * face_x - (y - rows - 0.5) * face_y
    further = left / choose(squarely > _GRAZING, squarely, 1.0)
    further = max(-1.0, min(1.0, further))
    smooth, cosines = max(0.0, before + further), max(0.0, squarely)
    # A ray that begins in a wall or meets the tip of a corner between cells finds no surface.
    cosines = choose(face_x * face_x + face_y * face_y > 0.0, cosines, 1.0)
    found = choose(shades > 0.0, squarely, 0.0)
    return choose(found > _GRAZING, smooth, lengths), choose(shades > 0.0, cosines, 1.0)


@inlined
def met(walls: Any, has_faces: Any, packets: Any, origins: Any, k: Any) -> Any:
    """Return the hits of a packet that has ended.

    Returns:
        Lengths [cells], cosines of the angles of incidence (1 without surfaces), and brightnesses (0 for no hit),
        `Lanes`.
    """
    offset = k * PACKET_SIZE
    ended = load(packets, offset + _MET)
    shades = choose(ended < 0.0, 0.5 - ended, 0.0)
    lengths = choose(ended < 0.0, load(packets, offset + _LENGTH), packets[offset + _REST + 2])
    cosines = narrow(1.0)
    if has_faces and anywhere(shades > 0.0):
        lengths, cosines = meet_faces(walls, packets, origins[k], offset, lengths, shades)
    return wide(lengths), wide(cosines), wide(shades)


@inlined
def nothing_met(reach: Any) -> Any:
    """Return the hits of a packet whose rays meet nothing, as `met` does."""
    return wide(narrow(min(LONGEST, reach))), wide(narrow(1.0)), wide(narrow(0.0))
