"""Spread out over a room: many robots in a heap, each with a line of its own, and one program that drives them all.

    python examples/demos/swarm.py /dev/ttyUSB0 /dev/ttyUSB1 /dev/ttyUSB2

The program asks all robots first and then listens to all of them: their answers are on their lines at the same time.
One after the other would take as many times longer as there are robots.
"""

import sys

import serial

PORTS = sys.argv[1:] or [f"/dev/ttyUSB{number}" for number in range(20)]

CRUISE = 8  # speed ahead [pulses in 10 ms]
SEEN = 40  # reading that is more than noise: something is there
LONELY_STEPS = 70  # after so many steps, of 40 ms at 9600 baud, that a robot meets nothing, it rests

# How much to turn right for what each sensor sees, from the left clockwise: away from it.
AWAY = [0.01, 0.02, 0.03, -0.03, -0.02, -0.01, -0.005, 0.005]


def speeds(readings: list[int]) -> tuple[int, int]:
    """Return the speeds of the wheels of a robot that drives, left and right, for what its eight sensors read."""
    turn = sum(weight * reading for weight, reading in zip(AWAY, readings, strict=True))
    if max(readings[1:5]) > SEEN:
        # Something ahead: turn on the spot, to where there is more room.
        return (CRUISE, -CRUISE) if turn >= 0 else (-CRUISE, CRUISE)
    turn = max(-CRUISE, min(CRUISE, turn))
    return round(CRUISE + min(turn, 0)), round(CRUISE - max(turn, 0))


def main() -> None:
    lines = [serial.Serial(port, 9600, timeout=1) for port in PORTS]

    def ask(commands: list[str]) -> list[list[int]]:
        """Send each robot its command, and only then read the numbers of all replies."""
        for line, command in zip(lines, commands, strict=True):
            line.write(command.encode() + b"\n")
        return [[int(word) for word in line.readline().decode().split(",")[1:]] for line in lines]

    lonely_steps = [LONELY_STEPS] * len(lines)
    try:
        while True:
            commands = []
            for robot, readings in enumerate(ask(["N"] * len(lines))):
                lonely_steps[robot] = 0 if max(readings) > SEEN else lonely_steps[robot] + 1
                left, right = (0, 0) if lonely_steps[robot] > LONELY_STEPS else speeds(readings)
                commands.append(f"D,{left},{right}")
            ask(commands)
    finally:
        ask(["D,0,0"] * len(lines))


if __name__ == "__main__":
    main()
