"""
A T-maze
========

A lamp on one side of the corridor tells the robot where to turn at its end, seconds later. So the robot must
remember the side: a T-maze is the smallest test of memory. The maze is an array, drawn in a few lines.
"""

import numpy as np

import kiks

walls = np.ones((420, 620), dtype=bool)  # True is wall, 1 mm a pixel, row 0 on top
walls[10:130, 10:610] = False
walls[10:410, 250:370] = False
maze = kiks.Arena.from_array(walls, name="T-maze")

for side, lamp_x_mm in (("left", 262), ("right", 358)):
    sim = kiks.Simulation(maze, seed=1)
    sim.place(1, 310, 50, np.pi / 2)
    sim.add_lamp(lamp_x_mm, 150, 0.5)
    robot = kiks.Khepera(sim.port(1))
    left_light, right_light = 0, 0
    with sim.record(f"{side}.mcap"):
        while max(robot.proximity()[2:4]) < 400:  # until a wall is ahead
            light = robot.ambient()  # less is brighter
            left_light += 500 - light[0]
            right_light += 500 - light[5]
            left, *_, right, _, _ = robot.proximity()
            robot.set_speed(*((6, 5) if left > right + 50 else (5, 6) if right > left + 50 else (6, 6)))
        quarter = round(np.pi / 2 * 53 / 2 / 0.08)  # pulses of a wheel for a quarter turn
        quarter = -quarter if left_light > right_light else quarter
        robot.set_encoders(0, 0)
        robot.move_to(quarter, -quarter, wait=True)
        robot.set_speed(6, 6)
        robot.pause(4)
        robot.stop()
    x_mm, _, _ = sim.pose(1)
    print(f"The lamp was on the {side}, the robot is at x = {x_mm:.0f} mm.")
    assert (x_mm < 200) if side == "left" else (x_mm > 420)
    kiks.Recording(f"{side}.mcap").export(f"t_maze_{side}.png")
