"""Avoid: wander about without touching anything. What the sensors see pushes the wheels (Braitenberg's vehicle)."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

CRUISE = 6  # speed where nothing is near [pulses in 10 ms]

# How much each sensor, from the left clockwise, pushes each wheel: what is on the left makes the robot turn right.
LEFT_WHEEL = [5, 9, 14, -18, -12, -7, 2, 2]
RIGHT_WHEEL = [-7, -12, -18, 9, 9, 5, 2, 2]


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        try:
            while True:
                sensors = ask("N")
                left = right = float(CRUISE)
                for sensor, to_left, to_right in zip(sensors, LEFT_WHEEL, RIGHT_WHEEL, strict=True):
                    left += to_left * sensor / 250
                    right += to_right * sensor / 250
                left, right = max(-8, min(8, left)), max(-8, min(8, right))
                ask(f"D,{round(left)},{round(right)}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
