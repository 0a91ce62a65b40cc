"""Take the times of the laps round the middle of the arena."""

import math


def supervise(sim):
    start = before = angle_of(sim)
    angle, laps_s = start, []
    try:
        while True:
            yield 0.02
            now = angle_of(sim)
            turned = math.remainder(now - before, 2 * math.pi)
            line, before, angle = start + 2 * math.pi * (len(laps_s) + 1), now, angle + turned
            if angle >= line:
                laps_s.append(sim.time_s - 0.02 * (angle - line) / turned)
                sim.set_score("laps", len(laps_s))
                sim.set_score("best lap", f"{best_of(laps_s):.2f} s")
    finally:
        print(f"{len(laps_s)} laps" + (f", the best in {best_of(laps_s):.2f} s" if laps_s else ""))


def best_of(laps_s):
    return min(end - begin for begin, end in zip([0.0, *laps_s], laps_s, strict=False))


def angle_of(sim):
    x_mm, y_mm, _ = sim.pose(1)
    return math.atan2(y_mm - sim.arena.height_mm / 2, x_mm - sim.arena.width_mm / 2)
