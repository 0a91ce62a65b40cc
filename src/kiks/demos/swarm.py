"""Spread out over a room: many robots in a heap, each with a line of its own, and one program that drives them all.

The program asks all robots first and then listens to all of them: their answers are on their lines at the same time.
One after the other would take as many times longer as there are robots.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from kiks.client.port import Port, open_port

CRUISE = 8
"""Speed ahead [pulses/10 ms]."""

SEEN = 40
"""Reading that is more than noise: something is there."""

LONELY_STEPS = 70
"""Steps, of 40 ms at 9600 baud, that a robot drives on without meeting anything before it rests."""

# How much to turn right for what each sensor sees, clockwise from the left: away from it.
AWAY = (0.01, 0.02, 0.03, -0.03, -0.02, -0.01, -0.005, 0.005)


class Member:
    """The behaviour of one robot. It remembers for how many steps it has met nothing."""

    def __init__(self) -> None:
        self.lonely_steps = LONELY_STEPS

    def speeds(self, readings: Sequence[int]) -> tuple[int, int]:
        """Return the speeds of the wheels, left and right, for what the eight sensors read."""
        self.lonely_steps = 0 if max(readings) > SEEN else self.lonely_steps + 1
        if self.lonely_steps > LONELY_STEPS:
            return 0, 0
        turn = sum(weight * reading for weight, reading in zip(AWAY, readings, strict=True))
        if max(readings[1:5]) > SEEN:
            # Something ahead: turn on the spot, to where there is more room.
            return (CRUISE, -CRUISE) if turn >= 0 else (-CRUISE, CRUISE)
        turn = max(-CRUISE, min(CRUISE, turn))
        return round(CRUISE + min(turn, 0)), round(CRUISE - max(turn, 0))


class Swarm:
    """The program for all.

    Args:
        ports: The robots' lines.
    """

    def __init__(self, ports: Sequence[Port]) -> None:
        self.ports = ports
        self.members = [Member() for _ in ports]

    def step(self) -> None:
        """Let all robots read their sensors once, and set all speeds."""
        readings = self.ask(["N"] * len(self.ports))
        speeds = [member.speeds(own) for member, own in zip(self.members, readings, strict=True)]
        self.ask([f"D,{left},{right}" for left, right in speeds])

    def ask(self, requests: Sequence[str]) -> list[list[int]]:
        """Send each robot its request, and only then read the numbers of all answers."""
        for port, request in zip(self.ports, requests, strict=True):
            port.write(request.encode() + b"\n")
        return [[int(word) for word in port.read_until(b"\n").split(b",")[1:]] for port in self.ports]


if __name__ == "__main__":
    swarm = Swarm([open_port(name) for name in sys.argv[1:] or ["kiks://1"]])
    while True:
        swarm.step()
