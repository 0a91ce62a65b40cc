"""Turn away when it is near, and back when nothing is seen: the way is a zigzag."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    while True:
        left, front_left, ahead_left, ahead_right, *_ = robot.proximity()
        if max(front_left, ahead_left, ahead_right) > 100:
            robot.set_speed(3, -3)
        elif left > 300:
            robot.set_speed(5, 3)
        else:
            robot.set_speed(3, 5)
