"""
A film
======

Four robots and five balls. A recording becomes a film by the ending of its name: ``.webp`` plays in any page,
``.mp4`` in any player. Films need PyAV: ``pip install 'kiks[film]'``.
"""

import kiks


@kiks.controller
def wander(sensors, memory, parameters, wheels):
    near = sensors[1] + 2 * sensors[2] - 2 * sensors[3] - sensors[4]
    wheels[0], wheels[1] = 10 + near / 100, 10 - near / 100


sim = kiks.Simulation(kiks.Arena.box(800, 500, rounded_mm=120), robots=4, seed=2)
for robot, x_mm in enumerate((220, 340, 460, 580), start=1):
    sim.place(robot, x_mm, 100 if robot % 2 else 400, 1.0)

for x_mm in (160, 280, 400, 520, 640):
    sim.add_ball(x_mm, 250, brightness="white")
with sim.record("film.mcap"):
    kiks.drive([sim.port(robot) for robot in range(1, 5)], wander, seconds=24)

kiks.Recording("film.mcap").export("film.webp", size=(640, 360), fps=10, speed=3)
print(f"{sim.distances_mm()[:, 0].sum() / 1000:.1f} m driven")
