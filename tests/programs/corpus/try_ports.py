"""Tries one port after the other until something answers like a Khepera, as old Windows programs do."""

import sys

import serial

CANDIDATES = sys.argv[1:] or [f"COM{number}" for number in range(1, 10)]


def open_robot(name):
    try:
        port = serial.Serial(name, 9600, timeout=0.5)
    except (serial.SerialException, OSError):
        return None
    for _ in range(3):
        port.reset_input_buffer()
        port.write(b"B\n")
        if port.readline().startswith(b"b,"):
            return port
    port.close()
    return None


for candidate in CANDIDATES:
    robot = open_robot(candidate)
    if robot is not None:
        break
else:
    print("No robot. Is it switched on?")
    sys.exit(1)

print("found a robot:", robot.is_open)
robot.write(b"D,1,1\n")
print(robot.readline().decode().split())
robot.write(b"D,0,0\n")
print(robot.readline().decode().split())
robot.close()
