"""Kernels that follow single rays, for tests to call."""

from kiks.engine.compiling import entry
from kiks.engine.sensing.disc_rays import meet_discs
from kiks.engine.sensing.ray_packets import PACKET_SIZE, enter, met, step_all
from kiks.engine.sensing.rays import Walls, brightness_met, cast, cast_many
from kiks.engine.simd.lanes import load, store
from kiks.engine.simd.stack_arrays import stack_integers, stack_narrow


@entry
def cast_ray(walls, x, y, cosine, sine, reach):
    """Follow one ray from Python; lengths and places in mm of the arena."""
    walls = Walls(*walls)
    cell, pad = walls.cell_mm, walls.pad
    per_cell = 1.0 / cell
    ray = x * per_cell + pad, y * per_cell + pad, cosine, sine
    length, is_met = cast(walls, *ray, reach * per_cell)
    return (length * cell if is_met else reach), brightness_met(walls, *ray, length, is_met)


@entry
def cast_rays(walls, columns, rows, cosines, sines, lengths):
    """Follow many rays from Python, each to the first wall; lengths and places in cells."""
    cast_many(Walls(*walls), columns, rows, cosines, sines, lengths)


@entry
def cast_eight(walls, column, row, directions, reach, out):
    """Follow eight rays as a proximity sensor does, in cells: `directions` holds cosines and sines, shape [2, 8].

    `out`, shape [2, 8], gets lengths and brightnesses.
    """
    walls = Walls(*walls)
    ways, origins, under_way = stack_narrow(PACKET_SIZE), stack_integers(1), stack_integers(1)
    enter(walls, ways, origins, 0, column, row, load(directions[0]), load(directions[1]), reach)
    step_all(walls, ways, origins, under_way, 1)
    lengths, _, brightnesses = met(walls, False, ways, origins, 0)
    store(out[0], lengths)
    store(out[1], brightnesses)


@entry
def meet_discs_of(seen, count, cosines, sines, out):
    """Follow eight rays from (0, 0) to discs: `out`, shape [3, 8], holds the hits on walls, and then on all."""
    lengths, squarely, shades = meet_discs(
        seen, count, 0.0, 0.0, load(cosines), load(sines), load(out[0]), load(out[1]), load(out[2])
    )
    store(out[0], lengths)
    store(out[1], squarely)
    store(out[2], shades)


@entry
def meet_discs_alone(seen, count, cosine, sine, reach):
    """Follow one ray from (0, 0) to discs; return its hit."""
    return meet_discs(seen, count, 0.0, 0.0, cosine, sine, reach, 1.0, 0.0)
