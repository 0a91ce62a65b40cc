"""Wander about: drive straight on, and turn where something is near."""

import time

import serial

robot = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)


def ask(command):
    """Send a command, and return the numbers of the reply."""
    robot.write(command.encode() + b"\n")
    return [int(word) for word in robot.readline().split(b",")[1:]]


end_s = time.monotonic() + 60
while time.monotonic() < end_s:
    readings = ask("N")
    if max(readings[1:5]) > 200:
        ask("D,4,-4")
    else:
        ask("D,6,6")
    time.sleep(0.05)
ask("D,0,0")
print("odometer:", ask("H"))
