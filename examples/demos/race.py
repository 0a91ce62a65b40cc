"""Race round a track with a white wall on the right, as near to it as the sensors see and never at it.

The robot steers by one number, how near the wall is on the right and ahead of it there, and by how fast that changes.
"""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

CRUISE = 80  # mean speed of the wheels [pulses in 10 ms]: 640 mm/s
WANTED = 350  # what the right side reads at the right distance, some 25 mm
SHARPEST = 0.6  # most that a wheel is faster or slower than the mean, as a share of it


def main() -> None:
    # At 9600 baud readings come a third as often, and half of the speed is enough.
    with serial.Serial(PORT, 38400, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        last_near = float(WANTED)
        try:
            while True:
                _, _, front_left, front_right, diagonal, right, *_ = ask("N")
                near = max(right, 0.7 * diagonal)
                change, last_near = near - last_near, near
                left_turn = 0.0004 * (near - WANTED) + 0.0024 * change + 0.0005 * (front_left + front_right)
                left_turn = max(-SHARPEST, min(SHARPEST, left_turn))
                ask(f"D,{round(CRUISE * (1 - left_turn))},{round(CRUISE * (1 + left_turn))}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
