"""Turn a reading into a distance, by a measured table, and steer by how far that is from the wanted one."""

import numpy as np

import kiks

# Measured beside a white wall: what sensor 0, on the left side, reads at a distance [mm].
COUNTS = [8, 30, 82, 170, 330, 500, 690, 850]
DISTANCES_MM = [33.0, 32.0, 30.0, 27.5, 24.7, 22.3, 20.0, 17.5]
WANTED_MM, CRUISE = 27.0, 6

with kiks.Khepera("/dev/ttyUSB0") as robot:
    error = before = 0.0
    while True:
        left, front_left, ahead_left, ahead_right, *_ = robot.proximity()
        error = WANTED_MM - float(np.interp(left, COUNTS, DISTANCES_MM))
        turn = (
            0.25 * error + 0.5 * (error - before) + max(front_left - 60, 0) / 100 + max(ahead_left, ahead_right) / 150
        )
        before = error
        robot.set_speed(CRUISE + turn, CRUISE - turn)
