"""Drive to a lamp with an e-puck, by binary requests: one for all sensors, one for both wheels.

    python examples/demos/epuck_light.py /dev/rfcomm0

A byte is a letter with a minus before it: -'N' is B2, proximity, and -'O' is B1, light. A 0 ends the request.
"""

import struct
import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/rfcomm0"

SENSORS = bytes((256 - ord("N"), 256 - ord("O"), 0))
SPEEDS = bytes((256 - ord("D"),))

CRUISE = 400  # speed ahead [steps/s]
NEAR = 150  # reading of a sensor that something is before

# How far each sensor, from the front right clockwise, looks to the left: -1 right, 1 left.
SIDE = [-0.3, -0.8, -1.0, -0.5, 0.5, 1.0, 0.8, 0.3]


def main() -> None:
    with serial.Serial(PORT, 115200, timeout=1) as port:

        def drive(left: float, right: float) -> None:
            """Set the speeds of the wheels; there is no reply."""
            port.write(SPEEDS + struct.pack("<hh", round(left), round(right)) + b"\0")

        try:
            while True:
                port.write(SENSORS)
                readings = struct.unpack("<16H", port.read(32))
                near, light = readings[:8], readings[8:]
                # The brighter it is, the less a sensor reads: what is missing to the darkest one is light.
                dark = max(light)
                turn = sum(side * (dark - count) for side, count in zip(SIDE, light, strict=True)) / 4
                # A wall ahead counts more than the lamp.
                turn -= sum(side * count for side, count in zip(SIDE, near, strict=True) if count > NEAR)
                turn = max(-CRUISE, min(CRUISE, turn))
                drive(CRUISE - turn, CRUISE + turn)
        finally:
            drive(0, 0)


if __name__ == "__main__":
    main()
