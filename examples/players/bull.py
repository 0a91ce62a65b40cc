"""A sumo wrestler without a camera: it charges ahead, and turns away when it sees something white or a wall.

python examples/players/bull.py /dev/ttyUSB0
kiks demo sumo examples/players/bull.py kiks://1
"""

import sys

import serial

port = serial.Serial(sys.argv[1], 9600, stopbits=2, timeout=1)


def ask(order: str) -> list[int]:
    port.write(order.encode() + b"\n")
    return [int(word) for word in port.read_until().split(b",")[1:]]


while True:
    sensors = ask("N")
    ahead = max(sensors[1:5])
    if ahead > 300:
        ask("D,20,20")  # as bright as that is the other robot
    elif ahead > 20:
        ask("D,-6,10")
    else:
        ask("D,8,7")
