"""
A family of imperfect robots
============================

No two robots of a shelf are equal: sensors differ by a fifth, wheels and motors by some hundredths. Ten of
them drive in the same room from the same place. On the left they drive by the clock, and spread; on the right
by their sensors, and stay together.
"""

import matplotlib.pyplot as plt
import numpy as np

import kiks
from kiks.model.family import family


def by_the_clock(robot):
    for seconds in (8.7, 7.6, 8.7):
        robot.set_speed(8, 8)
        robot.pause(seconds)
        robot.set_speed(5, -5)
        robot.pause(1.04)


def by_their_sensors(robot):
    for _ in range(3):
        while max((near := robot.proximity())[1:5]) < 500:
            turn = np.clip((near[0] - 350) / 80, -3, 3)
            robot.set_speed(8 + turn, 8 - turn)
        robot.set_speed(5, -5)
        while max(robot.proximity()[1:4]) > 100:
            pass


robots = family(kiks.RobotSpec.load("khepera"), 10, seed=1)
figure, axes = plt.subplots(1, 2, figsize=(9, 4.4), sharey=True, layout="constrained")
for drive, panel in zip((by_the_clock, by_their_sensors), axes):
    ends = []
    for kind in robots:
        sim = kiks.Simulation(kiks.Arena.box(700, 600), robot=kind, seed=1)
        sim.place(1, 100, 550, 0.0)
        sim.record_paths(0.1)
        robot = kiks.Khepera(sim.port(1))
        drive(robot)
        robot.stop()
        _, x_mm, y_mm, _ = sim.paths()[0].T
        panel.plot(x_mm, y_mm, linewidth=1)
        panel.plot(x_mm[-1], y_mm[-1], "o", color=panel.lines[-1].get_color(), markersize=5)
        ends.append((x_mm[-1], y_mm[-1]))
    spread_mm = np.hypot(*np.std(ends, axis=0))
    name = drive.__name__.replace("_", " ")
    print(f"{name}: the ends are spread by {spread_mm:.0f} mm")
    panel.set(xlabel="x [mm]", title=name, xlim=(0, 700), ylim=(0, 600), aspect="equal")
axes[0].set_ylabel("y [mm]")
figure.savefig("imperfect_robots.png", dpi=150)
