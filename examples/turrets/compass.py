"""A turret of one's own: a compass that can be set to zero. Run it, or copy it and change what it does.

`T,24,C` asks for the heading in whole degrees, `T,24,Z` makes the present heading zero.
"""

import math
from typing import ClassVar

import kiks
from kiks.firmware.turret import Orders, Shape, Turret


class Compass(Turret):
    """A compass; it remembers its zero in the robot's record, so that snapshots and hashes hold it."""

    number, name = 24, "Compass"
    memory_count = 1

    def read(self) -> tuple[int, ...]:
        """C: the heading, 0 to 359 degrees, counter-clockwise from zero."""
        _, _, heading_rad = self.site.pose()
        return (round(math.degrees(heading_rad - self.site.memory[0])) % 360,)

    def set_zero(self) -> tuple[int, ...]:
        """Z: call the present heading zero."""
        self.site.memory[0] = self.site.pose()[2]
        return ()

    orders: ClassVar[Orders] = {"C": (0, read), "Z": (0, set_zero)}

    def shapes(self) -> tuple[Shape, ...]:
        """Return a white disc."""
        return (Shape(((0.0, 0.0),), "#ffffff", radius_mm=8.0),)


if __name__ == "__main__":
    sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
    sim.place(1, 250, 250, math.radians(30))
    sim.fit(1, Compass())
    robot = kiks.Khepera(sim.port(1))
    print("heading", *robot.turret(24, "C"))
    robot.turret(24, "Z")
    robot.set_speed(-5, 5)
    sim.run(1.0)
    print("turned by", *robot.turret(24, "C"))
