"""
How far a robot sees
====================

A robot drives up to a wall. The lines are what its two front sensors read on average, before walls of three
materials; the dots are single readings over the line, with their noise. Beyond 40 mm a robot is blind, and
black it does not see at all.
"""

import matplotlib.pyplot as plt
import numpy as np

import kiks

gaps_mm = np.linspace(1, 60, 100)
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
for brightness, colour in (("white", "tab:orange"), ("wood", "tab:brown"), ("black", "black")):
    sim = kiks.Simulation(kiks.Arena.box(400, 400, brightness=brightness), seed=1)
    robot = kiks.Khepera(sim.port(1))
    poses = [[390 - 27.5 - gap_mm, 200, 0] for gap_mm in gaps_mm]
    front = sim.proximity_at(1, np.array(poses))[:, 2:4].mean(axis=1)
    axes.plot(gaps_mm, front, color=colour, label=f"{brightness} wall")
    for gap_mm, pose in zip(gaps_mm[::3], poses[::3]):
        sim.place(1, *pose)
        sim.run(0.1)
        axes.plot([gap_mm] * 2, robot.proximity()[2:4], ".", color=colour, markersize=4)
    half = gaps_mm[np.argmin(np.abs(front - 512))]
    print(f"A {brightness} wall reads half of the range at {half:.0f} mm.")
axes.set(xlabel="gap between robot and wall [mm]", ylabel="reading [counts]", ylim=(0, 1100))
axes.grid(alpha=0.3)
axes.legend()
figure.savefig("reach.png", dpi=150)
