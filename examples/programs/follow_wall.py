"""Follow the wall on the left at a distance of some 25 mm."""

import sys

import serial

WANTED = 400
STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 2000

with serial.Serial("/dev/ttyUSB0", 38400, timeout=1) as robot:

    def ask(command):
        robot.write(f"{command}\n".encode())
        return [int(word) for word in robot.readline().split(b",")[1:]]

    for step in range(STEPS):
        left, front_left, front, front_right = ask("N")[:4]
        if max(front_left, front, front_right) > 500:
            ask("D,4,-4")  # a wall ahead: turn right
        elif left > 50:
            turn = max(-3, min(3, (left - WANTED) // 80))
            ask(f"D,{6 + turn},{6 - turn}")
        else:
            ask("D,3,6")  # the wall is gone: it is round the corner on the left
    ask("D,0,0")
