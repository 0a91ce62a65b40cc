"""Follow the wall, on the left or on the right."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(3, 3)
    for _ in range(20):
        left, front_left, ahead_left, ahead_right, front_right, right, *behind = robot.proximity()
        print("left:", left, front_left, " ahead:", ahead_left, ahead_right, " right:", front_right, right)
    robot.stop()
