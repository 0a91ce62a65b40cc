"""Show the eight proximity sensors as bars while the robot turns."""

import time

import serial

NAMES = ("left 90", "left 45", "left 10", "right 10", "right 45", "right 90", "back right", "back left")

with serial.Serial("/dev/ttyUSB0", 9600, timeout=1) as robot:
    robot.write(b"D,2,-2\n")
    robot.readline()
    for _ in range(20):
        robot.write(b"N\n")
        readings = [int(word) for word in robot.readline().split(b",")[1:]]
        print()
        for name, reading in zip(NAMES, readings):
            print(f"{name:>10} {'#' * (reading // 20)} {reading}")
        time.sleep(1)
    robot.write(b"D,0,0\n")
