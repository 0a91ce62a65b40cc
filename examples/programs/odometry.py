"""Reckon where the robot is from the counters of its wheels, and say how it would drive home."""

import math
import time

import serial

PULSE_MM, WHEEL_BASE_MM = 0.08, 53.0

robot = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)


def ask(command):
    robot.write(command.encode() + b"\n")
    return [int(word) for word in robot.readline().split(b",")[1:]]


x_mm = y_mm = heading_rad = 0.0
ask("G,0,0")
before = [0, 0]
for step in range(300):
    near = ask("N")
    ask("D,5,-5" if max(near[1:5]) > 200 else "D,6,5")
    counters = ask("H")
    left_mm, right_mm = (PULSE_MM * (new - old) for new, old in zip(counters, before))
    before = counters
    heading_rad += (right_mm - left_mm) / WHEEL_BASE_MM
    x_mm += (left_mm + right_mm) / 2 * math.cos(heading_rad)
    y_mm += (left_mm + right_mm) / 2 * math.sin(heading_rad)
    time.sleep(0.02)
ask("D,0,0")
home_deg = math.degrees(math.atan2(-y_mm, -x_mm) - heading_rad) % 360
print(f"home is {math.hypot(x_mm, y_mm):.0f} mm away, {home_deg:.0f} degrees to the left")
