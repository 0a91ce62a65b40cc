"""Braitenberg vehicles: the weights that K-Team and Webots ship, and vehicles 2a, 2b, 3a and 3b at a lamp."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from findings import Finding, command, path_of

import kiks
from kiks.batch.initial_state import random_starts
from kiks.export.figures import column_figure, draw_paths
from kiks.model.arena_objects import Lamp, Pose
from kiks.model.shipped import shipped_arena

LAMP = (400.0, 400.0)
PLACES = [Pose(150, 200, 0.0), Pose(150, 600, 0.0), Pose(650, 250, math.pi), Pose(650, 550, math.pi)]
DARK_ROOM = replace(kiks.Arena.box(800, 800, wall_mm=0), lamps=(Lamp(*LAMP, 10.0),))
TITLES = {
    "k-team": "K-Team",
    "webots": "Webots",
    "2a": "2a, fear",
    "2b": "2b, aggression",
    "3a": "3a, love",
    "3b": "3b, exploration",
}
WEBOTS_FASTER = 8.0  # what the speeds of Webots are multiplied by

STUCK = 0.1  # of `roaming`: a robot that gets away more slowly than 8 mm/s stays where it is


def vehicle(rest, left, right, sense="proximity", speed_limit=10.0):
    """Return a vehicle as a champion: wheel = rest + sum of weight times reading, as shares of a speed limit.

    Weights are for readings as shares of the largest, sensor by sensor.
    """
    weights = np.column_stack([left, right]).ravel().tolist()
    return kiks.Champion(kiks.controllers.linear(senses=(sense,), speed_limit=speed_limit), (rest, rest, *weights))


def of_k_team():
    """kBraitenberg.m of K-Team's kMatlab, August 1998: (sum of weight x reading / 400 + 20) x 0.7 units."""
    limit, scale = 127.0, 0.7 * 1023.0 / 400.0 / 127.0
    left, right = np.array([4, 4, 6, -18, -15, -5, 5, 3]), np.array([-5, -15, -18, 6, 4, 4, 3, 5])
    return vehicle(0.7 * 20.0 / limit, scale * left, scale * right, speed_limit=limit)


def of_webots():
    """braitenberg.c of Webots: sum of weight x (1 - reading / 512), cut to +-1 rad/s of a wheel of 7.5 mm.

    That is 7.5 mm/s, less than the smallest speed on the wire: all speeds are `WEBOTS_FASTER` times as high here.
    """
    left, right = np.array([-2, -3, -7, 7, 5, 4, -0.5, -0.5]), np.array([4, 5, 7, -6, -4, -2, -0.5, -0.5])
    scale = -1023.0 / 512.0
    return vehicle(float(left.sum()), scale * left, scale * right, speed_limit=WEBOTS_FASTER * 7.5 / 8.0)


def of_book(rest, same, other):
    """V. Braitenberg, Vehicles, 1984: a wheel's speed at rest, and what light on its own and the other side adds.

    The book has no numbers: these are our own.
    """
    left, right = [same] * 3 + [other] * 3 + [0.0] * 2, [other] * 3 + [same] * 3 + [0.0] * 2
    return vehicle(rest, left, right, sense="ambient")


VEHICLES = {
    "k-team": of_k_team(),
    "webots": of_webots(),
    "2a": of_book(0.08, 0.4, 0.0),
    "2b": of_book(0.08, 0.0, 0.4),
    "3a": of_book(0.7, -0.4, 0.0),
    "3b": of_book(0.7, 0.0, -0.4),
}


def main(out: Path = Path("braitenberg.pdf"), starts: int = 200, seconds: float = 60.0) -> list[Finding]:
    """Drive six vehicles, draw their paths, and say where they end."""
    room = shipped_arena("training/pillars")
    findings = []
    free = kiks.Batch(kiks.Arena.box(3000, 3000), 1, seed=1)
    begins = random_starts(room, starts, seed=1, robots=1)
    crowd = kiks.Batch(room, starts, seed=1, starts=begins)
    places = [replace(room, starts=(Pose(*pose),)) for pose in begins[:2, 0].tolist()]
    measures = [kiks.measures.contacts, kiks.measures.roaming, kiks.measures.speed_pulses]
    with column_figure(out, 128, nrows=3, ncols=2) as panels:
        for (name, driver), axes in zip(VEHICLES.items(), panels.flat):
            axes.set_title(TITLES[name])
            if name[0] in "23":
                paths = [path_of(driver, 25.0, arena=replace(DARK_ROOM, starts=(place,)), seed=1) for place in PLACES]
                draw_paths(axes, DARK_ROOM, paths)
                from_lamp = [np.hypot(*(path[:, :2] - LAMP).T) for path in paths]
                nearest, last = ([pick(each) for each in from_lamp] for pick in (min, lambda each: each[-1]))
                text = f"{min(nearest):.0f} to {max(nearest):.0f}; at the end {min(last):.0f} to {max(last):.0f}"
                findings.append(Finding(f"{name}: nearest to the lamp [mm]", "", text))
                continue
            draw_paths(axes, room, [path_of(driver, seconds, arena=place, seed=1) for place in places])
            (speed,) = free.run(driver.controller, driver.parameters, seconds=5, measures=measures).values[0, :, 2]
            values = crowd.run(driver.controller, driver.parameters, seconds=seconds, measures=measures).values[:, 0]
            known = {"k-team": "112 (computed)", "webots": "7.5 (computed); here eight times as fast"}[name]
            findings += [
                Finding(f"{name}: speed in free space [mm/s]", known, float(8.0 * speed), 0),
                Finding(f"{name}: contacts in {seconds:.0f} s", "", f"{values[:, 0].mean():.1f} on average"),
                Finding(f"{name}: stays in one place", "", f"{(values[:, 1] < STUCK).sum()} of {starts} starts"),
            ]
    return findings


if __name__ == "__main__":
    command(main)
