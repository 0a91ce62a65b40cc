"""
A swarm at the light
====================

Twelve robots turn to the brighter side, and away from what is near. One program drives them all, each on a
line of its own. They meet at the lamp and stand around it, as near as the others let them.
"""

import numpy as np

import kiks


@kiks.controller(senses=("proximity", "ambient"))
def to_the_light(sensors, memory, parameters, wheels):
    near, light = sensors[:8], 1 - sensors[8:] / 500  # light: 0.1 in the dark, 1 in bright light
    turn = 6 * (max(light[3:6]) - max(light[0:3])) + 0.01 * (near[1] + near[2] - near[3] - near[4])
    ahead = 6 - 5 * max(light) - 0.006 * max(near[1:5])
    wheels[0], wheels[1] = ahead + turn, ahead - turn


sim = kiks.Simulation(kiks.Arena.box(900, 700, wall_mm=0), robots=12, seed=3)
sim.add_lamp(450, 350, 16.0)


def distance_mm():
    return np.hypot(*(sim.poses()[:, :2] - (450, 350)).T).mean()


print(f"At the start robots are {distance_mm():.0f} mm from the lamp, on average,")
with sim.record("swarm_at_the_light.mcap"):
    kiks.drive([sim.port(robot) for robot in range(1, 13)], to_the_light, seconds=40)
print(f"and {distance_mm():.0f} mm after 40 s.")
kiks.Recording("swarm_at_the_light.mcap").export("swarm_at_the_light.png")
