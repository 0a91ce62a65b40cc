"""Stop 20 mm before the wall, whatever its colour."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    for _ in range(5):
        print("Sensors 2 and 3 read", robot.proximity()[2:4])
        robot.set_speed(2, 2)
        robot.pause(0.5)
        robot.stop()
