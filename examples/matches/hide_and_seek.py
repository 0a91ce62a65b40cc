"""A player of hide and seek: `seek` wanders and turns to what is white, `hide` goes along walls and stops in a corner.

    python examples/matches/hide_and_seek.py /dev/ttyUSB0 seek

The robot needs a K213 and a line of 38400 baud (mode 3); the other one is white, and the walls are dark.
"""

import sys
import time

import serial

# The light level of the K213 says how dark the picture was: with a white robot in it always less than this.
SEEN = 1000
# A wall is so near: turn away.
NEAR = 150

port = serial.Serial(sys.argv[1], 38400, stopbits=2, timeout=1)


def ask(order: str) -> list[int]:
    """Send an order, and return the numbers of the reply."""
    port.write(order.encode() + b"\n")
    return [int(word) for word in port.read_until().split(b",") if word.strip().isdigit()]


def avoid(sensors: list[int]) -> bool:
    """Turn away from a wall; return whether there is one."""
    if max(sensors[1:5]) < NEAR:
        return False
    ask("D,-5,5" if sum(sensors[3:6]) > sum(sensors[:3]) else "D,5,-5")
    return True


def seek() -> None:
    """Look round, go on, and keep what is white in the middle of the picture."""
    looks, steps = 0, 0
    while True:
        steps += 1
        sensors = ask("N")
        _turret, high, low = ask("T,2,L")
        if 256 * high + low < SEEN:
            _turret, pixel = ask("T,2,O")
            turn = round((31.5 - pixel) / 5)  # the brightest pixel, 0 on the left to 63 on the right
            speed = 0 if max(sensors[1:5]) > NEAR else 8
            ask(f"D,{speed - turn},{speed + turn}")
            looks = 40
        elif looks > 0:
            looks -= 1
            ask("D,6,-6")
        elif not avoid(sensors):
            ask("D,16,16")
            looks = 45 * (steps % 40 == 0)  # now and then once round


def hide() -> None:
    """Drive away for some seconds, then stop where two walls are near."""
    began_s = time.monotonic()
    while True:
        sensors = ask("N")
        is_corner = min(max(sensors[:2]), max(sensors[4:6])) > NEAR
        if time.monotonic() - began_s > 8 and is_corner:
            ask("D,0,0")
            time.sleep(0.1)
        elif not avoid(sensors):
            ask("D,14,14")


ask("T,2,U,1")  # a picture each 50 ms
seek() if sys.argv[2:] == ["seek"] else hide()
