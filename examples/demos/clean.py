"""Clean a room: find the cylinders that stand about and push them to the walls.

A cylinder fits between the two diagonal sensors, a wall does not. So the robot turns towards whatever it sees, and
pushes what is in front of it, until that is a wall or moves no more. Then it backs off and looks elsewhere.
"""

import sys
import time

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

CRUISE = 30  # speed ahead, with a cylinder or without [pulses in 10 ms]
WALL = 700  # both diagonal sensors read this in front of a wall, and never before a cylinder
BLOCKED_STEPS = 8  # after so many steps with wheels slower than half of what was asked, nothing moves any more
BACK = 1000  # how far to back off [pulses]: 80 mm, so that turning does not touch what was brought
TURN_LEAST, TURN_RANGE = 625, 830  # how far each wheel goes in a turn [pulses]: 108 to 252 degrees
GOLDEN = 0.618  # by this share of the range each turn differs from the one before: no direction is left out for long


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        def move(left: int, right: int) -> None:
            """Turn each wheel by so many pulses, and wait until both have arrived."""
            ask("G,0,0")
            ask(f"C,{left},{right}")
            while True:
                has_left_arrived, _, _, has_right_arrived, _, _ = ask("K")
                if has_left_arrived and has_right_arrived:
                    break

        slow_steps = turns = 0
        try:
            while True:
                left, diagonal_left, front_left, front_right, diagonal_right, right, *_ = ask("N")
                slow_steps = slow_steps + 1 if sum(ask("E")) < CRUISE else 0
                if min(diagonal_left, diagonal_right) > WALL or slow_steps > BLOCKED_STEPS:
                    slow_steps, turns = 0, turns + 1
                    ask("D,0,0")  # a move begins with the speed that there is, so stop first
                    time.sleep(0.1)
                    ask("J,40,128,40,128")
                    move(-BACK, -BACK)
                    turn = TURN_LEAST + round(TURN_RANGE * (turns * GOLDEN % 1))
                    move(turn, -turn)
                    continue
                turn = (right + diagonal_right + front_right - left - diagonal_left - front_left) / 100
                turn = max(-CRUISE, min(CRUISE, turn))
                ask(f"D,{round(CRUISE + turn)},{round(CRUISE - turn)}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
