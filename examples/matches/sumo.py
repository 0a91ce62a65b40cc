"""A sumo wrestler: turn until the camera sees the other robot, and push. `kiks demo sumo` lets two of them meet.

    python examples/matches/sumo.py /dev/ttyUSB0

The robot needs a K213 and a line of 38400 baud (mode 3); the other one is white, and the wall dark.
"""

import sys

import serial

# The light level of the K213 says how dark the picture was: with a white robot in it always less than this.
SEEN = 720
# A proximity sensor that sees so much has the wall before it, unless the other robot is there.
NEAR = 200

port = serial.Serial(sys.argv[1], 38400, stopbits=2, timeout=1)


def ask(order: str) -> list[int]:
    """Send an order, and return the numbers of the reply."""
    port.write(order.encode() + b"\n")
    return [int(word) for word in port.read_until().split(b",") if word.strip().isdigit()]


ask("T,2,U,1")  # a picture each 50 ms
turn = 6
while True:
    _turret, high, low = ask("T,2,L")
    if 256 * high + low < SEEN:
        _turret, pixel = ask("T,2,O")
        aside = round((31.5 - pixel) / 4)  # the brightest pixel, 0 on the left to 63 on the right
        turn = 6 if aside > 0 else -6
        ask(f"D,{16 - aside},{16 + aside}")
        continue
    left, half_left, ahead_left, ahead_right, half_right, right, *_ = ask("N")
    if max(half_left, ahead_left, ahead_right, half_right) > NEAR:
        ask("D,-6,-6")  # away from the wall
    else:
        ask(f"D,{-turn},{turn}")
