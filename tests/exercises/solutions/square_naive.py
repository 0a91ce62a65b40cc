"""Time in place of the way: what a wheel does in a second depends on the computer and the line."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    for _ in range(4):
        robot.set_speed(10, 10)
        robot.pause(2.4)
        robot.set_speed(-5, 5)
        robot.pause(1.1)
    robot.stop()
