"""
A slow program
==============

The robot drives on while its program thinks. Three programs that differ in nothing but the time they need for
a step follow the same wall: with ``thinking="fixed:MS"`` you try a slow computer without having one.
"""

import matplotlib.pyplot as plt
import numpy as np

import kiks

figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
for think_ms, colour in ((0, "tab:green"), (60, "tab:orange"), (150, "tab:red")):
    sim = kiks.Simulation(kiks.Arena.box(700, 450, rounded_mm=120), seed=1, thinking=f"fixed:{think_ms}")
    sim.place(1, 350, 50, 0.0)
    sim.record_paths(0.05)
    robot = kiks.Khepera(sim.port(1))
    while sim.time_s < 30:
        *_, front, front_right, right = robot.proximity()[:6]
        turn = -6 if max(front, front_right) > 400 else np.clip((350 - right) / 80, -3, 3)
        robot.set_speed(8 + turn, 8 - turn)
    _, x_mm, y_mm, _ = sim.paths()[0].T
    axes.plot(x_mm, y_mm, color=colour, label=f"{think_ms} ms: {sim.contacts(1)} contacts")
    print(f"{think_ms} ms for each command: {sim.travelled_mm(1):.0f} mm, {sim.contacts(1)} contacts")
axes.set(xlabel="x [mm]", ylabel="y [mm]", xlim=(0, 700), ylim=(0, 450), aspect="equal")
axes.legend(loc="center")
figure.savefig("thinking.png", dpi=150)
