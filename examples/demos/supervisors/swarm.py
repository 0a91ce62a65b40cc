"""Measure how far the robots have spread."""

import math
from statistics import mean


def supervise(sim):
    at_start = apart_mm(sim)
    try:
        while True:
            yield 1.0
    finally:
        print(f"nearest neighbours {apart_mm(sim):.0f} mm apart, {at_start:.0f} mm at the start")


def apart_mm(sim):
    places = [(x_mm, y_mm) for x_mm, y_mm, _ in sim.poses()]
    return mean(min(math.dist(place, other) for other in places if other is not place) for place in places)
