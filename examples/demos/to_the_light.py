"""To the light: turn to the brighter side and drive there (Braitenberg's vehicle). Put a strong lamp near it."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

SPEED = 6  # [pulses in 10 ms]
FAINT = 12  # less light than this may be chance
NEAR = 300  # reflected light of something right in front


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().decode().split(",")[1:]]

        try:
            while True:
                # A light sensor reads less where it is brighter. How much brighter than at the darkest one is it?
                values = ask("O")
                light = [max(values) - value for value in values]
                on_left, on_right, behind = sum(light[:3]), sum(light[3:6]), sum(light[6:])
                if max(ask("N")[1:5]) > NEAR:
                    turn = 2 * SPEED  # something is in the way: turn on the spot
                elif on_left + on_right + behind < FAINT:
                    turn = 0  # no light: straight on
                elif behind > on_left + on_right:
                    turn = 2 * SPEED
                else:
                    # Crossed wires: what the left side sees drives the right wheel.
                    turn = round(SPEED * (on_left - on_right) / (on_left + on_right))
                ask(f"D,{SPEED - turn},{SPEED + turn}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
