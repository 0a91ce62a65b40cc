"""Lead the ball along an eight, 80 mm/s fast, and measure how well the robot watches it."""

import math
import random
from contextlib import suppress
from statistics import mean, pstdev

from kiks import ParameterError

PERIOD_S = 0.1
BALL_RAD_S = 0.2  # how fast the ball goes round: 30 s for an eight
IN_SIGHT_DEG = 18.0  # half of the camera's field of view


def supervise(sim):
    angle = 2 * math.pi * random.Random(sim.seed).random()
    balls = [each["number"] for each in sim.bodies() if each["what"] == 3]
    ball = balls[0] if balls else sim.add_ball(*place_at(sim, angle))
    off_deg, distances_mm = [], []
    try:
        while True:
            yield PERIOD_S
            there = next(each for each in sim.bodies() if each["number"] == ball)
            x_mm, y_mm, heading_rad = sim.pose(1)
            to_x, to_y = there["x_mm"] - x_mm, there["y_mm"] - y_mm
            off_deg.append(abs(math.degrees(math.remainder(math.atan2(to_y, to_x) - heading_rad, 2 * math.pi))))
            distances_mm.append(math.hypot(to_x, to_y))
            with suppress(ParameterError):  # if the robot is in the way, the ball waits
                sim.move_body(ball, *place_at(sim, angle + BALL_RAD_S * PERIOD_S))
                angle += BALL_RAD_S * PERIOD_S
    finally:
        seen = [index for index, off in enumerate(off_deg) if off < IN_SIGHT_DEG]
        if seen:
            away_mm = [distances_mm[index] for index in seen]
            print(
                f"ball in sight {len(seen) / len(off_deg):.0%} of the time, "
                f"{mean(off_deg[index] for index in seen):.1f} degrees off the middle, "
                f"{mean(away_mm):.0f} +- {pstdev(away_mm):.0f} mm away"
            )


def place_at(sim, angle):
    """Return a place on the eight [mm], rounded: the last bits of a sine differ between computers."""
    x_mm = sim.arena.width_mm * (0.5 + 0.3 * math.cos(angle))
    y_mm = sim.arena.height_mm * (0.5 + 0.26 * math.sin(2 * angle))
    return round(x_mm, 3), round(y_mm, 3)
