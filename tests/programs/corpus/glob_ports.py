"""Looks for a port with `glob`, as programs for Linux do, and asks pathlib and os whether it is there."""

import glob
import os
import sys
from pathlib import Path

import serial

pattern = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB*"
ports = sorted(glob.glob(pattern))
if not ports:
    sys.exit(f"nothing is plugged in that is called {pattern}")
name = ports[0]
print("it is there:", os.path.exists(name), Path(name).exists())
with serial.Serial(name, 19200, timeout=1) as robot:
    print("same name:", robot.name == name == robot.port)
    total = 0
    for _ in range(10):
        robot.write(b"O\n")
        letter, *light = robot.readline().decode().strip().split(",")
        total += len(light)
    print(letter, total)
