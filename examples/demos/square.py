"""A square: drive four sides of 100 mm, and measure sides and corners with the counters of the wheels."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

MM_IN_A_PULSE = 0.08
SIDE = round(100 / MM_IN_A_PULSE)  # [pulses]
CORNER = round(3.1416 / 2 * 53 / 2 / MM_IN_A_PULSE)  # a quarter turn; the wheels are 53 mm apart [pulses]


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        def move(left: int, right: int) -> None:
            """Turn each wheel by so many pulses: first fast, at the end slowly."""
            ask("G,0,0")
            while True:
                done_left, done_right = ask("H")
                rest_left, rest_right = left - done_left, right - done_right
                if abs(rest_left) < 3 and abs(rest_right) < 3:
                    break
                ask(f"D,{speed(rest_left)},{speed(rest_right)}")
            ask("D,0,0")

        for side in range(1, 5):
            move(SIDE, SIDE)
            move(CORNER, -CORNER)  # to the right
            print("Side", side, "is done.")


def speed(rest: int) -> int:
    """Return a speed for a way that is left: at most 8, at least 1, none if there is nothing left."""
    if abs(rest) < 3:
        return 0
    fast = max(1, min(8, abs(rest) // 25))
    return fast if rest > 0 else -fast


if __name__ == "__main__":
    main()
