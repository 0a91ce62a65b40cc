"""Avoid with an e-puck: what its eight sensors see pushes the wheels (Braitenberg's vehicle)."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/rfcomm0"

CRUISE = 500  # speed where nothing is near [steps/s]

# How much each sensor, from the front right clockwise, pushes each wheel: away from what is there.
LEFT_WHEEL = [-0.9, -0.5, -0.2, 0.1, 0.1, 0.3, 0.6, 0.8]
RIGHT_WHEEL = [1.1, 0.6, 0.3, 0.1, 0.1, -0.2, -0.5, -0.9]


def main() -> None:
    with serial.Serial(PORT, 115200, timeout=5) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        # What the sensors read with nothing near becomes 0; the robot answers once more when that is done.
        port.write(b"K\n")
        port.readline()
        port.readline()
        try:
            while True:
                left = right = float(CRUISE)
                for sensor, to_left, to_right in zip(ask("N"), LEFT_WHEEL, RIGHT_WHEEL, strict=True):
                    left += to_left * sensor
                    right += to_right * sensor
                left, right = max(-600, min(800, left)), max(-600, min(800, right))
                ask(f"D,{round(left)},{round(right)}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
