"""Stay 20 to 40 mm from the wall on the left for two minutes."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(2, 2)
    for _ in range(20):
        print("Sensor 0, on the left, reads", robot.proximity()[0])
    robot.stop()
