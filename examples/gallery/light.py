"""
Light and shadow
================

How bright is it for a robot? Command ``O`` reads the light sensors: about 450 in the dark, less in light. The
map shows the brightest of the eight at each place of a room with a lamp and a wall that casts a shadow. Near
the lamp they read less than 100.
"""

import matplotlib.pyplot as plt
import numpy as np

import kiks

walls = np.zeros((420, 600), dtype=bool)
walls[[0, -1]] = walls[:, [0, -1]] = True
walls[150:320, 250:262] = True
sim = kiks.Simulation(kiks.Arena.from_array(walls), seed=1)
sim.add_lamp(130, 210, 4.0)

xs_mm, ys_mm = np.arange(32, 570, 8), np.arange(32, 390, 8)
counts = np.full((len(ys_mm), len(xs_mm)), np.nan)
for row, y_mm in enumerate(ys_mm):
    for column, x_mm in enumerate(xs_mm):
        if sim.arena.free_for(x_mm, y_mm, 28) and np.hypot(x_mm - 130, y_mm - 210) > 40:
            sim.place(1, x_mm, y_mm, 0.0)
            counts[row, column] = min(sim.ambient(1))
print(f"The brightest sensor reads {np.nanmin(counts):.0f} beside the lamp, and {np.nanmax(counts):.0f} in the shadow.")
assert np.nanmin(counts) < 100 < 400 < np.nanmax(counts)

figure, axes = plt.subplots(figsize=(8, 4.8), layout="constrained")
mesh = axes.pcolormesh(xs_mm, ys_mm, counts, cmap="inferno_r", shading="nearest")
axes.contour(sim.arena.brightness > 0, [0.5], colors="black", extent=(0, 600, 0, 420))
axes.plot(130, 210, "*", color="gold", markeredgecolor="black", markersize=16)
figure.colorbar(mesh, label="brightest sensor [counts], less is brighter")
axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
figure.savefig("light.png", dpi=150)
