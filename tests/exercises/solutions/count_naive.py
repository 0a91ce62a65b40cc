"""One threshold: noise crosses it more than once, and the robot stops where the post begins."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(6, 6)
    count, was_seen = 0, False
    while count < 4:
        is_seen = robot.proximity()[0] > 500
        count += is_seen and not was_seen
        was_seen = is_seen
    robot.stop()
