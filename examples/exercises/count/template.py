"""Stop beside the fourth post on the left."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(4, 4)
    for _ in range(50):
        left = robot.proximity()[0]
        if left > 300:
            print("Something is on the left:", left, "at", robot.encoders()[0], "pulses")
    robot.stop()
