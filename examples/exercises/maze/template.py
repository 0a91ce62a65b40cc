"""Find the way through the maze to the lamp."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(4, 4)
    for _ in range(40):
        if max(robot.proximity()[1:5]) > 200:
            break
    robot.stop()
    print("On the left:", robot.proximity()[0], " on the right:", robot.proximity()[5])
