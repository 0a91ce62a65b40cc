"""A fighter: look for the other robot with the camera, turn to it, fire. `kiks demo battle` lets two of them meet.

The battle turret is a fiction of the Matlab KiKS. The other robot is white, and the walls are dark.
"""

import sys

import serial

# The light level of the K213 says how dark the picture was: with a white robot in it always less than this.
SEEN = 1000
# A wall is so near: turn away.
NEAR = 150

port = serial.Serial(sys.argv[1], 38400, stopbits=2, timeout=1)


def ask(order: str) -> list[int]:
    """Send an order, and return the numbers of the reply."""
    port.write(order.encode() + b"\n")
    return [int(word) for word in port.read_until().split(b",") if word.strip().lstrip(b"-").isdigit()]


ask("T,2,U,1")  # a picture each 50 ms
looks = 40
while True:
    *_, percent, energy, hits = ask("T,99,S")
    sensors = ask("N")
    _turret, high, low = ask("T,2,L")
    if 256 * high + low < SEEN:
        _turret, pixel = ask("T,2,O")
        aside = 31.5 - pixel  # the brightest pixel, 0 on the left to 63 on the right
        if abs(aside) < 3 and energy > 7:
            ask("D,0,0")
            _turret, target, _distance = ask("T,99,F")
            if target > 0:
                continue  # it was a hit: once more
        turn = round(aside / 5) or 1
        ask(f"D,{2 - turn},{2 + turn}")
    elif hits > 0:
        ask("D,-12,-8")  # out of the line of fire
    elif looks > 0:
        looks -= 1
        ask("D,5,-5")
    elif max(sensors[1:5]) > NEAR:
        looks = 60  # once round, and on in another direction
    else:
        ask("D,14,14")
