"""
Braitenberg's vehicles
======================

Two light sensors and two motors, and four ways to connect them: to the wheel on the same side or on the other
one, to drive faster or slower in light. Braitenberg (1984) called what they do fear, aggression, love and
exploration. Each drives from four places.
"""

import math

import matplotlib.pyplot as plt

import kiks


@kiks.controller(senses=("ambient",), parameters=3)
def vehicle(sensors, memory, parameters, wheels):
    rest, same, other = parameters
    left, right = 1 - min(sensors[0:3]) / 500, 1 - min(sensors[3:6]) / 500  # 0.1 in the dark, 1 in bright light
    wheels[0] = rest + same * left + other * right
    wheels[1] = rest + same * right + other * left


KINDS = {"fear": (2, 10, 0), "aggression": (2, 0, 10), "love": (8, -8, 0), "exploration": (8, 0, -7)}
STARTS = [(150, 200, 0.0), (150, 600, 0.0), (650, 250, math.pi), (650, 550, math.pi)]

figure, axes = plt.subplots(2, 2, figsize=(8, 8.2), sharex=True, sharey=True, layout="constrained")
for panel, (name, parameters) in zip(axes.flat, KINDS.items()):
    nearest_mm = []
    for start in STARTS:
        sim = kiks.Simulation(kiks.Arena.box(800, 800, wall_mm=0), seed=1)
        sim.place(1, *start)
        sim.add_lamp(400, 400, 10.0)
        sim.record_paths(0.1)
        kiks.drive(sim.port(1), vehicle, parameters, seconds=20)
        _, x_mm, y_mm, _ = sim.paths()[0].T
        panel.plot(x_mm, y_mm)
        panel.plot(x_mm[0], y_mm[0], "o", color=panel.lines[-1].get_color())
        nearest_mm.append(min(math.dist(place, (400, 400)) for place in zip(x_mm, y_mm)))
    panel.plot(400, 400, "*", color="gold", markeredgecolor="black", markersize=18)
    panel.set(title=name, xlim=(0, 800), ylim=(0, 800), aspect="equal")
    print(f"{name}: {min(nearest_mm):.0f} to {max(nearest_mm):.0f} mm from the lamp where they are nearest")
figure.supxlabel("x [mm]")
figure.supylabel("y [mm]")
figure.savefig("vehicles.png", dpi=150)
