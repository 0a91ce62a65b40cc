"""
Odometry beside the truth
=========================

A robot computes where it is from the counters of its wheels. Its wheels are up to two per cent larger or
smaller than it believes, as those of real robots are, and the error grows with the way. A simulation knows the truth.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import kiks
from kiks.model.family import family

khepera = kiks.RobotSpec.load("khepera")
sim = kiks.Simulation(kiks.Arena.box(1000, 1000), robot=family(khepera, 1, seed=5), seed=1)
sim.place(1, 250, 850, 0.0)
robot = kiks.Khepera(sim.port(1))

x_mm, y_mm, heading_rad = sim.pose(1)
before, guesses, truths = np.zeros(2), [], []
while sim.time_s < 120:
    robot.set_speed(8, 8 if sim.time_s % 10.47 < 7 else 5)  # straight ahead, then a bend to the right
    counters = np.array(robot.encoders())
    left_mm, right_mm = (counters - before) * khepera.body.pulse_mm
    before = counters
    heading_rad += (right_mm - left_mm) / khepera.body.wheel_base_mm
    x_mm += (left_mm + right_mm) / 2 * math.cos(heading_rad)
    y_mm += (left_mm + right_mm) / 2 * math.sin(heading_rad)
    guesses.append((x_mm, y_mm))
    truths.append(sim.pose(1)[:2])

guess, truth = np.array(guesses), np.array(truths)
error_mm = np.hypot(*(guess - truth).T)
way_mm = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(truth, axis=0).T))])
print(f"After {way_mm[-1] / 1000:.1f} m the robot believes to be {error_mm[-1]:.0f} mm from where it is.")

figure, (paths, errors) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
paths.plot(*truth.T, color="tab:blue", label="truth")
paths.plot(*guess.T, "--", color="tab:red", label="odometry")
paths.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
paths.legend()
errors.plot(way_mm / 1000, error_mm, color="tab:red")
errors.set(xlabel="way [m]", ylabel="error [mm]", ylim=(0, None), xlim=(0, None))
errors.grid(alpha=0.3)
figure.savefig("odometry.png", dpi=150)
