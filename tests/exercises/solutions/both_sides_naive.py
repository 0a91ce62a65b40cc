"""Follow the wall on the left only."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    while True:
        left, front_left, ahead_left, ahead_right, *_ = robot.proximity()
        if max(front_left, ahead_left, ahead_right) > 200:
            robot.set_speed(4, -4)
        elif left > 300:
            robot.set_speed(6, 4)
        else:
            robot.set_speed(3, 6)
