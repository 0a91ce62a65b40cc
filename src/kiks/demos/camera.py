"""Watch a bright ball with the linear camera K213: find it, keep it in the middle of the picture, and stay near it."""

from __future__ import annotations

import sys

from kiks.client.khepera import Khepera

BAUD = 38400
"""Speed of the line: a picture takes 75 ms, at 9600 baud 0.3 s."""

BRIGHT = 150
"""Grey above which a pixel shows the ball."""

DARK = 100
"""Grey that there must be beside the ball: the exposure makes the brightest thing white, were it a wall on its own."""

FEWEST = 4
"""Bright pixels from which on they are a ball: noise makes one or two."""

WANTED = 32
"""Bright pixels when the ball is as far as it should be, a hand's width."""

SEARCH_SPEED = 6
"""Speed of the wheels while the robot looks round for the ball [pulses/10 ms]."""


class Camera:
    """The behaviour. It remembers on which side it saw the ball last: 1 is right, -1 left."""

    def __init__(self) -> None:
        self.side = 1

    def start(self, robot: Khepera) -> None:
        """Let the camera take a picture every 50 ms, as fast as it can."""
        robot.turret(2, "U,1")

    def step(self, robot: Khepera) -> None:
        """Look at one picture and set the speeds."""
        image = robot.image()
        bright = [place for place, grey in enumerate(image) if grey > BRIGHT]
        if len(bright) < FEWEST or min(image) > DARK:
            robot.set_speed(self.side * SEARCH_SPEED, -self.side * SEARCH_SPEED)
            return
        off_centre = sum(bright) / len(bright) - (len(image) - 1) / 2
        self.side = 1 if off_centre > 0 else -1
        # At the edge of the picture a part of the ball may be missing: turn first, judge its distance then.
        ahead = 0.8 * (WANTED - len(bright)) if abs(off_centre) < 14 else 0.0
        ahead, turn = max(-12.0, min(12.0, ahead)), off_centre / 5
        robot.set_speed(ahead + turn, ahead - turn)


if __name__ == "__main__":
    with Khepera(sys.argv[1] if len(sys.argv) > 1 else "kiks://1", baud=BAUD) as khepera:
        camera = Camera()
        camera.start(khepera)
        while True:
            camera.step(khepera)
