"""Pictures: turn round slowly and print each picture of the K213, a line of 64 greys. The robot needs that turret."""

import sys

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

PICTURES = 60
SHADES = " .:-=+*#%@"  # from dark to bright


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> str:
            """Send a command and return the robot's reply."""
            port.write(command.encode() + b"\n")
            return port.readline().decode().strip()

        if not ask("T,2,B").startswith("t,2,b"):
            sys.exit("This robot has no K213. Start KiKS with --turret k213, or fit one on the desk.")
        ask("T,2,U,1")  # a picture each 50 ms
        ask("D,2,-2")
        try:
            for _ in range(PICTURES):
                greys = [int(word) for word in ask("T,2,N").split(",")[3:]]
                print("".join(SHADES[grey * len(SHADES) // 256] for grey in greys))
        finally:
            ask("D,0,0")


if __name__ == "__main__":
    main()
