"""Drive straight on, and turn away from what is near: cylinders are only pushed by chance."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    while True:
        _, left, ahead_left, ahead_right, right, *_ = robot.proximity()
        if min(left, right) > 300 or max(left, right) > 900:
            robot.set_speed(8, -8)
            robot.pause(0.4)
        else:
            robot.set_speed(15, 15)
