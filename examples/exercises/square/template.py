"""Drive a square of 200 mm to the left. The same program drives a real robot."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(5, 5)  # 1 is 8 mm/s
    robot.pause(1.0)
    robot.stop()
    print("The wheels have turned by", robot.encoders(), "pulses of 0.08 mm.")
