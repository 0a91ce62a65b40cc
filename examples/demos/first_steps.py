"""First steps: switch a light on, drive ahead, turn round, and ask the robot what it sees."""

import sys
import time

import serial

# The name of the port is the first word after the program's name. KiKS takes any name.
PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"


def main() -> None:
    with serial.Serial(PORT, 9600, timeout=1) as port:

        def ask(command: str) -> str:
            """Send a command and return the robot's reply."""
            port.write(command.encode() + b"\n")
            return port.readline().decode().strip()

        print("Version of the robot:", ask("B"))

        ask("L,0,1")  # the light at the side: on
        print("Ahead for two seconds ...")
        ask("D,5,5")  # both wheels: 5 pulses in 10 ms, that is 40 mm/s
        time.sleep(2)

        print("... and a turn on the spot ...")
        ask("D,5,-5")  # the left wheel ahead, the right one back: it turns to the right
        time.sleep(2)

        print("... and stop.")
        ask("D,0,0")
        ask("L,0,0")

        print("The wheels have turned by", ask("H"), "pulses of 0.08 mm.")
        print("What the eight sensors see, from the left clockwise:", ask("N"))


if __name__ == "__main__":
    main()
