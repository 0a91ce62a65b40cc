"""
What the camera sees
====================

The K213 is a camera of one line: 64 greys across 36 degrees. A robot turns once on the spot, among a white
ball and black cylinders. Each row is a picture, the first on top: what stands still passes from right to left.
The exposure makes the brightest thing white, so all else is dark beside the ball.
"""

import matplotlib.pyplot as plt
import numpy as np

import kiks

sim = kiks.Simulation(kiks.Arena.box(700, 700, brightness=60), seed=1)
sim.place(1, 350, 350, 0.9)
sim.fit(1, "k213")
sim.add_ball(520, 350, brightness="white")
for x_mm, y_mm in ((350, 500), (220, 270), (400, 200), (240, 420)):
    sim.add_cylinder(x_mm, y_mm, brightness="black")

robot = kiks.Khepera(sim.url(1), baud=38400)
robot.set_speed(2, -2)
pictures, headings_deg = [], []
while sim.time_s < 10.5:
    pictures.append(robot.image())
    headings_deg.append(np.degrees(sim.pose(1)[2]))
    robot.pause(0.05)
print(f"{len(pictures)} pictures, greys from {np.min(pictures)} to {np.max(pictures)}")

figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
axes.imshow(pictures, cmap="gray", aspect="auto", extent=(18, -18, sim.time_s, 0), interpolation="nearest")
axes.set(xlabel="direction seen from the robot [degrees], left positive", ylabel="time [s]")
figure.savefig("what_a_camera_sees.png", dpi=150)
