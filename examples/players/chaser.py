"""A soccer player in thirty lines: it runs after the ball, wherever that goes. `kiks demo soccer` plays better.

python examples/players/chaser.py /dev/ttyUSB0
kiks demo soccer examples/players/chaser.py kiks://1
"""

import sys

import serial

# The light level of the K213 says how dark the picture was: with the white ball in it always less than this.
BALL_LIMIT = 720

port = serial.Serial(sys.argv[1], 38400, stopbits=2, timeout=1)


def ask(order: str) -> list[int]:
    port.write(order.encode() + b"\n")
    return [int(word) for word in port.read_until().split(b",") if word.strip().isdigit()]


ask("T,2,U,1")  # a picture each 50 ms
while True:
    _turret, high, low = ask("T,2,L")
    if 256 * high + low > BALL_LIMIT:
        ask("D,-5,5")  # turn until it is in sight
        continue
    _turret, pixel = ask("T,2,O")
    turn = round((31.5 - pixel) / 6)  # the brightest pixel, 0 on the left to 63 on the right
    ask(f"D,{14 - turn},{14 + turn}")
