"""Follow a black line on the floor with the ground sensors of an e-puck."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/rfcomm0"

CRUISE = 500  # speed along a straight line [steps/s]
TURN = 0.7  # steps/s for each count by which one side of the line is darker than the other


def main() -> None:
    with serial.Serial(PORT, 115200, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        last_side = 0.0  # where the line was seen last: positive to the right
        try:
            while True:
                left, middle, right = ask("M")[:3]
                if min(left, middle, right) < 500:
                    last_side = left - right
                elif last_side:
                    last_side = 900.0 if last_side > 0 else -900.0  # it is lost: turn to where it was
                turn = TURN * last_side
                ask(f"D,{round(CRUISE + turn)},{round(CRUISE - turn)}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
