"""Watch a bright ball with the linear camera K213: find it, keep it in the middle of the picture, and stay near it."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

BRIGHT = 150  # grey above which a pixel shows the ball
DARK = 100  # such grey must be beside the ball: the exposure makes the brightest thing white, were it a wall on its own
FEWEST = 4  # so many bright pixels are a ball: noise makes one or two
WANTED = 32  # bright pixels when the ball is as far as it should be, a hand's width
SEARCH_SPEED = 6  # speed of the wheels while the robot looks round for the ball [pulses in 10 ms]


def main() -> None:
    # A picture takes 75 ms on this line, and 0.3 s at 9600 baud.
    with serial.Serial(PORT, 38400, timeout=1) as port:

        def ask(command: str) -> list[int]:
            """Send a command and return the numbers of the reply."""
            port.write(command.encode() + b"\n")
            return [int(word) for word in port.readline().split(b",") if word.strip().isdigit()]

        ask("T,2,U,1")  # a picture each 50 ms
        side = 1  # where the ball was seen last: 1 is right, -1 left
        try:
            while True:
                _, *image = ask("T,2,N")
                bright = [place for place, grey in enumerate(image) if grey > BRIGHT]
                if len(bright) < FEWEST or min(image) > DARK:
                    ask(f"D,{side * SEARCH_SPEED},{-side * SEARCH_SPEED}")
                    continue
                off_centre = sum(bright) / len(bright) - (len(image) - 1) / 2
                side = 1 if off_centre > 0 else -1
                # At the edge of the picture a part of the ball may be missing: turn first, judge its distance then.
                ahead = 0.8 * (WANTED - len(bright)) if abs(off_centre) < 14 else 0.0
                ahead, turn = max(-12.0, min(12.0, ahead)), off_centre / 5
                ask(f"D,{round(ahead + turn)},{round(ahead - turn)}")
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
