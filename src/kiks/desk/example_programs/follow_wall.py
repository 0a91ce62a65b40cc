"""Follow the wall: keep it at the left hand, always at the same distance."""

import sys
import time

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

SECONDS = 60  # how long it drives
SPEED = 6  # [pulses in 10 ms]
WANTED = 300  # what the left sensor reads at the right distance; more is nearer
NEAR = 150  # from here on something is in front


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        has_wall = False
        try:
            end = time.time() + SECONDS
            while time.time() < end:
                left, half_left, front_left, front_right = ask("N")[:4]
                in_front = max(front_left, front_right)
                has_wall = has_wall or in_front > NEAR
                if in_front > NEAR:
                    ask(f"D,{SPEED},{-SPEED}")  # turn to the right, until the front is free
                elif not has_wall:
                    ask(f"D,{SPEED},{SPEED}")  # no wall yet: straight on
                else:
                    # Too far: turn to the left. Too near: turn to the right.
                    error = (max(left, half_left) - WANTED) / 150
                    turn = round(max(-3, min(3, error)))
                    ask(f"D,{SPEED + turn},{SPEED - turn}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
