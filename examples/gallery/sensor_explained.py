"""
A sensor explained
==================

A proximity sensor is seven rays. Here a robot stands before a white ball. ``explain`` says what the rays of a
sensor met, and how much of the reading each of them makes. The same sentences stand on the desk when you
click a sensor.
"""

import matplotlib.pyplot as plt
import numpy as np

import kiks

sim = kiks.Simulation(kiks.Arena.box(240, 160), seed=1)
sim.place(1, 90, 70, 0.0)
sim.add_ball(160, 95, brightness="white")

explanation = sim.explain(1, 2)
print(explanation.text())
assert explanation.rays[3].met == "ball 1"

# %%
# All 56 rays, and how much the seven of sensor 2 contribute to its reading:

figure, (room, parts) = plt.subplots(1, 2, figsize=(9, 3.6), width_ratios=(2, 1), layout="constrained")
x_mm, y_mm, _ = sim.pose(1)
sensors = sim.specs[0].proximity
for sensor in range(8):
    mount_rad, radius_mm = np.radians(sensors.mount_angle_deg[sensor]), sensors.mount_radius_mm[sensor]
    at = np.array([x_mm, y_mm]) + radius_mm * np.array([np.cos(mount_rad), np.sin(mount_rad)])
    for ray in sim.explain(1, sensor).rays:
        angle_rad = np.radians(ray.angle_deg)
        end = at + min(ray.length_mm, explanation.reach_mm) * np.array([np.cos(angle_rad), np.sin(angle_rad)])
        colour = "tab:red" if sensor == 2 else "tab:blue"
        room.plot(*zip(at, end), color=colour, linewidth=1, alpha=1.0 if ray.brightness else 0.25)
room.add_patch(plt.Circle((x_mm, y_mm), 27.5, color="lightgrey"))
room.add_patch(plt.Circle((160, 95), 32, color="tab:orange"))
room.imshow(sim.arena.brightness > 0, origin="lower", extent=(0, 240, 0, 160), cmap="Greys", zorder=0)
room.set(xlabel="x [mm]", ylabel="y [mm]", title="what the rays meet")

parts.bar(range(7), [ray.contribution_counts for ray in explanation.rays], color="tab:red")
parts.set_xticks(range(7), [f"{ray.angle_deg:.0f}" for ray in explanation.rays])
parts.set(xlabel="direction of the ray [degrees]", ylabel="its share [counts]")
parts.set_title(f"sensor 2 reads {explanation.count}")
figure.savefig("sensor_explained.png", dpi=150)
