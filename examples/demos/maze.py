"""Find the way out of a maze, to the lamp in its exit: follow the wall, and near the lamp go for its light."""

import sys
import time

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

CRUISE, WANTED, CORNER_STEPS = 5, 400, 300  # as in follow.py
BRIGHT = 330  # below this light reading the lamp is in sight and near: 120 mm, if it has 1 W
ARRIVED = 58  # such light is there only within a few millimetres of the lamp
CREEP = 3  # speed towards the lamp [pulses in 10 ms]

# How much to turn right for the light that the brightest sensor sees, from the left clockwise.
TURN = [-3, -2, -1, 1, 2, 3, 4, -4]


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        begin, lost_steps = time.time(), CORNER_STEPS
        try:
            while True:
                light = ask("O")
                brightest = min(light)  # light makes readings small
                if brightest < ARRIVED:
                    print(f"At the lamp after {time.time() - begin:.1f} s.")
                    break
                if brightest < BRIGHT:
                    turn = TURN[light.index(brightest)]
                    ask(f"D,{CREEP + turn},{CREEP - turn}")
                    continue
                left, front_left, front, front_right = ask("N")[:4]
                nearest = max(left, front_left)
                lost_steps = 0 if nearest > 60 else lost_steps + 1
                drift = 2.8 if lost_steps < CORNER_STEPS else 0.0
                side = max(-drift, min(5.0, (nearest - WANTED) / 50))
                side += (max(0, front_left - WANTED) + max(front, front_right)) / 5
                left_speed, right_speed = max(-6, min(9, CRUISE + side)), max(-6, min(9, CRUISE - side))
                ask(f"D,{round(left_speed)},{round(right_speed)}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
