"""Stop at the reading that a white wall gives: a darker wall is nearer then."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(2, 2)
    while robot.proximity()[2] < 600:
        pass
    robot.stop()
    robot.pause(1)
