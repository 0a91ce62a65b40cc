"""Five e-pucks in a column: the first drives in a wide circle, and each other one follows the robot ahead of it.

    python examples/demos/epuck_formation.py /dev/rfcomm0 /dev/rfcomm1 /dev/rfcomm2 /dev/rfcomm3 /dev/rfcomm4

The two sensors at the front say how near the robot ahead is, and those beside them on which side.
"""

import sys

import serial

PORTS = sys.argv[1:] or [f"/dev/rfcomm{number}" for number in range(5)]

LEADER = 260, 320  # speeds of the first robot [steps/s]
KEPT = 350  # reading of the front sensors at the distance to keep


def follow(readings: list[int]) -> tuple[int, int]:
    """Return the speeds of a robot that follows another, for what its eight sensors read."""
    front_right, right, front_left, left = readings[0], readings[1], readings[7], readings[6]
    ahead = (front_right + front_left) / 2
    # Slower when too near, faster when the other one is far: it is never faster than half as much again as the first.
    speed = max(0.0, min(440.0, 290 + 0.6 * (KEPT - ahead)))
    turn = 250 * (front_left + left - front_right - right) / max(front_left + left + front_right + right, 100)
    return round(speed - turn), round(speed + turn)


def main() -> None:
    lines = [serial.Serial(port, 115200, timeout=5) for port in PORTS]

    def ask(commands: list[str]) -> list[list[int]]:
        """Send each robot its command, and only then read the numbers of all replies."""
        for line, command in zip(lines, commands, strict=True):
            line.write(command.encode() + b"\n")
        return [[int(word) for word in line.readline().decode().split(",")[1:]] for line in lines]

    try:
        while True:
            speeds = [LEADER, *map(follow, ask(["N"] * len(lines))[1:])]
            ask([f"D,{left},{right}" for left, right in speeds])
    finally:
        ask(["D,0,0"] * len(lines))


if __name__ == "__main__":
    main()
