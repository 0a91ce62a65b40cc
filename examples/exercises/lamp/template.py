"""Find the lamp, and stand near it."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    for _ in range(20):
        left, front_left, ahead_left, ahead_right, front_right, right, *behind = robot.ambient()
        print("Light on the left:", left, front_left, " on the right:", front_right, right)
        if max(robot.proximity()[1:5]) > 200:
            robot.set_speed(3, -3)
        else:
            robot.set_speed(3, 3)
    robot.stop()
