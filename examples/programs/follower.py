"""Follow whatever is ahead: towards it while it is far, back when it is near. `leader.py` drives ahead."""

import sys
import time

import serial

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 60

robot = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)


def ask(command):
    robot.write(command.encode() + b"\n")
    return [int(word) for word in robot.readline().split(b",")[1:]]


begin_s = time.monotonic()
while time.monotonic() - begin_s < SECONDS:
    left, front_left, ahead_left, ahead_right, front_right, right = ask("N")[:6]
    turn = (left + front_left - right - front_right) // 100
    ahead = max(ahead_left, ahead_right)
    speed = 5 if ahead < 100 else 2 if ahead < 300 else -2
    ask(f"D,{max(-8, min(8, speed - turn))},{max(-8, min(8, speed + turn))}")
    time.sleep(0.05)
ask("D,0,0")
