"""Lead: drive along slowly, turn away from walls, and wait now and then. `follower.py` keeps behind.

kiks run leader.py follower.py
"""

import sys
import time

import serial

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 60

robot = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)


def ask(command):
    robot.write(command.encode() + b"\n")
    return [int(word) for word in robot.readline().split(b",")[1:]]


begin_s = time.monotonic()
while (now_s := time.monotonic() - begin_s) < SECONDS:
    near = max(ask("N")[1:5])
    ask("D,3,-3" if near > 150 else "D,3,3" if now_s % 10 < 8 else "D,0,0")
    time.sleep(0.05)
ask("D,0,0")
