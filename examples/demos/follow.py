"""Follow the wall on the left: drive straight on until there is one, then keep the distance to it."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

CRUISE = 5  # speed along the wall [pulses in 10 ms]
WANTED = 400  # what the left side reads at the right distance, about 25 mm from a white wall
CORNER_STEPS = 300  # after so many steps without a wall there is none round the corner: straight on


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        lost_steps = CORNER_STEPS
        try:
            while True:
                left, front_left, front, front_right = ask("N")[:4]
                nearest = max(left, front_left)
                lost_steps = 0 if nearest > 60 else lost_steps + 1
                # Away from a wall that is too near, towards one that is too far, and hard away from one ahead.
                drift = 2.8 if lost_steps < CORNER_STEPS else 0.0
                turn = max(-drift, min(5.0, (nearest - WANTED) / 50))
                turn += (max(0, front_left - WANTED) + max(front, front_right)) / 5
                left_speed, right_speed = max(-6, min(9, CRUISE + turn)), max(-6, min(9, CRUISE - turn))
                ask(f"D,{round(left_speed)},{round(right_speed)}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
