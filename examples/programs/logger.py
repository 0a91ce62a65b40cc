"""Log a drive: time, counters and readings into a CSV file, ten rows a second."""

import csv
import sys
import time

import serial

FILE = sys.argv[1] if len(sys.argv) > 1 else "drive.csv"

robot = serial.Serial("/dev/ttyUSB0", 38400, timeout=1)


def ask(command):
    robot.write(command.encode() + b"\n")
    return [int(word) for word in robot.readline().split(b",")[1:]]


with open(FILE, "w", newline="") as file:
    rows = csv.writer(file)
    rows.writerow(["time_s", "left", "right", *(f"ir{number}" for number in range(8))])
    ask("G,0,0")
    begin_s = time.monotonic()
    for number in range(200):
        readings = ask("N")
        ask("D,5,-3" if max(readings[1:5]) > 200 else "D,6,6")
        rows.writerow([f"{time.monotonic() - begin_s:.3f}", *ask("H"), *readings])
        time.sleep(max(0.0, begin_s + 0.1 * (number + 1) - time.monotonic()))
    ask("D,0,0")
print("wrote", FILE)
