"""One program drives two robots: the first wanders, the second does the same in a mirror.

kiks run --robots 2 two_robots.py
"""

import time

import serial

leader, mirror = serial.Serial("/dev/ttyUSB0", 9600, timeout=1), serial.Serial("/dev/ttyUSB1", 9600, timeout=1)


def ask(port, command):
    port.write(command.encode() + b"\n")
    return [int(word) for word in port.readline().split(b",")[1:]]


def safe(port, left, right):
    """Drive, but turn where something is near."""
    near = max(ask(port, "N")[1:5])
    ask(port, "D,4,-4" if near > 200 else f"D,{left},{right}")


for step in range(300):
    bend = 2 if step // 50 % 2 else -2
    safe(leader, 5 + bend, 5 - bend)
    safe(mirror, 5 - bend, 5 + bend)
    time.sleep(0.05)
for port in (leader, mirror):
    ask(port, "D,0,0")
