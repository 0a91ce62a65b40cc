"""Push all cylinders to the wall."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(5, 5)
    for _ in range(20):
        print("Ahead:", robot.proximity()[1:5], " the wheels turn at", robot.speed())
    robot.stop()
