"""The battle turret, number 99, a fiction of the Matlab KiKS: where one is, what is ahead, and a gun.

Source: khepera-protocol.md 10.7 and kiks-behaviour.md 1.6. A shot costs 5 points of energy and takes 10 from a robot
with such a turret that it hits; a point comes back each second, up to the robot's radius in mm; there is no time to
reload.
Walls, balls, cylinders and robots stop a shot. A robot without points goes on driving.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from kiks.firmware.turret import Orders, Shape, Site, Turret, Values
from kiks.units import NS_PER_S

SHOT_POINTS = 5.0
"""Cost of a shot (kiks-behaviour.md 1.6)."""

HIT_POINTS = 10.0
"""Loss by a hit (kiks-behaviour.md 1.6)."""

POINTS_PER_S = 1.0
"""Recovery (kiks-behaviour.md 1.6)."""

DEGREES_PER_RAD = 57.29577951308232


def _fire(battle: Battle) -> Values:
    """F: fire. The robot that was hit or -1, and the distance from the robot's front [mm] or -1 for want of energy."""
    site = battle.site
    energy = battle.energy
    if energy < SHOT_POINTS:
        return (-1, -1)
    battle.energy = energy - SHOT_POINTS
    met = site.ray()
    hit = site.turrets(Battle).get(met.robot)
    if hit is not None:
        hit.energy = max(hit.energy - HIT_POINTS, 0.0)
        hit.site.record["battle_hits"] += 1
    return (met.robot or -1, battle.ahead_mm(met.distance_mm))


def _sense(battle: Battle) -> Values:
    """S: x, y [mm from the left and top], heading [degrees], what is free ahead [mm], energy [% and points], hits.

    Places are rounded: so they are the numbers of KiKS's columns and rows.
    """
    site = battle.site
    x_mm, y_mm, heading_rad = site.pose()
    hits = int(site.record["battle_hits"])
    site.record["battle_hits"] = 0
    return (
        int(x_mm + 0.5),
        int(site.arena_mm[1] - y_mm + 0.5),
        round(heading_rad * DEGREES_PER_RAD) % 360,
        battle.ahead_mm(site.ray().distance_mm),
        int(100.0 * battle.energy / battle.most),
        int(battle.energy),
        hits,
    )


class Battle(Turret):
    """A turret with a gun, a compass and a positioning system."""

    number = 99
    name = "Battle"
    orders: ClassVar[Orders] = {"F": (0, _fire), "S": (0, _sense)}

    def fit(self, site: Site) -> None:
        """Fit the turret to a robot, with full energy."""
        super().fit(site)
        self.energy = self.most
        site.record["battle_hits"] = 0

    @property
    def most(self) -> float:
        """Maximum energy of the robot [points]."""
        return self.site.spec.body.radius_mm

    @property
    def energy(self) -> float:
        """Present energy [points]."""
        record = self.site.record
        passed_ns = self.site.time_ns - int(record["battle_ns"])
        return min(float(record["battle_energy"]) + POINTS_PER_S * passed_ns / NS_PER_S, self.most)

    @energy.setter
    def energy(self, points: float) -> None:
        self.site.record["battle_energy"], self.site.record["battle_ns"] = points, self.site.time_ns

    def ahead_mm(self, distance_mm: float) -> int:
        """Convert a distance from the robot's centre to one from its front [mm]."""
        return max(int(distance_mm - self.site.spec.body.radius_mm), 0)

    def status(self) -> str:
        """Return its energy and the hits since the last query."""
        hits = int(self.site.record["battle_hits"])
        return f"energy {self.energy:.1f} of {self.most:g} points, hit {hits} times since the last query"

    def shapes(self) -> Sequence[Shape]:
        """Return a barrel, and a ring whose brightness shows the energy."""
        red = 60 + int(195.0 * self.energy / self.most)
        barrel = ((0.0, -3.0), (24.0, -3.0), (24.0, 3.0), (0.0, 3.0))
        return Shape(((0.0, 0.0),), f"#{red:02x}3030", 12.0), Shape(barrel, "#202020")
